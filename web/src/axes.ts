/** Numbers as engineers read them, ticks, and the frame of axes that all canvases share. */

export type Range = [number, number];
export interface Scale {
  factor: number;
  unit: string;
}

const PREFIXES: [string, number][] = [
  ["G", 1e9],
  ["M", 1e6],
  ["k", 1e3],
  ["", 1],
  ["m", 1e-3],
  ["µ", 1e-6],
  ["n", 1e-9],
];
const SCALABLE = /^(m|s|Hz|N|Pa|J|W|V|A)(?=$|[*/])/;
const SMALL_ONLY = ["m", "s", "m/s", "m/s^2"]; // nobody reads kilometres or kiloseconds here

/** The prefix under which numbers up to `largest` read best: the rule of saltus's pictures (lengths below 1 m in mm). */
export function scaleOf(unit: string, largest: number): Scale {
  if (!SCALABLE.test(unit)) return { factor: 1, unit: unit === "1" ? "" : unit };
  for (const [prefix, size] of PREFIXES) {
    if (SMALL_ONLY.includes(unit) && size > 1) continue;
    const least = prefix + unit === "m" || size > 1 ? 1 : 0.1;
    if (largest / size >= least) return { factor: 1 / size, unit: prefix + unit };
  }
  return { factor: 1, unit };
}

/** The scale of a unit for all numbers of a range. */
export const scaleFor = (unit: string, [low, high]: Range): Scale =>
  scaleOf(unit, Math.max(Math.abs(low), Math.abs(high)));

const raised = (n: string): string => [...n].map(c => "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"["-0123456789".indexOf(c)]).join("");
const power = (size: number): string => `10${raised(String(size))}`;

/** A unit as it stands on an axis: m/s² in place of m/s^2. */
export const pretty = (unit: string): string =>
  unit
    .replaceAll("kg^0.5", "√kg")
    .replace(/\^(-?\d+)(?!\.)/g, (_, n: string) => raised(n))
    .replaceAll("*", "·");

/** Text of an axis: `x [mm]`. */
export const axisText = (name: string, unit: string): string => (unit ? `${name} [${pretty(unit)}]` : name);

/** A number with so many digits, without needless zeros, with a true minus sign. */
export function digits(value: number, count = 4): string {
  if (!Number.isFinite(value)) return Number.isNaN(value) ? "unknown" : value > 0 ? "∞" : "−∞";
  if (value === 0) return "0";
  const size = Math.abs(value),
    text = value.toPrecision(count);
  let out: string;
  if (size >= 1e-4 && size < 1e6)
    out = text.includes("e") ? String(+text) : text.includes(".") ? text.replace(/\.?0+$/, "") : text;
  else {
    const [mantissa, exponent] = value.toExponential(count - 1).split("e");
    out = `${mantissa.replace(/\.?0+$/, "")}·${power(+exponent)}`;
  }
  return out.replace(/^-/, "−");
}

/** A value in SI as people write it: 0.0004, "m" gives `0.4 mm`. */
export function spoken(value: number, unit: string, count = 4): string {
  const { factor, unit: shown } = scaleOf(unit, Math.abs(value));
  return shown ? `${digits(value * factor, count)} ${pretty(shown)}` : digits(value * factor, count);
}

/** Round numbers of a range, about so many. */
export function ticks([low, high]: Range, about = 5): number[] {
  const raw = (high - low) / Math.max(about, 1),
    ten = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].map(k => k * ten).find(s => s >= raw * 0.999) ?? raw;
  if (!(step > 0) || !Number.isFinite(step)) return [];
  const out: number[] = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step && out.length < 50; k++) out.push(k * step);
  return out;
}

