/** The table of contacts: rows are made as they are scrolled to. */
import { type About, plain } from "./about";
import { axisText, digits, scaleOf, spoken } from "./axes";
import type { Motion } from "./motion";
import { $, cells } from "./words";

const BATCH = 60;

/** The unit of the speed of a boundary's gap. */
const rate = ({ unit }: { unit: string }): string => (unit ? `${unit}/s` : "");

export class Contacts {
  private motion: Motion | null = null;
  private made = 0;
  private scroll = $("contacts-scroll");
  private body = $("contacts").querySelector("tbody")!;
  constructor(
    private about: About,
    private choose: (contact: number) => void,
  ) {
    this.scroll.addEventListener("scroll", () => {
      if (this.scroll.scrollTop + this.scroll.clientHeight > this.scroll.scrollHeight - 200) this.more();
    });
    this.body.addEventListener("click", e => this.pick((e.target as HTMLElement).closest("tr")));
    this.scroll.addEventListener("keydown", e => {
      const step = e.key === "ArrowDown" ? 1 : e.key === "ArrowUp" ? -1 : 0,
        rows = this.body.rows;
      if (!step || !rows.length) return;
      const at = [...rows].findIndex(r => r.classList.contains("chosen")),
        row = rows[Math.min(Math.max(at + step, 0), rows.length - 1)];
      e.preventDefault();
      this.pick(row);
      row.scrollIntoView({ block: "nearest" });
    });
  }
  private pick(row: HTMLTableRowElement | null): void {
    if (!row || !this.made) return;
    for (const other of this.body.querySelectorAll(".chosen")) other.classList.remove("chosen");
    row.classList.add("chosen");
    this.choose(row.sectionRowIndex);
  }
  show(motion: Motion): void {
    this.motion = motion;
    this.made = 0;
    this.body.replaceChildren();
    this.scroll.scrollTop = 0;
    const columns = $("contacts").querySelectorAll("th");
    $("contacts-period").hidden = !motion.period;
    columns[4].textContent = axisText("speed", this.scale().unit);
    this.more();
  }
  /** The scale of all speeds; none where boundaries differ in unit: then each row has its own. */
  private scale(): { factor: number; unit: string; own?: boolean } {
    const speeds = this.motion!.arrays.contact_velocity,
      units = new Set(this.about.guards.map(rate));
    let most = 0;
    for (let i = 0; i < (speeds?.length ?? 0); i++) most = Math.max(most, Math.abs(speeds[i]));
    return units.size === 1 ? scaleOf([...units][0], most) : { factor: 1, unit: "", own: true };
  }
  private more(): void {
    const motion = this.motion!,
      {
        contact_time: time,
        contact_error: error,
        contact_velocity: speed,
        contact_direction: direction,
      } = motion.arrays,
      n = time?.length ?? 0,
      to = Math.min(this.made + BATCH, n);
    const from = (motion.head.contacts_from ?? 0) + 1,
      { factor, own } = this.scale(),
      rows: HTMLElement[] = [];
    for (let i = this.made; i < to; i++) {
      const met = this.about.guards[motion.arrays.contact_guard[i]],
        guard = met?.name ?? "";
      const texts = [
        String(i + from),
        time[i].toFixed(7),
        error ? digits(error[i], 2) : "",
        `${plain(guard)}${direction ? (direction[i] > 0 ? " ↑" : " ↓") : ""}`,
        !speed ? "" : own && met ? spoken(speed[i], rate(met)) : (speed[i] * factor).toPrecision(4).replace("-", "−"),
      ];
      if (motion.period) texts.push((time[i] / motion.period).toFixed(3));
      rows.push(cells("td", texts));
    }
    this.made = to;
    this.body.append(...rows);
    if (!n) this.body.replaceChildren(cells("td", ["no contact"]));
  }
}
