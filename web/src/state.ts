/** What is looked at: one view, its address, and the views before it (the browser's own history is the undo list). */
import { type About, coordinates, isOutput } from "./about";
import type { Range } from "./axes";
import type { Question } from "./link";

export type Box = [number, number, number, number]; // first axis from, to, second axis from, to [SI]
export interface View {
  values: Record<string, number>;
  start: Record<string, number>;
  axes: [string, string];
  box: Box;
  size: [number, number];
  method: string;
  against: string;
  differ: boolean; // the map shows where the two methods lead elsewhere
  periods: number;
  over: string;
  range: Range;
  quantity: string; // responses
  history: string;
  phase: [string, string];
  orbit: Question | null; // an orbit in place of the motion from the start
}

const finite = (v: unknown): v is number => typeof v === "number" && Number.isFinite(v);

/** A start in the coordinates of a map's axes; what isn't known is zero. */
export const startOf = (about: About, axes: [string, string], known: Record<string, number>): Record<string, number> =>
  Object.fromEntries(coordinates(about, axes).map(name => [name, known[name] ?? 0]));

/** Bits of the step between starts of a panned view, at most; all of a start's. */
const STEP_BITS = 20,
  BITS = 52;
/** A view as wide as the one before, moved so little that its starts are multiples of their step to the bit: what it shares with
 *  other such views the desk takes from these. */
export function snapped(box: Box, { box: before, size }: View): Box {
  const out = [...box] as Box;
  for (const [i, n] of [
    [0, size[0]],
    [2, size[1]],
  ]) {
    const [a, b] = [box[i], box[i + 1]],
      wide = b - a;
    if (Math.abs(wide - (before[i + 1] - before[i])) > 1e-6 * wide) return box;
    const step = wide / (n - 1),
      far = Math.ceil(Math.log2(Math.max(Math.abs(a), Math.abs(b)) / step + 1)),
      unit = 2 ** (Math.floor(Math.log2(step)) - Math.min(STEP_BITS, BITS - far));
    const exact = Math.round(step / unit) * unit;
    out[i] = Math.round(a / exact) * exact;
    out[i + 1] = out[i] + (n - 1) * exact;
  }
  return out;
}

/** What the phase portrait shows at first: of sensors one and its rate, where there is one. */
function firstPhase(about: About): [string, string] {
  const first = about.quantities.find(q => q.name === about.panels.history[0])!;
  const rate =
    first.kind === "output"
      ? about.quantities.find(q => q.kind === "output" && first.unit !== "" && q.unit === `${first.unit}/s`)
      : undefined;
  return rate ? [first.name, rate.name] : (about.panels.phase as [string, string]);
}

/** The view that a system opens with. */
export function firstView(about: About): View {
  const [a, b] = Object.keys(about.axes),
    response = about.panels.response,
    asked = about.view;
  const values = Object.fromEntries(about.parameters.map(p => [p.name, p.value]));
  const start = startOf(about, [a, b], { ...about.at, ...about.start });
  const view: View = {
    values,
    start,
    axes: [a, b],
    box: [...about.axes[a], ...about.axes[b]],
    size: [...about.size],
    method: about.method,
    against: "",
    differ: true,
    periods: 60,
    over: response?.parameter ?? "",
    range: response?.range ?? [0, 1],
    quantity: response?.quantity ?? about.panels.history[0],
    history: about.panels.history[0],
    phase: firstPhase(about),
    orbit: null,
  };
  if (finite(asked.motion?.periods)) view.periods = asked.motion.periods;
  return view;
}

/** The address of a view: what differs from the one that the system opens with. */
export function toAddress(view: View, first: View): string {
  const differs: Record<string, unknown> = {};
  for (const [key, value] of Object.entries(view)) {
    const before = first[key as keyof View];
    if (key === "orbit" || JSON.stringify(value) === JSON.stringify(before)) continue;
    const isRecord = value !== null && typeof value === "object" && !Array.isArray(value);
    differs[key] = isRecord
      ? Object.fromEntries(Object.entries(value).filter(([k, v]) => (before as Record<string, unknown>)[k] !== v))
      : value;
  }
  return encodeURIComponent(JSON.stringify(differs));
}

