/** Sentences of the page: its status, what was refused, and of which values a panel is. Texts enter as text only. */
import { type About, plain } from "./about";
import { spoken } from "./axes";

export const $ = <T extends HTMLElement = HTMLElement>(id: string): T => document.getElementById(id) as T;
export function element<K extends keyof HTMLElementTagNameMap>(
  tag: K,
  text = "",
  className = "",
): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  if (text) made.textContent = text;
  if (className) made.className = className;
  return made;
}
/** A row of a table. */
export function cells(tag: "th" | "td", texts: string[]): HTMLTableRowElement {
  const row = element("tr");
  for (const text of texts) {
    const cell = element(tag, text);
    if (tag === "th") (cell as HTMLTableCellElement).scope = "col";
    row.append(cell);
  }
  return row;
}
export function options(select: HTMLSelectElement, choices: [string, string][], chosen: string): void {
  select.replaceChildren(
    ...choices.map(([value, text]) => {
      const one = element("option", text);
      one.value = value;
      return one;
    }),
  );
  select.value = chosen;
}

/** What is said in the status line: the newest text, at most once a second, so that it can be listened to. */
export class Status {
  private next = "";
  private timer = 0;
  private last = 0;
  constructor(private at: HTMLElement) {}
  say(text: string): void {
    this.next = text;
    if (this.timer) return;
    const rest = Math.max(0, 1000 - (performance.now() - this.last));
    this.timer = window.setTimeout(() => {
      this.timer = 0;
      this.last = performance.now();
      if (this.at.textContent !== this.next) this.at.textContent = this.next;
    }, rest);
  }
}

const MOST_LINES = 3;
/** The lines at the foot: what was refused or went wrong, until they are dismissed. */
export class Says {
  constructor(private at: HTMLElement) {
    at.querySelector("button")!.onclick = () => this.clear();
  }
  say(text: string): void {
    const lines = this.at.querySelector("div")!;
    if (this.at.hidden) lines.replaceChildren();
    for (const line of lines.children) if (line.textContent === text) return;
    while (lines.children.length >= MOST_LINES) lines.firstChild!.remove();
    lines.append(element("p", text));
    this.at.hidden = false;
  }
  clear(): void {
    this.at.hidden = true;
  }
}

/** Notes of a panel: what saltus warns of. */
export function notes(at: HTMLElement, words: string[] | undefined): void {
  at.replaceChildren(...[...new Set(words ?? [])].map(text => element("p", text)));
}

/** Of which values something is, where they aren't those of the sliders: `of frequency 15 Hz`; empty where they are. */
export function differing(
  about: About,
  of: Record<string, number> | undefined,
  now: Record<string, number>,
  but: string[] = [],
): string {
  if (!of) return "";
  const apart = about.parameters.filter(p => !but.includes(p.name) && p.name in of && !same(of[p.name], now[p.name]));
  if (!apart.length) return "";
  const first = apart
    .slice(0, 2)
    .map(p => `${plain(p.name)} ${spoken(of[p.name], p.unit, 5)}`)
    .join(", ");
  return `of ${first}${apart.length > 2 ? ` and ${apart.length - 2} more` : ""}`;
}
/** The value of one parameter: `of frequency 15.9 Hz`. */
export const only = (about: About, name: string, of: Record<string, number>): string =>
  `of ${plain(name)} ${spoken(of[name], about.parameters.find(p => p.name === name)?.unit ?? "", 5)}`;
const same = (a: number, b: number): boolean =>
  a === b || Math.abs(a - b) <= 1e-12 * Math.max(Math.abs(a), Math.abs(b));

/** Mark a panel as being of other values; dimmed, but where new ones are on their way. */
export function marked(panel: string, text: string, dim = text !== ""): void {
  $(`${panel}-of`).textContent = text;
  $(panel).classList.toggle("stale", dim);
}
