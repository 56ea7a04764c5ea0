/** Response curves: stable solid, unstable dashed, events by their shapes; nearest point, and keys along a branch. */
import { type About, parameterOf, plain, unitOf } from "./about";
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
  spoken,
  wordsIn,
} from "./axes";
import type { Arrays, Head, Numbers } from "./link";
import { mark, periodText, shownMarks } from "./response_marks";
import { $, cells } from "./words";

export interface ResponseEvents {
  orbit(choice: { point?: number; event?: number }): void;
  hover(text: string): void;
}
export const FOLLOWED = "the branches are being followed";
const REACH = 22,
  EVENT_REACH = 12;
/** The hue of a stretch on which nothing attracts. */
const NO_HUE = 255;
/** Ratio of the largest peak to the least above which their axis is logarithmic, unless it is chosen. */
const WIDE = 10;

export class Responses {
  head: Head | null = null;
  chosen = -1;
  event = -1; // an event that is chosen rather than the point beside it
  now = NaN;
  private a: Arrays = {};
  private log: boolean | null = null; // whether the axis of peaks is logarithmic, as chosen
  private plot: Plot | null = null;
  private seen: [Range, Range] | null = null;
  private whole: [Range, Range] = [
    [0, 1],
    [0, 1],
  ];
  constructor(
    private canvas: HTMLCanvasElement,
    private about: About,
    private events: ResponseEvents,
  ) {
    onResize(canvas, () => this.draw());
    this.listen();
  }

  show(head: Head, arrays: Arrays): void {
    if (this.head?.key !== head.key || this.chosen >= (arrays.point_peak?.length ?? 0)) this.unchoose();
    if (
      this.head?.parameter !== head.parameter ||
      this.head?.quantity !== head.quantity ||
      String(this.head?.range) !== String(head.range)
    )
      this.seen = null;
    this.head = head;
    this.a = arrays;
    this.draw();
  }

  unchoose(): void {
    this.chosen = this.event = -1;
  }
  private get x(): Numbers {
    return this.a.point_parameter;
  }
  private get y(): Numbers {
    return this.a.point_peak;
  }
  /** Whether the axis of peaks is logarithmic: where no peak is zero. */
  get logarithmic(): boolean {
    const least = this.y?.length ? Math.min(...this.y) : 0;
    return least > 0 && (this.log ?? Math.max(...this.y) > WIDE * least);
  }
  /** Change between a linear and a logarithmic axis. */
  toggle(): void {
    this.log = !this.logarithmic;
    this.seen = null;
    this.draw();
  }

