/** The two fields of the range of responses: typed with units, read by the desk, refused beside them. */
import { spoken } from "./axes";
import type { Explorer } from "./explorer";
import { $ } from "./words";

const FIELDS = ["range-low", "range-high"];

export class RangeFields {
  private typed = 0;
  constructor(private of: Explorer) {}

  /** Show the range of the view; a field that is typed in, or that was refused, stays. */
  show(): void {
    const { over, range } = this.of.view,
      unit = this.of.about.parameters.find(p => p.name === over)?.unit ?? "";
    FIELDS.forEach((id, i) => {
      if (document.activeElement?.id !== id && !$(id).hasAttribute("aria-invalid"))
        $<HTMLInputElement>(id).value = spoken(range[i], unit, 5);
    });
  }
  /** An end was typed; an empty text takes it back. */
  type(i: number, text: string): void {
    this.refuse("");
    const { about, asks, link, view } = this.of,
      unit = about.parameters.find(q => q.name === view.over)!.shown.unit,
      typed = text.trim().replace("−", "-"),
      bare = /^[-+]?[\d.,]+(e[-+]?\d+)?$/i.test(typed),
      range: (number | string)[] = [...view.range];
    if (!typed) {
      $<HTMLInputElement>(FIELDS[i]).blur();
      return this.show();
    }
    this.typed = i;
    range[i] = bare && unit ? `${typed} ${unit}` : typed;
    asks.askedValues = "";
    link.ask("responses", { ...asks.responseFields(), range });
  }
  /** Say beside the fields why a range was refused; an empty text takes that back. */
  refuse(why: string): void {
    $("range-note").textContent = why;
    FIELDS.forEach((id, i) => {
      if (why && i === this.typed) $(id).setAttribute("aria-invalid", "true");
      else $(id).removeAttribute("aria-invalid");
    });
  }
}
