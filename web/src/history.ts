/** The history of one quantity with its contacts and gaps; wheel and drag look closer in time. */
import { type About, plain, unitOf } from "./about";
import {
  axisText,
  colours,
  digits,
  fitted,
  frame,
  onResize,
  type Plot,
  place,
  type Range,
  reach,
  scaleFor,
} from "./axes";
import type { Motion } from "./motion";

/** Contacts on the screen above which each is a small square. */
const MANY = 150;
type Line = ArrayLike<number>;

export class History {
  private motion: Motion | null = null;
  private of = "";
  private held: Range | null = null;
  private range: Range = [-1, 1];
  private seen: Range | null = null;
  private plot: Plot | null = null;
  private cursor: number | null = null;
  private asked = false;
  private grip: { from: number; seen: Range } | null = null;
  chosen = -1;
  constructor(
    private canvas: HTMLCanvasElement,
    private about: About,
    private said: (text: string) => void,
  ) {
    onResize(canvas, () => this.draw());
    this.listen();
  }

  hold(on: boolean): void {
    this.held = on ? this.range : null;
    this.draw();
  }
  choose(contact: number): void {
    this.chosen = contact;
    const t = this.motion?.contactTime[contact],
      [a, b] = this.span();
    if (this.seen && t !== undefined && (t < a || t > b)) this.look([t - (b - a) / 2, t + (b - a) / 2]);
    this.draw();
  }
  show(motion: Motion, of: string): void {
    if (this.motion && (this.motion.time[0] !== motion.time[0] || this.motion.time.at(-1) !== motion.time.at(-1)))
      this.seen = null;
    if (of !== this.of) this.held = null;
    this.motion = motion;
    this.of = of;
    this.chosen = -1;
    const [t, y] = this.line(),
      { head } = motion,
      scale = scaleFor(
        unitOf(this.about, of),
        (this.range = reach(
          [y, ...this.other()],
          this.gaps().map(g => g.value),
        )),
      ),
      f = scale.factor;
    this.canvas.setAttribute(
      "aria-label",
      `history of ${plain(of)} from ${digits(t[0])} s to ${digits(t[t.length - 1])} s, between ${digits(this.range[0] * f)} and ${digits(this.range[1] * f)} ${scale.unit}, ${head.contacts ?? motion.contactTime.length} contacts; plus, minus and arrows look closer; the table of contacts follows`,
    );
    this.draw();
  }

  draw(): void {
    if (!this.asked) {
      this.asked = true;
      requestAnimationFrame(() => {
        this.asked = false;
        this.paint();
      });
    }
  }
  /** Times and values; of a long run least and most of each column, one after the other. */
  private line(): [Line, Line] {
    const { arrays, time } = this.motion!,
      column = arrays.column_time,
      least = arrays[`least:${this.of}`],
      most = arrays[`most:${this.of}`];
    if (!column || !least) return [time, this.motion!.sample(this.of)];
    const t = new Float64Array(2 * column.length),
      y = new Float64Array(2 * column.length);
    column.forEach((at, i) => {
      t[2 * i] = t[2 * i + 1] = at;
      y[2 * i] = least[i];
      y[2 * i + 1] = most[i];
    });
    return [t, y];
  }
  private other(): Line[] {
    const other = this.motion!.arrays[`other:${this.of}`];
    return other ? [other] : [];
  }
  private gaps(): { guard: string; value: number }[] {
    return (this.motion!.head.gaps ?? []).filter((g: any) => g.quantity === this.of);
  }
  private whole(): Range {
    const [t] = this.line();
    return [t[0], Math.max(t[t.length - 1], t[0] + 1e-12)];
  }
  private span(): Range {
    return this.seen ?? this.whole();
  }

