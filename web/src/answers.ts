/** Where answers go: each to its panel, in pictures and in words. */
import { type Attractor, plain, unitOf } from "./about";
import { digits, spoken } from "./axes";
import type { Explorer } from "./explorer";
import type { Arrays, Head, Question } from "./link";
import { motionOf } from "./motion";
import { clearOrbit, showLegend, showOrbit, stability } from "./orbit";
import type { Place, Sheet } from "./sheets";
import { $, notes } from "./words";

/** Seconds after which the page says what it waits for; and what that is. */
const PATIENCE = 1.5,
  DOING: Record<string, string> = {
    motion: "the motion is being computed",
    settle: "the start is being followed",
    map: "looking for what starts settle to",
    responses: "branches are being followed",
  };
/** Most points of branches that their table holds. */
export const ALL_POINTS = 1000;
const ORDINAL: Record<number, string> = { 2: "second", 4: "fourth", 8: "eighth" };

const grouped = (n: number): string => String(n).replace(/\B(?=(\d{3})+$)/g, " ");

export class Answers {
  private waits: Record<string, string> = {};
  constructor(private of: Explorer) {}

  /** Say what lasts, and for how long by now. */
  tick(): void {
    const lasting = this.of.link.underWay,
      kind = ["motion", "settle", "map", "responses"].find(k => lasting[k] > PATIENCE);
    if (!kind) return;
    const waits = Object.keys(this.waits).find(k => k in lasting),
      sheet = this.of.map.sheet;
    const text =
      !waits && kind === "map" && sheet && (sheet.known || sheet.open)
        ? this.mapText()
        : `${waits ? this.waits[waits] : DOING[kind]}, ${Math.round(lasting[waits ?? kind])} s`;
    if (!this.of.motion) $("motion-what").textContent = text;
    this.of.status.say(text);
  }