/** Ticks of a logarithmic axis, of which the range and they are the powers of ten, and the numbers there. */
function decades([low, high]: Range): [number[], { texts: string[]; offset: string }] {
  const steps = high - low > 3 ? [1] : high - low > 0.7 ? [1, 2, 5] : [1, 1.5, 2, 3, 4, 5, 6, 7, 8, 9],
    at: number[] = [];
  for (let ten = Math.floor(low); ten <= high; ten++)
    at.push(...steps.map(step => ten + Math.log10(step)).filter(v => v >= low && v <= high));
  if (at.length < 2) at.splice(0, at.length, ...ticks([low, high], 3));
  return [at, { texts: at.map(v => digits(10 ** v, 3)), offset: "" }];
}

/** Texts of ticks: as many decimals as their step needs; of a narrow window far from zero what they share is written once. */
export function tickTexts(at: number[]): { texts: string[]; offset: string } {
  if (at.length < 2) return { texts: at.map(v => digits(v, 6)), offset: "" };
  const step = at[1] - at[0],
    largest = Math.max(...at.map(Math.abs));
  const decimals = Math.max(0, -Math.floor(Math.log10(step) + 1e-9));
  if (largest / step > 1e5) {
    const base = at[0],
      size = Math.floor(Math.log10(step) + 1e-9);
    return {
      texts: at.map(v => digits(Math.round((v - base) / 10 ** size), 6)),
      offset: `${base.toPrecision(14).replace(/0+$/, "").replace(/^-/, "−")} + n·${power(size)}`,
    };
  }
  if (decimals > 3 || largest >= 1e5) {
    const size = Math.floor(Math.log10(largest) + 1e-9);
    const { texts } = tickTexts(at.map(v => v / 10 ** size));
    return { texts, offset: `n·${power(size)}` };
  }
  return { texts: at.map(v => (Math.abs(v) < step / 1e3 ? 0 : v).toFixed(decimals).replace(/^-/, "−")), offset: "" };
}

/** Least and most of finite numbers, a little wider; NaN are gaps. */
export function reach(arrays: ArrayLike<number>[], also: number[] = [], pad = 0.06): Range {
  let low = Infinity,
    high = -Infinity;
  for (const a of arrays)
    for (let i = 0; i < a.length; i++) {
      const v = a[i];
      if (v < low) low = v;
      if (v > high) high = v;
    }
  if (!(high >= low)) return [-1, 1];
  const span = high - low || Math.abs(high) || 1;
  for (const mark of also)
    if (Math.max(high, mark) - Math.min(low, mark) <= 2 * span) {
      low = Math.min(low, mark);
      high = Math.max(high, mark);
    }
  const wide = high - low > 1e-12 * Math.max(Math.abs(low), Math.abs(high)) ? high - low : Math.abs(high) || 1;
  return [low - pad * wide, high + pad * wide];
}

// -- canvases ------------------------------------------------------------------------------------------------------------
export interface Theme {
  ink: string;
  quiet: string;
  line: string;
  panel: string;
  accent: string;
  contact: string;
  second: string;
  soft: string;
}
let theme: Theme | null = null;
/** Colours of the page as the style sheet has them now, light or dark. */
export function colours(): Theme {
  if (!theme) {
    const style = getComputedStyle(document.documentElement),
      get = (name: string) => style.getPropertyValue(`--${name}`).trim();
    theme = {
      ink: get("ink"),
      quiet: get("quiet"),
      line: get("line"),
      panel: get("panel"),
      accent: get("accent"),
      contact: get("contact"),
      second: get("second"),
      soft: get("soft"),
    };
  }
  return theme;
}
export function onTheme(redraw: () => void): void {
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => {
    theme = null;
    redraw();
  });
}

export const FONT = "12px system-ui, sans-serif";
/** A canvas fitted to its place, cleared, in CSS pixels. */
export function fitted(canvas: HTMLCanvasElement): CanvasRenderingContext2D {
  const ratio = devicePixelRatio,
    w = Math.round(canvas.clientWidth * ratio),
    h = Math.round(canvas.clientHeight * ratio);
  if (canvas.width !== w || canvas.height !== h) {
    canvas.width = w;
    canvas.height = h;
  }
  const c = canvas.getContext("2d")!;
  c.setTransform(ratio, 0, 0, ratio, 0, 0);
  c.clearRect(0, 0, canvas.clientWidth, canvas.clientHeight);
  c.font = FONT;
  return c;
}

