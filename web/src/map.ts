/** The map of basins: sheets of labels on a Canvas 2D, the start as a cross, the attractors' points; pointer and keys. */
import { type About, type Attractor, plain, unitOf } from "./about";
import { axisText, colours, fitted, frame, onResize, type Plot, place, type Range, scaleFor, wordsIn } from "./axes";
import { type Agreement, type Place, Sheet, Sheets, codeTable, colourTable } from "./sheets";
import type { Box } from "./state";

export interface MapEvents {
  start(at: [number, number], done: boolean): void; // a start of the two axes; done: the finger is up
  view(box: Box, done: boolean): void;
  hover(where: Place | null, at: [number, number] | null, sheet: Sheet | null): void;
  settle(): void;
}
/** Relative width of a view below which starts would coincide as numbers. */
const CLOSEST = 1e-11,
  NEAR = 14,
  STEP = 0.01,
  PAN = 0.1;
const OTHER_VIEW = 0.5,
  OTHER_VALUES = 0.28;

export class BasinMap {
  readonly sheets = new Sheets();
  sheet: Sheet | null = null;
  under: Sheet | null = null;
  paler = false;
  painted: () => void = () => {};
  box: Box;
  at: [number, number] = [0, 0];
  only: number | null = null;
  against = ""; // the method whose differences are shown
  frames = 0;
  private axes: [string, string];
  private differing: Uint32Array;
  private whole: Box;
  private asked = false;
  private plot!: Plot;
  private tables = new Map<Attractor[], Uint32Array>();
  private fingers = new Map<number, [number, number]>();
  private moved = 0;
  private grip: "start" | "view" | null = null;

  constructor(
    private canvas: HTMLCanvasElement,
    private about: About,
    private events: MapEvents,
  ) {
    this.axes = Object.keys(about.axes) as [string, string];
    this.whole = [...about.axes[this.axes[0]], ...about.axes[this.axes[1]]];
    this.box = [...this.whole];
    this.differing = codeTable(about.agreement_colors);
    onResize(canvas, () => this.draw());
    this.listen();
  }

