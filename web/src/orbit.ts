/** The numbers of an orbit, and the legend of the map's attractors. */
import { type About, type Attractor, plain, unitOf } from "./about";
import { digits, spoken } from "./axes";
import type { Head } from "./link";
import { $, cells, element, notes } from "./words";

const MOST_MULTIPLIERS = 6;

/** A multiplier: `0.31 ± 0.2i` of a pair. */
const multiplier = ([re, im]: [number, number]): string =>
  im ? `${digits(re, 3)} ± ${digits(Math.abs(im), 3)}i` : digits(re, 3);

/** Orbit panel: kind, stability, multipliers, margins, peak. */
export function showOrbit(about: About, head: Head, text: string): void {
  const one: Partial<Attractor> & Head = { ...head, ...(head.attractor ?? {}) };
  const rows: [string, string][] = [];
  if (one.seconds) rows.push(["period", spoken(one.seconds, "s", 5)]);
  const outputs = Object.keys(one.peak ?? {}).filter(
      name => about.quantities.find(q => q.name === name)?.kind === "output",
    ),
    named = outputs.length ? outputs : Object.keys(one.peak ?? {});
  for (const [name, peak] of named.slice(0, 6).map(name => [name, one.peak![name]] as const))
    if (peak !== null) rows.push([`peak of ${plain(name)}`, spoken(peak, unitOf(about, name))]);
  const sorted = [...(one.multipliers ?? [])]
    .filter(m => m[1] >= 0)
    .sort((p, q) => Math.hypot(...q) - Math.hypot(...p));
  sorted
    .slice(0, MOST_MULTIPLIERS)
    .forEach((m, i) => rows.push([i ? "" : one.eigenvalues ? "eigenvalues [1/s]" : "multipliers", multiplier(m)]));
  if (sorted.length && !one.eigenvalues) rows.push(["largest size", digits(Math.hypot(...sorted[0]), 4)]);
  if (sorted.length > MOST_MULTIPLIERS) rows.push(["", `and ${sorted.length - MOST_MULTIPLIERS} smaller ones`]);
  const units = new Set(about.guards.map(g => g.unit));
  if (typeof one.margin === "number")
    rows.push(["nearest boundary", spoken(one.margin, units.size === 1 ? [...units][0] : "", 3)]);
  if (typeof one.contacts === "number")
    rows.push([about.forced ? "contacts in a period" : "contacts", digits(one.contacts, 4)]);
  if (typeof one.exponent === "number" && !sorted.length)
    rows.push(["Lyapunov exponent", spoken(one.exponent, "1/s", 3)]);
  $("orbit-what").textContent = text;
  $("orbit-numbers").replaceChildren(...rows.flatMap(([name, value]) => [element("dt", name), element("dd", value)]));
  notes($("orbit-words"), head.kind === "settle" ? [] : head.words);
}
export function clearOrbit(text: string): void {
  $("orbit-what").textContent = text;
  $("orbit-numbers").replaceChildren();
  notes($("orbit-words"), []);
}

/** Stability in a word, where it is known. */
export const stability = (stable: boolean | null | undefined): string =>
  stable === true ? "stable" : stable === false ? "unstable" : "";

/** The legend: a row each attractor, in the order of the desk; a row's button leaves the hue to it alone. */
export function showLegend(
  about: About,
  attractors: Attractor[],
  codes: [string, number[], string][],
  of: string,
  chosen: number | null,
  choose: (key: number) => void,
): void {
  const body = $("legend").querySelector("tbody")!,
    focused = document.activeElement?.getAttribute("data-key");
  const rows = [...attractors]
    .sort((a, b) => a.order - b.order)
    .map(one => {
      const row = cells("td", [
          "",
          peakOf(about, one, of),
          one.contacts == null ? "" : digits(one.contacts, 3),
          share(one),
        ]),
        button = element("button");
      button.type = "button";
      button.dataset.key = String(one.key);
      button.setAttribute("aria-pressed", String(chosen === one.key));
      button.title = "show this orbit, the others grey";
      button.append(swatch(about.hues[one.hue % about.hues.length]), one.name);
      button.onclick = () => choose(one.key);
      row.cells[0].append(button);
      return row;
    });
  for (const [name, colour, text] of codes) {
    const row = cells("td", ["", "", "", text]),
      box = element("span");
    box.append(swatch(colour), ` ${name}`);
    row.cells[0].append(box);
    rows.push(row);
  }
  body.replaceChildren(...rows);
  if (focused) body.querySelector<HTMLElement>(`[data-key="${CSS.escape(focused)}"]`)?.focus();
}
/** Largest size of a quantity on an attractor, or of the first one that is known of it. */
function peakOf(about: About, one: Attractor, of: string): string {
  const name = one.peak[of] != null ? of : Object.keys(one.peak)[0];
  return one.peak[name] == null
    ? ""
    : `${name === of ? "" : `${plain(name)} `}${spoken(one.peak[name], unitOf(about, name), 3)}`;
}
function swatch(rgb: number[]): HTMLElement {
  const box = element("span", "", "swatch");
  box.style.background = `rgb(${rgb})`;
  return box;
}
function share(one: Attractor): string {
  if (one.fraction === null || one.fraction === undefined) return "";
  const { fraction, low, high } = one,
    percent = (v: number, count = 3) => digits(100 * v, count);
  if (low == null || high == null) return `${percent(fraction)} %`;
  let count = 3;
  while (count < 7 && percent(low, count) === percent(high, count)) count++;
  return `${percent(fraction)} % (${percent(low, count)} to ${percent(high, count)})`;
}