  private paint(): void {
    const c = fitted(this.canvas),
      motion = this.motion;
    if (!motion) return;
    const { ink, quiet, contact, second, accent } = colours(),
      rx = this.span(),
      ry = this.held ?? this.range,
      scale = scaleFor(unitOf(this.about, this.of), ry),
      shown: Range = [ry[0] * scale.factor, ry[1] * scale.factor];
    const gaps = this.gaps(),
      names = gaps.map(g => plain(g.guard)),
      small = "11px system-ui, sans-serif";
    c.font = small;
    const margin = {
        left: 62,
        right: 18 + Math.max(0, ...names.map(name => c.measureText(name).width)),
        top: 10,
        bottom: 40,
      },
      p = (this.plot = place(this.canvas, rx, ry, margin)),
      right = p.left + p.width;
    frame(c, place(this.canvas, rx, shown, margin), rx, shown, ["time [s]", axisText(plain(this.of), scale.unit)]);
    c.strokeStyle = c.fillStyle = quiet;
    c.textAlign = "left";
    c.textBaseline = "middle";
    c.font = small;
    c.setLineDash([6, 5]);
    let above = -Infinity;
    for (const [gap, name] of gaps.map((g, i) => [g, names[i]] as const).sort((a, b) => b[0].value - a[0].value)) {
      const y = Math.round(p.Y(gap.value)) + 0.5;
      if (y < p.top || y > p.top + p.height) continue;
      above = Math.max(y, above + 12);
      c.fillText(name, right + 5, above);
      c.beginPath();
      c.moveTo(p.left, y);
      c.lineTo(right, y);
      c.stroke();
    }
    c.setLineDash([]);
    c.save();
    c.beginPath();
    c.rect(p.left, p.top, p.width, p.height);
    c.clip();
    const [t, y] = this.line();
    trace(c, p, t, y, rx, ink, 1.1);
    for (const other of this.other()) {
      c.setLineDash([7, 4]);
      trace(c, p, motion.time, other, rx, second, 1.4);
      c.setLineDash([]);
    }
    this.contacts(c, p, rx, contact);
    if (this.cursor !== null) {
      c.strokeStyle = accent;
      c.lineWidth = 1;
      c.globalAlpha = 0.6;
      c.beginPath();
      c.moveTo(p.X(this.cursor), p.top);
      c.lineTo(p.X(this.cursor), p.top + p.height);
      c.stroke();
    }
    c.restore();
  }
  private contacts(c: CanvasRenderingContext2D, p: Plot, [from, to]: Range, colour: string): void {
    const { contactTime: times, contactGuard: guards } = this.motion!,
      values = this.motion!.contact(this.of);
    if (!values) return;
    let inside = 0;
    for (let i = 0; i < times.length; i++) if (times[i] >= from && times[i] <= to) inside++;
    c.fillStyle = c.strokeStyle = colour;
    c.lineWidth = 1.3;
    for (let i = 0; i < times.length; i++) {
      if (times[i] < from || times[i] > to) continue;
      const x = p.X(times[i]),
        y = p.Y(values[i]);
      if (inside > MANY) c.fillRect(x - 1, y - 1, 2, 2);
      else {
        c.beginPath();
        c.arc(x, y, 2.6, 0, 7);
        if (guards[i] % 2) c.fill();
        else c.stroke();
      } // rings and dots: boundaries without colour
      if (i === this.chosen) {
        c.beginPath();
        c.arc(x, y, 8, 0, 7);
        c.stroke();
      }
    }
  }