export interface Plot {
  left: number;
  top: number;
  width: number;
  height: number;
  X: (v: number) => number;
  Y: (v: number) => number;
}
/** The place of the data on a canvas. The ranges are in the units shown. */
export function place(
  canvas: HTMLCanvasElement,
  rx: Range,
  ry: Range,
  margin = { left: 62, right: 18, top: 10, bottom: 40 },
): Plot {
  const left = margin.left,
    top = margin.top,
    width = Math.max(canvas.clientWidth - left - margin.right, 10),
    height = Math.max(canvas.clientHeight - top - margin.bottom, 10);
  return {
    left,
    top,
    width,
    height,
    X: v => left + ((v - rx[0]) / (rx[1] - rx[0])) * width,
    Y: v => top + height - ((v - ry[0]) / (ry[1] - ry[0])) * height,
  };
}

/** Ticks, their numbers and the names of both axes. */
export function frame(
  c: CanvasRenderingContext2D,
  p: Plot,
  rx: Range,
  ry: Range,
  names: [string, string],
  { grid = true, log = false } = {}, // log: ry are powers of ten
): void {
  const { ink, quiet, line } = colours(),
    bottom = p.top + p.height,
    half = (v: number) => Math.round(v) + 0.5;
  c.lineWidth = 1;
  c.setLineDash([]);
  c.font = FONT;
  c.fillStyle = quiet;
  c.strokeStyle = line;
  c.textBaseline = "middle";
  const xs = ticks(rx, Math.min(8, Math.floor(p.width / 70))),
    even = ticks(ry, Math.min(8, Math.floor(p.height / 30)));
  const xt = tickTexts(xs),
    [ys, yt] = log ? decades(ry) : [even, tickTexts(even)];
  c.beginPath();
  for (const v of xs) {
    c.moveTo(half(p.X(v)), grid ? p.top : bottom);
    c.lineTo(half(p.X(v)), bottom + 4);
  }
  for (const v of ys) {
    c.moveTo(p.left - 4, half(p.Y(v)));
    c.lineTo(grid ? p.left + p.width : p.left, half(p.Y(v)));
  }
  c.stroke();
  c.textAlign = "center";
  xs.forEach((v, i) => c.fillText(xt.texts[i], p.X(v), bottom + 13));
  c.textAlign = "right";
  ys.forEach((v, i) => c.fillText(yt.texts[i], p.left - 7, p.Y(v)));
  c.strokeStyle = quiet;
  c.beginPath();
  c.moveTo(half(p.left) - 1, p.top);
  c.lineTo(half(p.left) - 1, half(bottom));
  c.lineTo(p.left + p.width, half(bottom));
  c.stroke();
  c.fillStyle = ink;
  c.textAlign = "center";
  c.fillText(xt.offset ? `${names[0]}  ${xt.offset}` : names[0], p.left + p.width / 2, bottom + 30);
  c.save();
  c.translate(9, p.top + p.height / 2);
  c.rotate(-Math.PI / 2);
  c.fillText(yt.offset ? `${names[1]}  ${yt.offset}` : names[1], 0, 0);
  c.restore();
}

/** What an empty picture says. */
export function wordsIn(c: CanvasRenderingContext2D, p: Plot, text: string): void {
  c.fillStyle = colours().quiet;
  c.font = FONT;
  c.textAlign = "center";
  c.textBaseline = "middle";
  c.fillText(text, p.left + p.width / 2, p.top + p.height / 3);
}

/** Draw again when a place changes its size. */
export function onResize(element: Element, redraw: () => void): void {
  new ResizeObserver(() => redraw()).observe(element);
}