  /** What stands where there are no branches. */
  without = FOLLOWED;
  draw(): void {
    const c = fitted(this.canvas),
      head = this.head;
    if (!head) return wordsIn(c, place(this.canvas, [0, 1], [0, 1]), this.without);
    const { ink, quiet, accent, panel } = colours(),
      { point_stable: stable, point_branch: branch, point_hue: hue } = this.a,
      x = this.x,
      y = this.y,
      n = x?.length ?? 0;
    const ux = parameterOf(this.about, head.parameter)?.unit ?? "",
      uy = unitOf(this.about, head.quantity),
      [low, high] = head.range as Range;
    const pad = 0.02 * (high - low),
      log = this.logarithmic,
      up = log ? Math.log10 : (v: number) => v,
      heights = Array.from(y ?? [], up),
      own = n ? reach([heights]) : ([0, 1] as Range);
    this.whole = [[low - pad, high + pad], !log && own[0] > 0 && own[0] < 0.5 * own[1] ? [0, own[1]] : own];
    $("responses-log").setAttribute("aria-pressed", String(log));
    const [rx, ry] = this.seen ?? this.whole;
    const sx = scaleFor(ux, rx),
      sy = scaleFor(uy, log ? [10 ** ry[0], 10 ** ry[1]] : ry),
      linear = place(this.canvas, rx, ry),
      p = (this.plot = { ...linear, Y: v => linear.Y(up(v)) });
    const fx: Range = [rx[0] * sx.factor, rx[1] * sx.factor],
      shown = (v: number) => (log ? v + Math.log10(sy.factor) : v * sy.factor),
      fy: Range = [shown(ry[0]), shown(ry[1])];
    frame(
      c,
      place(this.canvas, fx, fy),
      fx,
      fy,
      [axisText(plain(head.parameter), sx.unit), axisText(`peak of ${plain(head.quantity)}`, sy.unit)],
      { log },
    );
    c.save();
    c.beginPath();
    c.rect(p.left, p.top, p.width, p.height);
    c.clip();
    if (Number.isFinite(this.now)) {
      c.strokeStyle = accent;
      c.lineWidth = 1;
      c.globalAlpha = 0.7;
      c.beginPath();
      c.moveTo(p.X(this.now), p.top);
      c.lineTo(p.X(this.now), p.top + p.height);
      c.stroke();
      c.globalAlpha = 1;
    }
    for (let i = 1; i < n; i++) {
      if (branch[i] !== branch[i - 1]) continue;
      const firm = stable[i] && stable[i - 1],
        rgb = hue[i] === NO_HUE ? null : this.about.hues[hue[i] % this.about.hues.length];
      c.strokeStyle = rgb ? `rgb(${rgb})` : quiet;
      c.lineWidth = firm ? 2 : 1;
      c.globalAlpha = firm ? 1 : 0.75;
      c.setLineDash(firm ? [] : [4, 3]);
      c.lineDashOffset = firm ? 0 : p.X(x[i - 1]) % 7;
      c.beginPath();
      c.moveTo(p.X(x[i - 1]), p.Y(y[i - 1]));
      c.lineTo(p.X(x[i]), p.Y(y[i]));
      c.stroke();
    }
    c.setLineDash([]);
    c.globalAlpha = 1;
    for (let i = 0; i < n; i++) {
      // a branch of one point would not be seen
      if (branch[i] === branch[i - 1] || branch[i] === branch[i + 1]) continue;
      c.fillStyle = ink;
      c.beginPath();
      c.arc(p.X(x[i]), p.Y(y[i]), 2.5, 0, 7);
      c.fill();
    }
    const at = Array.from(this.a.event_parameter ?? [], p.X),
      peaks = Array.from(this.a.event_peak ?? [], p.Y);
    for (const i of shownMarks(head.events, at, peaks)) {
      const graze = /graz/.test(head.events[i]);
      mark(c, head.events[i], at[i], peaks[i], graze ? 0.5 : 0.75, graze ? quiet : ink, panel);
    }
    if (this.chosen >= 0) {
      c.strokeStyle = accent;
      c.lineWidth = 2.4;
      c.beginPath();
      const e = this.event,
        [at, peak] = e < 0 ? [x[this.chosen], y[this.chosen]] : [this.a.event_parameter[e], this.a.event_peak[e]];
      c.arc(p.X(at), p.Y(peak), 7, 0, 7);
      c.stroke();
    }
    if (!n)
      wordsIn(c, p, head.done === false ? FOLLOWED : "no branch was found in this range");
    c.restore();
    const branches = new Set(Array.from(branch ?? [])).size;
    this.canvas.setAttribute(
      "aria-label",
      `responses: peak of ${plain(head.quantity)} over ${plain(head.parameter)}, ${branches} branches, ${n} points, ${head.events.length} events; left and right go along a branch, e to the next event of that branch, Enter shows the orbit, t the table`,
    );
  }