  // -- looking closer -----------------------------------------------------------------------------------------------------------
  private look([from, to]: Range): void {
    const [first, last] = this.whole(),
      wide = Math.max(to - from, 1e-9 * (last - first));
    if (wide >= last - first) this.seen = null;
    else {
      const a = Math.min(Math.max(from, first), last - wide);
      this.seen = [a, a + wide];
    }
    this.draw();
  }
  private zoom(factor: number, about: number): void {
    const [a, b] = this.span();
    this.look([about + (a - about) * factor, about + (b - about) * factor]);
  }
  private at(px: number): number {
    const [a, b] = this.span();
    return a + ((b - a) * (px - this.plot!.left)) / this.plot!.width;
  }
  private read(px: number): void {
    const t = this.at(px),
      [times, y] = this.line();
    let low = 0,
      high = times.length - 1;
    while (low < high) {
      const mid = (low + high) >> 1;
      if (times[mid] < t) low = mid + 1;
      else high = mid;
    }
    const scale = scaleFor(unitOf(this.about, this.of), this.range);
    this.cursor = times[low];
    this.said(`t = ${digits(times[low], 6)} s, ${plain(this.of)} = ${digits(y[low] * scale.factor, 5)} ${scale.unit}`);
    this.draw();
  }
  private listen(): void {
    const at = this.canvas;
    at.addEventListener("pointerdown", e => {
      if (!this.motion || e.button) return;
      this.grip = { from: e.offsetX, seen: this.span() };
      at.setPointerCapture(e.pointerId);
    });
    at.addEventListener("pointermove", e => {
      if (!this.motion || !this.plot) return;
      if (this.grip) {
        const { from, seen } = this.grip,
          by = ((e.offsetX - from) / this.plot.width) * (seen[1] - seen[0]);
        if (this.seen) this.look([seen[0] - by, seen[1] - by]);
        return;
      }
      this.read(e.offsetX);
    });
    at.addEventListener("pointerup", () => {
      this.grip = null;
    });
    at.addEventListener("pointerleave", () => {
      this.cursor = null;
      this.said("");
      this.draw();
    });
    at.addEventListener("dblclick", () => {
      this.seen = null;
      this.draw();
    });
    at.addEventListener(
      "wheel",
      e => {
        if (!this.motion || (document.activeElement !== at && !e.ctrlKey)) return;
        e.preventDefault();
        this.zoom(Math.exp(0.002 * e.deltaY), this.at(e.offsetX));
      },
      { passive: false },
    );
    at.addEventListener("keydown", e => {
      if (!this.motion || e.ctrlKey || e.metaKey || e.altKey) return;
      const [a, b] = this.span(),
        by = (b - a) / 10;
      if (e.key === "+" || e.key === "=") this.zoom(0.7, (a + b) / 2);
      else if (e.key === "-") this.zoom(1 / 0.7, (a + b) / 2);
      else if (e.key === "ArrowLeft") this.look([a - by, b - by]);
      else if (e.key === "ArrowRight") this.look([a + by, b + by]);
      else if (e.key === "0") {
        this.seen = null;
        this.draw();
      } else return;
      e.preventDefault();
    });
  }
}

/** A line over time; where several samples share a column of pixels, their first, least, most and last. */
function trace(
  c: CanvasRenderingContext2D,
  p: Plot,
  t: Line,
  y: Line,
  [from, to]: Range,
  style: string,
  width: number,
): void {
  c.strokeStyle = style;
  c.lineWidth = width;
  c.lineJoin = "round";
  c.beginPath();
  const n = Math.min(t.length, y.length);
  let i = 0,
    up = true;
  while (i < n - 1 && t[i + 1] < from) i++;
  while (i < n && t[i] <= to) {
    if (y[i] !== y[i]) {
      up = true;
      i++;
      continue;
    }
    const column = Math.floor(p.X(t[i])),
      first = y[i];
    let least = first,
      most = first,
      last = first,
      k = i + 1;
    for (; k < n && y[k] === y[k] && Math.floor(p.X(t[k])) === column; k++) {
      last = y[k];
      if (last < least) least = last;
      if (last > most) most = last;
    }
    if (up) c.moveTo(p.X(t[i]), p.Y(first));
    else c.lineTo(p.X(t[i]), p.Y(first));
    if (k - i > 2) {
      c.lineTo(column + 0.5, p.Y(least));
      c.lineTo(column + 0.5, p.Y(most));
    }
    if (k - i > 1) c.lineTo(p.X(t[k - 1]), p.Y(last));
    up = false;
    i = k;
  }
  if (i < n && !up) c.lineTo(p.X(t[i]), p.Y(y[i]));
  c.stroke();
}