  look(axes: [string, string], box: Box, whole: Box): void {
    this.axes = axes;
    this.box = [...box];
    this.whole = whole;
    this.draw();
  }
  recolour(): void {
    this.tables.clear();
    for (const sheet of this.sheets) sheet.dirty = true;
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

  private colour = (attractors: Attractor[]): Uint32Array => {
    let table = this.tables.get(attractors);
    if (!table) {
      if (this.tables.size > 50) this.tables.clear();
      this.tables.set(attractors, (table = colourTable(this.about, attractors, this.only)));
    }
    return table;
  };

  paint(): void {
    const c = fitted(this.canvas),
      [a, b, e, f] = this.box,
      [first, second] = this.axes,
      ux = unitOf(this.about, first),
      uy = unitOf(this.about, second);
    const sx = scaleFor(ux, [a, b]),
      sy = scaleFor(uy, [e, f]),
      rx: Range = [a * sx.factor, b * sx.factor],
      ry: Range = [e * sy.factor, f * sy.factor];
    const p = (this.plot = place(this.canvas, [a, b], [e, f])),
      own = this.sheet;
    own?.picture(this.colour);
    const { below, paler } = this.beneath();
    this.under = below;
    this.paler = paler.length > 0;
    c.save();
    c.beginPath();
    c.rect(p.left, p.top, p.width, p.height);
    c.clip();
    c.imageSmoothingEnabled = false;
    if (below) this.stretch(c, p, below, OTHER_VALUES);
    for (const sheet of paler) this.stretch(c, p, sheet, OTHER_VIEW);
    if (own) this.stretch(c, p, own, 1);
    if (this.agreement) this.stretch(c, p, this.agreement.sheet, 1, () => this.differing);
    if (own) this.points(c, p, own.attractors);
    c.restore();
    if (!below && !paler.length && !own?.known && !own?.open)
      wordsIn(c, p, own?.done ? "no attractors, no map" : "the first starts are being followed");
    frame(
      c,
      place(this.canvas, rx, ry),
      rx,
      ry,
      [axisText(plain(first), sx.unit), axisText(plain(second), sy.unit)],
      { grid: false },
    );
    this.cross(c, p);
    this.frames++;
    this.painted();
  }
  label(text: string): void {
    if (this.canvas.getAttribute("aria-label") !== text) this.canvas.setAttribute("aria-label", text);
  }

  /** Sheets to be seen where the own one has no cells: of the same values paler, of other values dimmed. */
  private beneath(): { below: Sheet | null; paler: Sheet[] } {
    const own = this.sheet;
    if (!own || (own.done && !own.known) || (own.covered && this.inside(own))) return { below: null, paler: [] };
    const others = [...this.sheets].filter(s => s !== own && s.plane === own.plane && s.intersects(this.box));
    const same = JSON.stringify(own.values),
      paler = others.filter(s => JSON.stringify(s.values) === same).sort((s, t) => width(t.box) - width(s.box));
    for (const s of paler) s.picture(this.colour);
    if (paler.some(s => s.covered && this.inside(s))) return { below: null, paler };
    const below = others.filter(s => !paler.includes(s)).at(-1) ?? null;
    below?.picture(this.colour);
    return { below, paler };
  }
  private inside(s: Sheet): boolean {
    const [a, b, e, f] = this.box,
      [p, q, r, t] = s.box,
      w = 1e-9;
    return p <= a + w * (b - a) && q >= b - w * (b - a) && r <= e + w * (f - e) && t >= f - w * (f - e);
  }

  /** What is drawn of two methods in place of the basins. */
  get agreement(): Agreement | null {
    const found = this.sheet?.agreement;
    return found && found.against === this.against && found.words.length ? found : null;
  }

  private stretch(c: CanvasRenderingContext2D, p: Plot, s: Sheet, alpha: number, colour = this.colour): void {
    const [x0, x1, y0, y1] = s.box,
      dx = (x1 - x0) / (s.n - 1) / 2,
      dy = (y1 - y0) / (s.m - 1) / 2; // a cell reaches half a step about its start
    const left = p.X(x0 - dx),
      right = p.X(x1 + dx),
      top = p.Y(y1 + dy),
      bottom = p.Y(y0 - dy);
    c.globalAlpha = alpha;
    c.drawImage(s.picture(colour), left, top, right - left, bottom - top);
    c.globalAlpha = 1;
  }

  private points(c: CanvasRenderingContext2D, p: Plot, attractors: Attractor[]): void {
    const names = this.about.quantities.filter(q => q.kind === "state").map(q => q.name),
      i = names.indexOf(this.axes[0]),
      j = names.indexOf(this.axes[1]);
    if (i < 0 || j < 0) return;
    const total = attractors.reduce((n, one) => n + one.points.length, 0),
      r = total <= 16 ? 4 : total <= 60 ? 2.6 : 1.8;
    for (const one of [...attractors].sort((s, t) => t.points.length - s.points.length)) {
      if (this.only !== null && this.only !== one.key) continue;
      const [red, green, blue] = this.about.hues[one.hue % this.about.hues.length];
      for (const state of one.points) {
        c.beginPath();
        c.arc(p.X(state[i]), p.Y(state[j]), r, 0, 7);
        c.fillStyle = `rgb(${red},${green},${blue})`;
        c.fill();
        c.strokeStyle = "#222";
        c.lineWidth = 2.4;
        c.stroke();
        c.strokeStyle = "#fff";
        c.lineWidth = 1.2;
        c.stroke();
      }
    }
  }

  private cross(c: CanvasRenderingContext2D, p: Plot): void {
    const x = p.X(this.at[0]),
      y = p.Y(this.at[1]);
    if (x < p.left - 1 || x > p.left + p.width + 1 || y < p.top - 1 || y > p.top + p.height + 1) return;
    for (const [style, width] of [
      ["#fff", 4],
      ["#000", 1.6],
    ] as const) {
      c.strokeStyle = style;
      c.lineWidth = width;
      c.beginPath();
      for (const [u, v] of [
        [1, 0],
        [-1, 0],
        [0, 1],
        [0, -1],
      ]) {
        c.moveTo(x + 3 * u, y + 3 * v);
        c.lineTo(x + 11 * u, y + 11 * v);
      }
      c.moveTo(x + 7, y);
      c.arc(x, y, 7, 0, 7);
      c.stroke();
    }
    c.strokeStyle = colours().ink;
  }

  // -- from pixels to the plane --------------------------------------------------------------------------------------------
  /** The point of the plane under a pixel [SI]. */
  where(px: number, py: number): [number, number] {
    const [a, b, e, f] = this.box,
      { left, top, width: w, height: h } = this.plot;
    return [a + ((b - a) * (px - left)) / w, f - ((f - e) * (py - top)) / h];
  }
  /** The pixel of a point of the plane, from the canvas's corner. */
  pixel([x, y]: [number, number]): [number, number] {
    return [this.plot.X(x), this.plot.Y(y)];
  }

  zoom(factor: number, about?: [number, number]): void {
    const [a, b, e, f] = this.box,
      [x, y] = about ?? [(a + b) / 2, (e + f) / 2];
    const enough = (low: number, high: number, own: [number, number]) =>
      high - low > CLOSEST * Math.max(own[1] - own[0], Math.abs(low), Math.abs(high));
    const next: Box = [x + (a - x) * factor, x + (b - x) * factor, y + (e - y) * factor, y + (f - y) * factor];
    if (
      factor < 1 &&
      !(
        enough(next[0], next[1], [this.whole[0], this.whole[1]]) &&
        enough(next[2], next[3], [this.whole[2], this.whole[3]])
      )
    )
      return;
    this.move(next, true);
  }
  pan(dx: number, dy: number, done: boolean): void {
    const [a, b, e, f] = this.box,
      x = dx * (b - a),
      y = dy * (f - e);
    this.move([a + x, b + x, e + y, f + y], done);
  }
  private move(box: Box, done: boolean): void {
    this.box = box;
    this.draw();
    this.events.view(box, done);
  }

  private step(dx: number, dy: number): void {
    const [a, b, e, f] = this.box;
    this.at = [this.at[0] + dx * STEP * (b - a), this.at[1] + dy * STEP * (f - e)];
    this.draw();
    this.events.start(this.at, false);
    this.tell(this.at);
  }
  private told: [number, number] | null = null;
  /** Say what is known of a point of the plane; without one, again of the same. */
  tell(at: [number, number] | null = this.told): void {
    this.told = at;
    this.events.hover(at && this.sheet ? this.sheet.find(...at) : null, at, this.sheet);
  }

  // -- pointer and keys -----------------------------------------------------------------------------------------------------
  private listen(): void {
    const at = this.canvas,
      fingers = this.fingers;
    at.addEventListener("pointerdown", e => {
      if (e.button !== 0) return;
      fingers.set(e.pointerId, [e.offsetX, e.offsetY]);
      at.setPointerCapture(e.pointerId);
      this.moved = 0;
      const [x, y] = this.pixel(this.at);
      this.grip = Math.hypot(e.offsetX - x, e.offsetY - y) < NEAR ? "start" : "view";
    });
    at.addEventListener("pointermove", e => {
      const before = fingers.get(e.pointerId),
        now: [number, number] = [e.offsetX, e.offsetY];
      if (!before) return this.tell(this.within(now) ? this.where(...now) : null);
      const others = [...fingers.entries()].filter(([id]) => id !== e.pointerId);
      this.moved += Math.hypot(now[0] - before[0], now[1] - before[1]);
      fingers.set(e.pointerId, now);
      if (this.moved < 4) return;
      if (others.length) {
        const [fx, fy] = others[0][1],
          gap = (q: [number, number]) => Math.max(Math.hypot(q[0] - fx, q[1] - fy), 1);
        this.zoom(gap(before) / gap(now), this.where((now[0] + fx) / 2, (now[1] + fy) / 2));
      } else if (this.grip === "start") {
        this.at = this.where(...now);
        this.draw();
        this.events.start(this.at, false);
      } else this.pan(-(now[0] - before[0]) / this.plot.width, (now[1] - before[1]) / this.plot.height, false);
    });
    const up = (e: PointerEvent) => {
      if (!fingers.delete(e.pointerId) || fingers.size) return;
      if (this.moved < 4) {
        if (this.within([e.offsetX, e.offsetY])) {
          const here = this.where(e.offsetX, e.offsetY);
          this.at = (e.shiftKey && this.sheet?.find(...here)?.at) || here;
          this.draw();
          this.events.start(this.at, true);
        }
      } else if (this.grip === "start") this.events.start(this.at, true);
      else this.events.view(this.box, true);
    };
    at.addEventListener("pointerup", up);
    at.addEventListener("pointercancel", e => {
      fingers.delete(e.pointerId);
    });
    at.addEventListener("pointerleave", () => this.tell(null));
    at.addEventListener(
      "wheel",
      e => {
        e.preventDefault();
        this.zoom(Math.exp(0.002 * e.deltaY), this.where(e.offsetX, e.offsetY));
      },
      { passive: false },
    );
    at.addEventListener("keydown", e => {
      if (e.ctrlKey || e.metaKey || e.altKey) return;
      const by = (
        { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] } as Record<
          string,
          [number, number]
        >
      )[e.key];
      if (by) {
        if (e.shiftKey) this.pan(PAN * by[0], PAN * by[1], true);
        else this.step(...by);
      } else if (e.key === "+" || e.key === "=") this.zoom(0.8, this.middle());
      else if (e.key === "-") this.zoom(1.25, this.middle());
      else if (e.key === "0") this.move([...this.whole], true);
      else if (e.key === "Enter") this.events.settle();
      else return;
      e.preventDefault();
    });
    at.addEventListener("keyup", e => {
      if (e.key.startsWith("Arrow") && !e.shiftKey) this.events.start(this.at, true);
    });
  }
  private within([x, y]: [number, number]): boolean {
    const p = this.plot;
    return x >= p.left && x <= p.left + p.width && y >= p.top && y <= p.top + p.height;
  }
  /** What keys zoom about: the start if it is seen. */
  private middle(): [number, number] | undefined {
    const [a, b, e, f] = this.box,
      [x, y] = this.at;
    return x >= a && x <= b && y >= e && y <= f ? this.at : undefined;
  }
  showWhole(): void {
    this.move([...this.whole], true);
  }
}

const width = ([a, b, c, d]: Box): number => (b - a) * (d - c);