/** The view of an address. What doesn't fit the system is left as it is at first, and `damaged` is true. */
export function fromAddress(text: string, first: View, about: About): { view: View; damaged: boolean } {
  const view = structuredClone(first);
  let damaged = false,
    read: any;
  try {
    read = JSON.parse(decodeURIComponent(text));
  } catch {
    return { view, damaged: true };
  }
  if (read === null || typeof read !== "object" || Array.isArray(read)) return { view, damaged: true };
  const quantities = about.quantities.map(q => q.name),
    oneOf = (list: string[]) => (v: unknown) => typeof v === "string" && list.includes(v);
  const numbers = (n: number) => (v: unknown) => Array.isArray(v) && v.length === n && v.every(finite);
  const pair = (list: string[]) => (v: unknown) => Array.isArray(v) && v.length === 2 && v.every(oneOf(list));
  const record = (known: object) => (v: unknown) =>
    v !== null && typeof v === "object" && Object.entries(v).every(([k, x]) => Object.hasOwn(known, k) && finite(x));
  const checks: Record<string, (v: unknown) => boolean> = {
    values: record(first.values),
    start: record(Object.fromEntries(about.quantities.map(q => [q.name, 0]))),
    axes: pair(about.choices),
    size: v => numbers(2)(v) && (v as number[]).every(n => n >= 16 && n <= 4000 && n % 1 === 0),
    box: v => numbers(4)(v) && (v as Box)[0] < (v as Box)[1] && (v as Box)[2] < (v as Box)[3],
    method: oneOf(about.methods),
    against: oneOf(["", ...about.methods]),
    differ: v => typeof v === "boolean",
    periods: v => finite(v) && v >= 1 && v <= 1e6 && v % 1 === 0,
    over: oneOf(about.parameters.map(p => p.name)),
    range: v => numbers(2)(v) && (v as Range)[0] < (v as Range)[1],
    quantity: oneOf(quantities),
    history: oneOf(quantities),
    phase: pair(quantities),
  };
  for (const [key, value] of Object.entries(read)) {
    if (!Object.hasOwn(checks, key) || !checks[key](value)) {
      damaged = true;
      continue;
    }
    const isRecord = key === "values" || key === "start";
    Object.assign(view, { [key]: isRecord ? { ...(view[key as keyof View] as object), ...(value as object) } : value });
  }
  if (isOutput(about, view.axes[0]) !== isOutput(about, view.axes[1])) {
    view.axes = first.axes;
    view.box = first.box;
    damaged = true;
  }
  view.start = startOf(about, view.axes, view.start);
  if (view.axes[0] === view.axes[1]) {
    view.axes = first.axes;
    view.box = first.box;
    damaged = true;
  }
  return { view, damaged };
}

/** The views before and after this one: the browser's Back and Forward, and the buttons beside them. */
export class Undo {
  private at = 0;
  private last = 0;
  constructor(
    private go: (view: View) => void,
    private changed: (undo: boolean, redo: boolean) => void,
  ) {
    addEventListener("popstate", event => {
      if (!event.state?.view) return;
      this.at = event.state.n;
      this.last = Math.max(this.last, this.at);
      this.say();
      this.go(event.state.view);
    });
  }
  private say(): void {
    this.changed(this.at > 0, this.at < this.last);
  }
  /** Put a view in the place of the one that is looked at. */
  replace(view: View, address: string): void {
    history.replaceState({ view, n: this.at }, "", `#view=${address}`);
    this.say();
  }
  /** A view that undo comes back from. */
  push(view: View, address: string): void {
    this.last = ++this.at;
    history.pushState({ view, n: this.at }, "", `#view=${address}`);
    this.say();
  }
  undo(): void {
    if (this.at > 0) history.back();
  }
  redo(): void {
    if (this.at < this.last) history.forward();
  }
}
