/** A motion, or some periods of an orbit, as the pictures and the table read it. */
import type { Arrays, Head, Numbers } from "./link";

/** Least duration that is shown of an orbit, in its own periods. */
const REPEATS = 4;

export interface Motion {
  head: Head;
  orbit: boolean;
  dt: number;
  period: number | null;
  time: Float64Array;
  sample(name: string): Numbers;
  contactTime: Float64Array;
  contactGuard: Numbers;
  contact(name: string): Numbers | undefined;
  arrays: Arrays;
}

export function motionOf(head: Head, arrays: Arrays): Motion {
  const orbit = head.kind !== "motion",
    count: number = head.count,
    times = orbit && head.repeats !== false ? REPEATS : 1,
    span = (count - 1) * head.dt;
  const total = times > 1 && count > 1 ? (count - 1) * times + 1 : count,
    time = new Float64Array(total);
  for (let i = 0; i < total; i++) time[i] = head.t0 + i * head.dt;
  const known = new Map<string, Numbers>(),
    each = Math.max(count - 1, 1);
  const sample = (name: string): Numbers => {
    const own = arrays[`sample:${name}`] ?? new Float32Array(count).fill(NaN);
    if (total === count) return own;
    let all = known.get(name);
    if (!all) {
      all = new Float32Array(total);
      for (let i = 0; i < total; i++) all[i] = own[i === total - 1 ? each : i % each];
      known.set(name, all);
    }
    return all;
  };
  const own = (arrays.contact_time ?? new Float64Array()) as Float64Array,
    n = own.length,
    reps = total === count ? 1 : times;
  const contactTime = new Float64Array(n * reps);
  for (let r = 0; r < reps; r++) for (let i = 0; i < n; i++) contactTime[r * n + i] = own[i] + r * span;
  const repeated = (a: Numbers | undefined): Numbers | undefined => {
    if (!a || reps === 1) return a;
    const out = new Float64Array(n * reps);
    for (let i = 0; i < out.length; i++) out[i] = a[i % n];
    return out;
  };
  return {
    head,
    orbit,
    dt: head.dt,
    period: head.period ?? null,
    time,
    sample,
    arrays,
    contactTime,
    contactGuard: repeated(arrays.contact_guard) ?? new Uint8Array(),
    contact: name => repeated(arrays[`contact:${name}`]),
  };
}