  hear(head: Head, arrays: Arrays, question: Question): void {
    const { ask, kind } = head;
    if (this.of.typed && head.id === this.of.typed.id && kind !== "waits") return this.heardTyped(head, arrays);
    if (kind === "refused") return this.refused(head);
    if (kind === "failed") {
      if (ask === "save") this.of.save.refuse(String(head.why));
      return this.of.says.say(
        `Something went wrong at the desk: ${head.why} (number ${head.number}, in the terminal too).`,
      );
    }
    if (kind === "waits") {
      this.waits[ask] = (head.words ?? []).join(" ").replace(/, \d+ s so far$/, "");
      return this.tick();
    }
    delete this.waits[ask];
    if (kind.startsWith("map-")) return this.heardMap(head, arrays);
    if (kind === "motion") {
      if (!this.of.view.orbit) this.showMotion(head, arrays);
    } else if (kind === "settle") this.heardSettle(head, arrays, question);
    else if (kind === "track") this.heardTrack(head, arrays);
    else if (kind === "orbit") this.heardOrbit(head, arrays, question);
    else if (kind === "responses-progress")
      $("responses-under").textContent = `${head.doing}: ${Math.round(100 * head.share)} %`;
    else if (kind === "agreement-progress")
      this.of.status.say(`by ${head.method}: ${grouped(head.known)} of ${grouped(head.of)} starts`);
    else if (kind === "agreement") this.heardAgreement(head, arrays);
    else if (kind === "responses") this.heardResponses(head, arrays);
    else if (kind === "save") this.of.save.take(head, arrays);
  }
  heardTyped(head: Head, arrays: Arrays): void {
    const { key, text } = this.of.typed!,
      group = key.startsWith("values.") ? "values" : "start";
    this.of.typed = null;
    if (head.kind === "stopped") return this.of.type(group, key.slice(group.length + 1), text); // a newer motion took its place
    if (head.kind !== "motion") {
      this.of.values.refuse(key, String(head.why ?? ""));
      return;
    }
    this.of.values.accept(key);
    this.of.go({
      [group]: group === "values" ? this.known(head.values) : this.of.beginning(head, arrays),
      ...(group === "start" ? { orbit: null } : {}),
    });
  }
  known(values: Record<string, number>): Record<string, number> {
    return Object.fromEntries(
      this.of.about.parameters.map(p => [p.name, values[p.name] ?? this.of.view.values[p.name]]),
    );
  }
  refused(head: Head): void {
    const why = String(head.why),
      field: string = head.field ?? "";
    if (head.ask === "save" && this.of.save.shown) return this.of.save.refuse(why);
    if (field && this.of.values.refuse(field === "values" ? `values.${this.of.slid}` : field, why)) return;
    if (head.ask === "map" || head.ask === "agreement") return this.noMap(head, why);
    if (head.ask === "responses") {
      if (field.startsWith("range")) return this.of.range.refuse(why);
      $("responses-under").textContent = "";
      this.of.responses.without = "no branches";
      this.of.responses.draw();
      return notes($("responses-words"), [why]);
    }
    if ((head.ask === "track" || head.ask === "settle") && !this.of.view.orbit) return clearOrbit(why);
    if ((head.ask === "orbit" || head.ask === "track") && this.of.view.orbit)
      this.of.go({ orbit: null }, { past: true });
    this.of.says.say(why);
  }
  /** The map can't be: its panel says why. */
  noMap(head: Head, why: string): void {
    const sheet = this.of.maps.get(head.id);
    if (!sheet) return;
    sheet.done = true;
    sheet.words = [why];
    if (sheet !== this.of.map.sheet) return;
    this.legend();
    this.of.map.draw();
    this.of.status.say("no map");
  }
  showMotion(head: Head, arrays: Arrays): void {
    this.of.heard = performance.now();
    this.of.motion = motionOf(head, arrays);
    const { history, phase } = this.of.view;
    this.of.history.show(this.of.motion, history);
    this.of.phase.show(this.of.motion, phase);
    this.of.later("contacts", this.of.dragging ? 120 : 0, () => {
      if (this.of.motion) this.of.contacts.show(this.of.motion);
    });
    notes($("motion-words"), head.words);
    $("motion-what").textContent = this.motionText();
    $("motion-title").textContent = this.of.motion.orbit ? "Orbit's motion" : "Motion";
    this.of.marks();
  }
  motionText(): string {
    const head = this.of.motion?.head,
      n = this.of.about.forced ? "periods" : "turns";
    if (!head) return "";
    if (this.of.motion!.orbit)
      return `${head.name ?? "orbit"}${stability(head.stable) ? `, ${stability(head.stable)}` : ""}, ${head.repeats === false ? "some periods of it" : "repeated: nothing is integrated on"}`;
    const starts = Object.entries(this.of.view.start),
      from = starts.every(([, v]) => v === 0)
        ? "rest at zero"
        : starts
            .slice(0, 3)
            .map(([name, v]) => `${plain(name)} = ${spoken(v, unitOf(this.of.about, name))}`)
            .join(", ");
    const parts = [
      `from ${from}`,
      `${head.periods} ${n}`,
      `${head.contacts} ${head.contacts === 1 ? "contact" : "contacts"}`,
    ];
    if (this.of.settled && !this.of.dragging) parts.push(this.settledText(this.of.settled));
    return parts.join(" · ") + (head.against ? `. ${head.against.words}` : "");
  }
  settledText(head: Head): string {
    return (
      head.words?.[0] ??
      (head.attractor ? `settles to ${head.attractor.name}` : (this.of.about.codes[String(head.code)] ?? "not settled"))
    );
  }
  heardSettle(head: Head, arrays: Arrays, question: Question): void {
    const same = (asked: unknown, now: unknown) => JSON.stringify(asked) === JSON.stringify(now);
    if (this.of.view.orbit || !same(question.start, this.of.view.start)) return;
    if (!same(question.values, this.of.asks.changed())) return;
    this.of.settledFrom = JSON.stringify(question.start);
    this.of.settled = head;
    this.of.orbit = head.attractor ? head : null;
    if (head.attractor)
      showOrbit(
        this.of.about,
        head,
        `${head.attractor.name}${stability(head.attractor.stable) ? `, ${stability(head.attractor.stable)}` : ""}`,
      );
    else clearOrbit(this.settledText(head));
    this.of.phase.over(head.attractor && arrays[`sample:${this.of.view.phase[0]}`] ? motionOf(head, arrays) : null);
    $("motion-what").textContent = this.motionText();
    this.of.status.say(this.settledText(head));
    this.of.marks();
  }
  heardTrack(head: Head, arrays: Arrays): void {
    if (!this.of.view.orbit && this.of.settled) return; // what the start settles to is known by now
    if (head.lost) {
      clearOrbit(head.lost);
      this.of.phase.over(null);
      if (this.of.view.orbit) {
        this.of.orbit = null;
        this.of.go({ orbit: null }, { past: true });
        this.of.says.say(`The orbit ${head.lost}. The motion from the start is shown.`);
      }
      return this.of.marks();
    }
    this.of.orbit = head;
    this.of.settled = null;
    showOrbit(
      this.of.about,
      head,
      `${head.name ?? "orbit"}${stability(head.stable) ? `, ${stability(head.stable)}` : ""}`,
    );
    if (this.of.view.orbit) {
      this.of.view.orbit = {
        track: { point: Object.values(head.start), period: head.periods || 1, source: head.values },
      };
      this.showMotion(head, arrays);
    } else this.of.phase.over(motionOf(head, arrays));
    this.of.marks();
  }
  heardOrbit(head: Head, arrays: Arrays, question: Question): void {
    if (!this.of.view.orbit) return;
    this.of.orbit = head;
    this.of.settled = null;
    this.of.settledFrom = "";
    this.of.phase.over(null);
    showOrbit(
      this.of.about,
      head,
      `${head.name ?? "orbit"}${stability(head.stable) ? `, ${stability(head.stable)}` : ""}`,
    );
    this.showMotion(head, arrays);
    if (question.responses !== undefined)
      this.of.go({ values: this.known(head.values), start: this.of.beginning(head, arrays) }, { shown: true });
    this.of.status.say($("motion-what").textContent!);
  }
  heardResponses(head: Head, arrays: Arrays): void {
    this.of.responses.show(head, arrays);
    this.of.range.refuse("");
    if (head.done) this.of.status.say(this.mapText());
    notes($("responses-words"), head.words);
    if (JSON.stringify(head.range) !== JSON.stringify(this.of.view.range) || head.quantity !== this.of.view.quantity)
      this.of.go({ range: head.range, quantity: head.quantity }, { shown: true });
    $("responses-under").textContent =
      head.done === false
        ? `followed to ${Math.round(100 * (head.share ?? 0))} %`
        : "click a point: that orbit. Solid: stable; dashed: unstable";
    if ($("responses-table").getAttribute("aria-pressed") === "true")
      this.of.responses.table($("points").querySelector("thead")!, $("points").querySelector("tbody")!, ALL_POINTS);
    this.of.marks();
  }
  heardMap(head: Head, arrays: Arrays): void {
    const sheet = this.of.maps.get(head.id);
    if (!sheet || head.kind === "map-stopped") return;
    if (head.attractors) {
      sheet.attractors = head.attractors;
      sheet.dirty = true;
    }
    if (head.kind === "map-piece") {
      sheet.packed(head.level, arrays);
      sheet.known = head.known;
      sheet.open = head.open;
      sheet.of = head.of;
    }
    if (head.kind === "map-look") sheet.looked = head.share;
    if (head.fractions) {
      const by = new Map<number, any>(head.fractions.map((f: any) => [f.key, f]));
      sheet.level = head.level;
      sheet.attractors = sheet.attractors.map(one => ({ ...one, ...(by.get(one.key) ?? {}) }));
      sheet.dirty = true;
    }
    if (head.kind === "map-end") {
      sheet.done = !head.coarse;
      sheet.looked = 1;
      sheet.took = (performance.now() - this.of.begun) / 1000;
      if (head.flip_rate != null)
        sheet.flip = `${digits(100 * head.flip_rate, 2)} % of the starts lead elsewhere when computed more exactly`;
      sheet.words = head.words ?? [];
    }
    if (sheet !== this.of.map.sheet) return;
    if (head.kind !== "map-piece") this.legend();
    this.of.map.draw();
    this.of.status.say(this.mapText());
    if (sheet.done) this.of.asks.askAgreement();
  }
  heardAgreement(head: Head, arrays: Arrays): void {
    const agreement = this.of.agreeing?.id === head.id ? this.of.agreeing.sheet.agreement : null;
    if (!agreement) return;
    agreement.take(head.level, arrays.agreement);
    agreement.words = head.words ?? [];
    if ((agreement.done = head.done)) {
      this.of.agreeing = null;
      this.of.status.say(`compared with ${agreement.against}`);
    }
    this.legend();
    this.of.map.draw();
  }
  mapText(): string {
    const s = this.of.map.sheet;
    if (!s) return "";
    if (s.done && !s.known) return "no map";
    if (s.done) return `${grouped(s.of)} starts, all known`;
    const parts = [
      `${grouped(s.known)} of ${grouped(s.of)} starts`,
      ...(s.open ? [`${grouped(s.open)} not settled yet`] : []),
      ...(s.looked < 1 ? [`attractors looked for: ${Math.round(100 * s.looked)} %`] : []),
      `${((performance.now() - this.of.begun) / 1000).toFixed(1)} s`,
    ];
    return parts.join(", ");
  }
  legend(): void {
    const s = this.of.map.sheet,
      present = s ? new Set(s.label) : new Set<number>();
    const codes = Object.entries(this.of.about.codes)
      .filter(([code]) => present.has(+code))
      .map(
        ([code, name]) => [name, this.of.about.code_colors[code] ?? [120, 120, 120], ""] as [string, number[], string],
      );
    if (s && !s.done && !s.known && !s.attractors.length) return; // the one before stays, dim, until there is another
    showLegend(this.of.about, s?.attractors ?? [], codes, this.of.view.history, this.of.map.only, key =>
      this.of.attractor(key),
    );
    notes($("map-words"), [...(s?.words ?? []), ...(this.of.map.agreement?.words.slice(1) ?? [])]);
    this.of.map.tell();
    this.of.map.label(
      `basins of ${plain(this.of.view.axes[0])} and ${plain(this.of.view.axes[1])}, ${s?.attractors.length ?? 0} attractors; arrows move the start, shift and arrows the view, plus and minus zoom, Enter settles; the table of attractors follows`,
    );
  }
  hover(where: Place | null, at: [number, number] | null, sheet: Sheet | null): void {
    const [a, b] = this.of.view.axes,
      say = (p: [number, number]) =>
        `${plain(a)} = ${spoken(p[0], unitOf(this.of.about, a), 5)}, ${plain(b)} = ${spoken(p[1], unitOf(this.of.about, b), 5)}`;
    if (!at) {
      const s = this.of.map.sheet;
      $("map-under").textContent =
        this.of.map.agreement?.words[0] ||
        s?.flip ||
        (s?.level && s.level > 1
          ? `shares of the starts in every ${ORDINAL[s.level] ?? `${s.level}th`} row and column`
          : "click: a start; drag: the view; wheel: closer");
      return;
    }
    if (!where || !sheet) {
      $("map-under").textContent = `${say(at)}: not known yet`;
      return;
    }
    const one = sheet.attractors.find((o: Attractor) => o.key === where.label),
      what = one ? one.name : (this.of.about.codes[String(where.label)] ?? "");
    const when =
      one && where.age < 255 ? `, settles within ${2 ** where.age} ${this.of.about.forced ? "periods" : "turns"}` : "";
    const here = say(at),
      cell = say(where.at),
      block = where.stride > 1 ? "block" : "cell",
      other = this.of.map.agreement?.sheet.find(...at),
      by = this.of.map.agreement?.against,
      apart = other ? ({ "0": `, elsewhere by ${by}`, "1": `, the same by ${by}` }[String(other.label)] ?? "") : "";
    $("map-under").textContent =
      `${here}${here === cell ? "" : `; the ${block} shows the start ${cell}`}: ${what}${when}${apart}`;
  }
}
