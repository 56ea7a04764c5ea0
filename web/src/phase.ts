/** One quantity against another: the last periods dark, contacts and whole periods marked, gaps dashed. */
import { type About, plain, unitOf } from "./about";
import { axisText, colours, fitted, frame, onResize, type Plot, place, type Range, reach, scaleFor } from "./axes";
import type { Motion } from "./motion";
import { differing } from "./words";

/** Forcing periods that are drawn dark; of a motion without forcing this share of it. */
const LAST = 24,
  LAST_SHARE = 0.3;

export class Phase {
  private motion: Motion | null = null;
  private orbit: Motion | null = null;
  private of: [string, string] = ["", ""];
  private held: [Range, Range] | null = null;
  private seen: [Range, Range] | null = null;
  chosen = -1;
  constructor(
    private canvas: HTMLCanvasElement,
    private under: HTMLElement,
    private about: About,
  ) {
    onResize(canvas, () => this.draw());
  }

  show(motion: Motion | null, of: [string, string]): void {
    this.motion = motion;
    this.of = of;
    this.chosen = -1;
    this.draw();
  }
  /** An orbit over the motion: of an attractor chosen in the legend, or the one that the motion settles to. */
  over(orbit: Motion | null): void {
    this.orbit = orbit;
    this.draw();
  }
  hold(on: boolean): void {
    this.held = on ? this.seen : null;
    this.draw();
  }
  choose(contact: number): void {
    this.chosen = contact;
    this.draw();
  }

  draw(): void {
    const c = fitted(this.canvas),
      motion = this.motion,
      [first, second] = this.of;
    if (!motion) return;
    const { ink, quiet, contact, second: hue, accent } = colours(),
      x = motion.sample(first),
      y = motion.sample(second),
      n = x.length;
    const each = motion.period ? Math.max(1, Math.round(motion.period / motion.dt)) : 0,
      from = motion.orbit ? 0 : Math.max(0, each ? n - 1 - LAST * each : Math.floor((1 - LAST_SHARE) * n));
    const others: [ArrayLike<number>, ArrayLike<number>][] = [];
    const ox = motion.arrays[`other:${first}`],
      oy = motion.arrays[`other:${second}`];
    if (ox && oy) others.push([ox, oy]);
    const known =
      this.orbit && this.orbit !== motion && differing(this.about, this.orbit.head.values, motion.head.values) === ""
        ? this.orbit
        : null;
    const orbit: [ArrayLike<number>, ArrayLike<number>] | null = known
      ? [known.sample(first), known.sample(second)]
      : null;
    if (orbit) others.push(orbit);
    const gaps = (of: string) =>
      (motion.head.gaps ?? []).filter((g: any) => g.quantity === of).map((g: any) => g.value as number);
    const all = (this.seen = [
        reach([x, ...others.map(o => o[0])], gaps(first)),
        reach([y, ...others.map(o => o[1])], gaps(second)),
      ]),
      [rx, ry] = this.held ?? all;
    const sx = scaleFor(unitOf(this.about, first), rx),
      sy = scaleFor(unitOf(this.about, second), ry),
      p = place(this.canvas, rx, ry);
    const scaled = ([a, b]: Range, f: number): Range => [a * f, b * f],
      px = scaled(rx, sx.factor),
      py = scaled(ry, sy.factor);
    frame(c, place(this.canvas, px, py), px, py, [axisText(plain(first), sx.unit), axisText(plain(second), sy.unit)]);
    c.save();
    c.beginPath();
    c.rect(p.left, p.top, p.width, p.height);
    c.clip();
    c.strokeStyle = quiet;
    c.lineWidth = 1;
    c.setLineDash([5, 4]);
    for (const gap of gaps(first))
      line(c, [
        [p.X(gap), p.top],
        [p.X(gap), p.top + p.height],
      ]);
    for (const gap of gaps(second))
      line(c, [
        [p.left, p.Y(gap)],
        [p.left + p.width, p.Y(gap)],
      ]);
    c.setLineDash([]);
    path(c, p, x, y, 0, from + 1, quiet, 0.7, 0.35);
    path(c, p, x, y, from, n, ink, 1.2, 1);
    if (ox && oy) {
      c.setLineDash([6, 4]);
      path(c, p, ox, oy, Math.min(from, ox.length), ox.length, hue, 1.3, 1);
      c.setLineDash([]);
    }
    if (orbit) path(c, p, orbit[0], orbit[1], 0, orbit[0].length, accent, 1.6, 0.9);
    const cx = motion.contact(first),
      cy = motion.contact(second),
      begin = motion.time[from];
    if (cx && cy)
      for (let i = 0; i < cx.length; i++) {
        if (motion.contactTime[i] < begin && i !== this.chosen) continue;
        c.fillStyle = c.strokeStyle = contact;
        c.fillRect(p.X(cx[i]) - 1.5, p.Y(cy[i]) - 1.5, 3, 3);
        if (i === this.chosen) {
          c.lineWidth = 1.6;
          c.beginPath();
          c.arc(p.X(cx[i]), p.Y(cy[i]), 8, 0, 7);
          c.stroke();
        }
      }
    if (each)
      for (let i = n - 1; i >= from; i -= each) {
        c.beginPath();
        c.arc(p.X(x[i]), p.Y(y[i]), 3.2, 0, 7);
        c.fillStyle = accent;
        c.fill();
        c.strokeStyle = colours().panel;
        c.lineWidth = 1;
        c.stroke();
      }
    c.restore();
    const parts = motion.orbit
      ? ["one period of the orbit"]
      : [each ? `dark: the last ${Math.min(LAST, Math.round((n - 1) / each))} periods` : "dark: the last 30 %"];
    if (each) parts.push("dots: whole forcing periods");
    if (cx?.length) parts.push("squares: contacts");
    if (orbit) parts.push("thick: the orbit");
    if (ox) parts.push("dashed: the other method");
    this.under.textContent = parts.join("; ");
    this.canvas.setAttribute(
      "aria-label",
      `phase portrait of ${plain(second)} over ${plain(first)}; ${parts.join("; ")}; the numbers stand in the table of contacts and under Orbit`,
    );
  }
}

function line(c: CanvasRenderingContext2D, points: [number, number][]): void {
  c.beginPath();
  for (const [x, y] of points) c.lineTo(x, y);
  c.stroke();
}
function path(
  c: CanvasRenderingContext2D,
  p: Plot,
  x: ArrayLike<number>,
  y: ArrayLike<number>,
  from: number,
  to: number,
  style: string,
  width: number,
  alpha: number,
): void {
  c.strokeStyle = style;
  c.lineWidth = width;
  c.globalAlpha = alpha;
  c.lineJoin = "round";
  c.beginPath();
  for (let i = from, up = true; i < to; i++) {
    if (!(x[i] === x[i] && y[i] === y[i])) {
      up = true;
      continue;
    }
    if (up) c.moveTo(p.X(x[i]), p.Y(y[i]));
    else c.lineTo(p.X(x[i]), p.Y(y[i]));
    up = false;
  }
  c.stroke();
  c.globalAlpha = 1;
}