  // -- choosing -------------------------------------------------------------------------------------------------------------
  private nearest(px: number, py: number): { point?: number; event?: number } | null {
    const p = this.plot,
      { event_parameter: ex, event_peak: ey } = this.a;
    if (!p || !this.x) return null;
    let best: { point?: number; event?: number } | null = null,
      least = EVENT_REACH ** 2;
    for (let i = 0; i < ex.length; i++) {
      const r = (p.X(ex[i]) - px) ** 2 + (p.Y(ey[i]) - py) ** 2;
      if (r < least) {
        least = r;
        best = { event: i };
      }
    }
    if (best) return best;
    least = REACH ** 2;
    for (let i = 0; i < this.x.length; i++) {
      const r = (p.X(this.x[i]) - px) ** 2 + (p.Y(this.y[i]) - py) ** 2;
      if (r < least) {
        least = r;
        best = { point: i };
      }
    }
    return best;
  }
  /** The pixel of a point, from the canvas's corner. */
  pixel([x, y]: [number, number]): [number, number] {
    return [this.plot!.X(x), this.plot!.Y(y)];
  }
  /** A point or an event in words. */
  text(choice: { point?: number; event?: number }): string {
    const head = this.head!,
      ux = parameterOf(this.about, head.parameter)?.unit ?? "",
      uy = unitOf(this.about, head.quantity),
      a = this.a;
    if (choice.event !== undefined) {
      const i = choice.event;
      return `${head.events[i]} at ${spoken(a.event_parameter[i], ux, 6)}, peak ${spoken(a.event_peak[i], uy)}`;
    }
    const i = choice.point!;
    return `${periodText(a.point_period[i])}, ${a.point_stable[i] ? "stable" : "unstable"}, ${spoken(this.x[i], ux, 6)}, peak ${spoken(this.y[i], uy)}, branch ${a.point_branch[i]}`;
  }
  private choose(choice: { point?: number; event?: number }, ask: boolean): void {
    this.event = choice.event ?? -1;
    this.chosen = choice.event !== undefined ? this.a.event_point[choice.event] : choice.point!;
    this.draw();
    this.events.hover(this.text(choice));
    if (ask) this.events.orbit(choice);
  }
  /** The next event of the branch that one is on; of none, the first of all. */
  private nextEvent(): number | null {
    const { event_point: point, event_branch: on, point_branch: branch } = this.a,
      own = this.chosen < 0 ? null : branch[this.chosen],
      here = [...point.keys()].filter(k => own === null || on[k] === own).sort((j, k) => point[j] - point[k] || j - k);
    if (!here.length) return null;
    if (this.event >= 0) return here[(here.indexOf(this.event) + 1) % here.length];
    return here.find(k => point[k] >= this.chosen) ?? here[0];
  }
  private zoom(factor: number, px: number, py: number): void {
    const p = this.plot!,
      [rx, ry] = this.seen ?? this.whole,
      x = rx[0] + ((rx[1] - rx[0]) * (px - p.left)) / p.width,
      y = ry[1] - ((ry[1] - ry[0]) * (py - p.top)) / p.height;
    const near = ([a, b]: Range, v: number): Range => [v + (a - v) * factor, v + (b - v) * factor],
      next: [Range, Range] = [near(rx, x), near(ry, y)];
    this.seen = next[0][1] - next[0][0] >= this.whole[0][1] - this.whole[0][0] ? null : next;
    this.draw();
  }
  private listen(): void {
    const at = this.canvas;
    let grip: { x: number; y: number; seen: [Range, Range] } | null = null,
      moved = 0;
    at.addEventListener("pointerdown", e => {
      if (e.button || !this.plot) return;
      grip = { x: e.offsetX, y: e.offsetY, seen: this.seen ?? this.whole };
      moved = 0;
      at.setPointerCapture(e.pointerId);
    });
    at.addEventListener("pointerup", () => {
      grip = null;
    });
    at.addEventListener(
      "wheel",
      e => {
        if (!this.plot || (document.activeElement !== at && !e.ctrlKey)) return;
        e.preventDefault();
        this.zoom(Math.exp(0.002 * e.deltaY), e.offsetX, e.offsetY);
      },
      { passive: false },
    );
    at.addEventListener("dblclick", () => {
      this.seen = null;
      this.draw();
    });
    at.addEventListener("pointermove", e => {
      if (grip) {
        const {
            seen: [rx, ry],
          } = grip,
          dx = ((grip.x - e.offsetX) / this.plot!.width) * (rx[1] - rx[0]),
          dy = ((e.offsetY - grip.y) / this.plot!.height) * (ry[1] - ry[0]);
        moved = Math.max(moved, Math.hypot(grip.x - e.offsetX, grip.y - e.offsetY));
        if (moved > 4) {
          this.seen = [
            [rx[0] + dx, rx[1] + dx],
            [ry[0] + dy, ry[1] + dy],
          ];
          this.draw();
          return;
        }
      }
      const near = this.nearest(e.offsetX, e.offsetY);
      this.events.hover(near ? this.text(near) : "");
    });
    at.addEventListener("pointerleave", () => this.events.hover(""));
    at.addEventListener("click", e => {
      const near = moved > 4 ? null : this.nearest(e.offsetX, e.offsetY);
      if (near) this.choose(near, true);
    });
    at.addEventListener("keydown", e => {
      const n = this.x?.length ?? 0,
        branch = this.a.point_branch,
        i = Math.max(this.chosen, 0);
      if (!n || e.ctrlKey || e.metaKey || e.altKey) return;
      if (e.key === "ArrowRight") {
        if (this.chosen < 0 || branch[i + 1] === branch[i]) this.choose({ point: this.chosen < 0 ? 0 : i + 1 }, false);
      } else if (e.key === "ArrowLeft") {
        if (this.chosen < 0 || branch[i - 1] === branch[i]) this.choose({ point: this.chosen < 0 ? 0 : i - 1 }, false);
      } else if (e.key === "]" || e.key === "[") {
        const starts = Array.from({ length: n }, (_, k) => k).filter(k => branch[k] !== branch[k - 1]),
          own = starts.filter(k => k <= i).length - 1;
        this.choose({ point: starts[(own + (e.key === "]" ? 1 : starts.length - 1)) % starts.length] }, false);
      } else if (e.key === "e") {
        const event = this.nextEvent();
        if (event !== null) this.choose({ event }, false);
        else this.events.hover("no event on this branch: [ and ] go to another");
      } else if (e.key === "+" || e.key === "=" || e.key === "-") {
        const p = this.plot!,
          about = this.chosen < 0 ? [p.left + p.width / 2, p.top + p.height / 2] : [p.X(this.x[i]), p.Y(this.y[i])];
        this.zoom(e.key === "-" ? 1 / 0.7 : 0.7, about[0], about[1]);
      } else if (e.key === "0") {
        this.seen = null;
        this.draw();
      } else if (e.key === "Enter") this.choose(this.event < 0 ? { point: i } : { event: this.event }, true);
      else return;
      e.preventDefault();
    });
  }

