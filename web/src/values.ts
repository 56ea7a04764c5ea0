/** Sliders and typed values: units as everywhere in saltus, read by the desk; what it refuses stands beside the control. */
import { type About, type Parameter, plain } from "./about";
import { digits, pretty } from "./axes";
import { $, element } from "./words";

export interface ValueEvents {
  /** A slider moved (done: it was let go). */
  slide(name: string, value: number, done: boolean): void;
  /** Something was typed: the desk reads it and says the number. */
  type(group: "values" | "start", name: string, text: string): void;
}
const STEPS = 1000;
/** A state of more names than these is set on the map only. */
const MOST_STARTS = 16;

export class Values {
  private fields = new Map<
    string,
    { text: HTMLInputElement; note: HTMLElement; spoken: string; range?: HTMLInputElement; parameter?: Parameter }
  >();
  private own: Record<string, { unit: string; factor: number }> = {};

  constructor(
    private about: About,
    private events: ValueEvents,
  ) {
    const drive = (p: Parameter): number => (p.name === about.forced_at ? 0 : 1); // what is turned most often comes first
    $("sliders").replaceChildren(...[...about.parameters].sort((p, q) => drive(p) - drive(q)).map(p => this.slider(p)));
  }

  private field(group: "values" | "start", name: string, shown: { unit: string; factor: number }): HTMLElement {
    const key = `${group}.${name}`,
      box = element("div", "", "value"),
      label = element("label"),
      text = element("input"),
      note = element("p", "", "note");
    text.id = key;
    text.autocomplete = "off";
    text.spellcheck = false;
    note.id = `${key}-note`;
    text.setAttribute("aria-describedby", note.id);
    label.append(element("span", plain(name)), text);
    box.append(label, note);
    this.own[key] = shown;
    text.onchange = () => {
      const typed = text.value.trim();
      if (!typed) {
        text.value = this.fields.get(key)!.spoken;
        this.refuse(key, "");
        return;
      }
      const bare = /^[-+−]?[\d.,]+(e[-+]?\d+)?$/i.test(typed);
      this.events.type(
        group,
        name,
        (bare && shown.unit ? `${typed} ${shown.unit}` : typed).replace("−", "-").replace("µ", "u"),
      );
    };
    text.onkeydown = e => {
      if (e.key === "Escape") {
        text.value = this.fields.get(key)!.spoken;
        this.refuse(key, "");
        text.blur();
        e.stopPropagation();
      }
    };
    this.fields.set(key, { text, note, spoken: "" });
    return box;
  }

  private slider(p: Parameter): HTMLElement {
    const box = this.field("values", p.name, p.shown),
      range = element("input");
    Object.assign(range, { type: "range", min: "0", max: String(STEPS), step: "1" });
    range.setAttribute("aria-label", plain(p.name));
    const value = (): number => {
      const u = +range.value / STEPS,
        log = p.scale === "log",
        v = log ? p.low * (p.high / p.low) ** u : p.low + u * (p.high - p.low);
      const ten = 10 ** Math.floor(Math.log10((log ? v * Math.log(p.high / p.low) : p.high - p.low) / STEPS));
      return +(Math.round(v / ten) * ten).toPrecision(12); // the roundest number that a step of the slider reaches
    };
    range.oninput = () => this.events.slide(p.name, value(), false);
    range.onchange = () => this.events.slide(p.name, value(), true);
    box.append(range);
    const field = this.fields.get(`values.${p.name}`)!;
    field.range = range;
    field.parameter = p;
    return box;
  }

  private starts(names: string[]): void {
    for (const key of [...this.fields.keys()]) if (key.startsWith("start.")) this.fields.delete(key);
    const shown = (name: string) => this.about.quantities.find(q => q.name === name)!.shown;
    $("starts").replaceChildren(
      element("legend", "start"),
      ...names.map(name => this.field("start", name, shown(name))),
    );
  }

  /** Show the values and the start of a view; a field that is being typed in stays. */
  show(values: Record<string, number>, start: Record<string, number>): void {
    const names = Object.keys(start).slice(0, MOST_STARTS);
    if (!names.every(name => this.fields.has(`start.${name}`)) || $("starts").children.length !== names.length + 1)
      this.starts(names);
    for (const [key, field] of this.fields) {
      const { text, range, parameter } = field;
      const [group, name] = [key.slice(0, key.indexOf(".")), key.slice(key.indexOf(".") + 1)],
        value = (group === "values" ? values : start)[name],
        shown = this.own[key];
      const spoken = `${digits(value * shown.factor, range ? 6 : 5)} ${pretty(shown.unit)}`.trim();
      field.spoken = spoken;
      if (document.activeElement !== text && !text.hasAttribute("aria-invalid")) text.value = spoken;
      if (!range || !parameter) continue;
      const p = parameter,
        u = p.scale === "log" ? Math.log(value / p.low) / Math.log(p.high / p.low) : (value - p.low) / (p.high - p.low);
      if (document.activeElement !== range || Math.abs(+range.value - STEPS * u) > 2)
        range.value = String(Math.round(STEPS * Math.min(Math.max(u, 0), 1)));
      range.setAttribute("aria-valuetext", spoken);
    }
  }
  /** Take what was typed as read: the field shows the desk's number. */
  accept(key: string): void {
    this.refuse(key, "");
    if (document.activeElement === this.fields.get(key)?.text) this.fields.get(key)!.text.blur();
  }
  /** Say beside a control why it was refused; false if there is no such control. */
  refuse(key: string, why: string): boolean {
    const field = this.fields.get(key);
    if (!field) return false;
    field.note.textContent = why;
    if (why) field.note.scrollIntoView({ block: "nearest" });
    if (why) field.text.setAttribute("aria-invalid", "true");
    else field.text.removeAttribute("aria-invalid");
    return true;
  }
  /** Forget what was refused: the fields show what is computed with. */
  forget(): void {
    for (const key of this.fields.keys()) this.refuse(key, "");
  }
}