  /** The same points as a table; a row's button shows that orbit. */
  table(head: HTMLElement, body: HTMLElement, most: number): void {
    const h = this.head;
    if (!h || !this.x) return;
    const ux = parameterOf(this.about, h.parameter)?.unit ?? "",
      uy = unitOf(this.about, h.quantity),
      sx = scaleFor(ux, h.range),
      sy = scaleFor(uy, reach([this.y]));
    head.replaceChildren(
      cells("th", [
        "",
        axisText(plain(h.parameter), sx.unit),
        axisText(`peak of ${plain(h.quantity)}`, sy.unit),
        "period",
        "stability",
        "branch",
      ]),
    );
    const rows: HTMLElement[] = [],
      add = (choice: { point?: number; event?: number }, texts: string[], name: string) => {
        const row = cells("td", ["", ...texts]),
          button = document.createElement("button");
        button.type = "button";
        button.textContent = "orbit";
        button.setAttribute("aria-label", `show the orbit of ${name}`);
        button.onclick = () => this.choose(choice, true);
        row.cells[0].append(button);
        rows.push(row);
      };
    (h.events as string[]).forEach((kind, i) =>
      add(
        { event: i },
        [
          digits(this.a.event_parameter[i] * sx.factor, 7),
          digits(this.a.event_peak[i] * sy.factor, 5),
          kind,
          "",
          String(this.a.event_branch[i]),
        ],
        kind,
      ),
    );
    for (let i = 0; i < Math.min(this.x.length, most); i++)
      add(
        { point: i },
        [
          digits(this.x[i] * sx.factor, 7),
          digits(this.y[i] * sy.factor, 5),
          periodText(this.a.point_period[i]),
          this.a.point_stable[i] ? "stable" : "unstable",
          String(this.a.point_branch[i]),
        ],
        `point ${i}`,
      );
    body.replaceChildren(...rows);
  }
}
