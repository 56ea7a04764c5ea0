/** The page of one system: what is looked at, what is asked for it, and where the answers go. */
import { type About, type Attractor, coordinates, isOutput, plain, states, unitOf } from "./about";
import { digits, onTheme, type Range, spoken } from "./axes";
import { Contacts } from "./contacts";
import { History } from "./history";
import type { Arrays, Head, Link, Question } from "./link";
import { BasinMap } from "./map";
import { type Motion, motionOf } from "./motion";
import { clearOrbit, showLegend, showOrbit, stability } from "./orbit";
import { Phase } from "./phase";
import { Responses } from "./responses";
import { SaveSheet } from "./save";
import { type Place, Sheet } from "./sheets";
import { type Box, firstView, fromAddress, startOf, toAddress, Undo, type View } from "./state";
import { Values } from "./values";
import { $, differing, marked, notes, only, options, type Says, type Status } from "./words";

/** drag: the finger is down; past: from the list of undo; shown: the motion and the curves are of it already; half: its values are still to come. */
interface Change { drag?: boolean; past?: boolean; shown?: boolean; half?: boolean }
/** Milliseconds: rest before a start is settled, before a map of another view, between coarse maps of a drag, before a view is kept for undo, before the desk is told of it. */
const SETTLE = 300, REST = 150, COARSE = 250, KEEP = 400, TELL = 1000;
/** Milliseconds without an answer after which what follows a slider is dimmed. */
const LATE = 250;
const SIZES = [50, 100, 160, 250, 400, 700, 1000], ALL_POINTS = 1000;

export class Explorer {
  view: View; readonly first: View; map: BasinMap; history: History; phase: Phase; responses: Responses; values: Values; private contacts: Contacts; readonly save: SaveSheet;
  motion: Motion | null = null; maps = new Map<number, Sheet>();
  private undo: Undo; private orbit: Head | null = null; private settled: Head | null = null; private timers: Record<string, number> = {};
  private kept = ""; private dragging = false; private dragged = ""; private heard = 0; private settledFrom = ""; private coarse = 0; private begun = 0; private typed: { key: string; text: string; id: number } | null = null; private whole: Box;

  constructor(readonly about: About, private link: Link, private status: Status, private says: Says, address: string | null) {
    this.first = firstView(about);
    const opened = address === null ? { view: structuredClone(this.first), damaged: false } : fromAddress(address, this.first, about);
    this.view = opened.view; this.whole = [...this.first.box];
    if (opened.damaged) says.say("The address of the view is damaged: what could be read of it is shown, the rest is as at first.");
    $("system").textContent = about.system!.name; $("system").title = about.system!.description; document.title = `${about.system!.name} - saltus explorer`;
    this.values = new Values(about, { slide: (name, value, done) => this.slide(name, value, done), type: (group, name, text) => this.type(group, name, text) });
    this.map = new BasinMap($("map-canvas"), about, {
      start: (at, done) => this.go({ start: { ...this.view.start, [this.view.axes[0]]: at[0], [this.view.axes[1]]: at[1] }, orbit: null }, { drag: !done }),
      view: (box, done) => this.go({ box }, { drag: !done }), hover: (where, at, sheet) => this.hover(where, at, sheet), settle: () => this.settleNow(),
    });
    this.map.painted = () => this.marks();
    this.history = new History($("history"), about, text => { $("motion-what").textContent = text || this.motionText(); });
    this.phase = new Phase($("phase-canvas"), $("phase-under"), about);
    this.responses = new Responses($("responses-canvas"), about, { orbit: choice => this.orbitOf(choice), hover: text => { $("responses-under").textContent = text; } });
    this.contacts = new Contacts(about, i => { this.history.choose(i); this.phase.choose(i); });
    this.save = new SaveSheet($("save"), fields => this.link.ask("save", { ...fields, view: this.shownView() }), () => this.address(), () => this.mapText());
    this.undo = new Undo(view => this.go(view, { past: true }), (undo, redo) => { $<HTMLButtonElement>("undo").disabled = !undo; $<HTMLButtonElement>("redo").disabled = !redo; });
    this.controls(); onTheme(() => { this.history.draw(); this.phase.draw(); this.responses.draw(); this.map.draw(); });
    this.show(); this.kept = toAddress(this.view, this.first); this.undo.replace(this.view, this.kept);
    this.askAll();
  }

  // -- what is looked at ------------------------------------------------------------------------------------------------------
  /** Look at something else: ask what it needs, and keep it for undo once it rests. */
  go(change: Partial<View>, { drag = false, past = false, shown = false, half = false }: Change = {}): void {
    const before = this.view, next = (this.view = { ...before, ...structuredClone(change) });
    const other = (...keys: (keyof View)[]) => keys.some(k => JSON.stringify(before[k]) !== JSON.stringify(next[k])), released = this.dragging && !drag;
    this.dragging = drag;
    if (other("start", "values", "method")) this.settled = null;
    if (other("start")) this.phase.over(null);
    if (other("orbit") && next.orbit === null) this.responses.chosen = -1;
    if (past && other("axes")) this.whole = this.wholeOf(next.axes);
    this.show();
    const values = other("values");
    if (!shown) this.askMotions(values || released, other("values", "start", "periods", "method", "against", "orbit", "history", "phase") || released, other("start", "method") || released, past || other("orbit"));
    const others = states(this.about).some(name => !next.axes.includes(name) && before.start[name] !== next.start[name]);
    if (other("history")) this.legend();
    if (values && drag) this.askCoarse();
    else if (values || other("method", "size", "axes") || others) this.askMap();
    else if (other("box")) { this.pickSheet(); this.later("map", REST, () => this.askMap()); } else if (released) this.askMap();
    const apart = Object.keys(next.values).some(name => name !== next.over && next.values[name] !== before.values[name]);
    if (!drag && !shown && (apart || other("over", "range", "quantity") || released)) this.askResponses();
    if (!past) this.later("keep", KEEP, () => this.keep(), drag || half);
    else this.kept = toAddress(next, this.first);
  }
  private askMotions(values: boolean, motion: boolean, start: boolean, orbit: boolean): void {
    if (values && this.view.orbit && !orbit) return this.track();
    if (motion) this.askMotion();
    if (this.view.orbit) return;
    if (values) this.track();
    if (values || start) this.later("settle", SETTLE, () => this.settleNow(), this.dragging);
  }
  private later(name: string, wait: number, what: () => void, hold = false): void {
    clearTimeout(this.timers[name]); delete this.timers[name];
    if (!hold) this.timers[name] = window.setTimeout(() => { delete this.timers[name]; what(); }, wait);
  }
  /** True if all that was asked is answered, and nothing is going to be. */
  get rests(): boolean { return this.link.quiet && Object.keys(this.timers).every(name => name === "told") && this.motion !== null; }
  private keep(): void {
    const address = toAddress(this.view, this.first);
    if (address !== this.kept) { this.kept = address; this.undo.push(this.view, address); } else this.undo.replace(this.view, address);
    this.later("told", TELL, () => this.link.tell("show", { view: this.shownView() }));
  }
  private address(): string { return `${location.origin}/#token=${this.token()}&view=${toAddress(this.view, this.first)}`; }
  token: () => string = () => "";

  private show(): void {
    const v = this.view;
    this.values.show(v.values, v.start);
    this.map.at = [v.start[v.axes[0]], v.start[v.axes[1]]]; this.map.look(v.axes, v.box, this.whole);
    const only = (v.orbit?.attractor as number | undefined) ?? null;
    if (only !== this.map.only) { this.map.only = only; this.map.recolour(); this.legend(); }
    for (const [id, value] of [["method", v.method], ["against", v.against], ["map-first", v.axes[0]], ["map-second", v.axes[1]], ["map-size", String(v.size)], ["history-of", v.history], ["phase-first", v.phase[0]], ["phase-second", v.phase[1]], ["over", v.over], ["quantity", v.quantity]] as const)
      $<HTMLSelectElement>(id).value = value;
    const unit = this.about.parameters.find(p => p.name === v.over)?.unit ?? "";
    for (const [id, value] of [["range-low", v.range[0]], ["range-high", v.range[1]]] as const) if (document.activeElement?.id !== id) $<HTMLInputElement>(id).value = spoken(value, unit, 5);
    if (document.activeElement?.id !== "periods") $<HTMLInputElement>("periods").value = String(v.periods);
    this.responses.now = v.values[v.over]; this.responses.draw(); $("orbit-leave").hidden = v.orbit === null; this.marks();
  }

  /** Rule one: every panel says of which values it is. */
  private marks(): void {
    const { about, view } = this, now = view.values;
    for (const [panel, head] of [["motion", this.motion?.head], ["phase", this.motion?.head], ["orbit", this.orbit]] as const) {
      const apart = differing(about, head?.values, now), follows = this.dragging && this.dragged !== "" && head != null;
      if (panel === "orbit" && apart === "" && this.settledFrom !== "" && this.settledFrom !== JSON.stringify(this.view.start)) { marked(panel, "of the start before"); continue; }
      if (follows) marked(panel, only(about, this.dragged, head.values), apart !== "" && performance.now() - this.heard > LATE); else marked(panel, apart);
    }
    marked("responses", this.responses.head ? differing(about, this.responses.head.values, now, [this.responses.head.parameter]) : "");
    const under = this.map.under, of = under ? differing(about, under.values, now) : "";
    $("map-of").textContent = of ? `pale: ${of}` : this.map.paler ? "pale: cells of another view" : ""; $("map").classList.toggle("stale", of !== "");
  }

  // -- questions --------------------------------------------------------------------------------------------------------------
  private changed(): Record<string, number> { return Object.fromEntries(this.about.parameters.filter(p => this.view.values[p.name] !== p.value).map(p => [p.name, this.view.values[p.name]])); }
  private motionFields(): Question {
    const v = this.view, fields: Question = { start: v.start, values: this.changed(), periods: v.periods, method: v.method, quantities: [...new Set([v.history, ...v.phase, ...(isOutput(this.about, v.axes[0]) ? v.axes : [])])] };
    if (v.against) fields.against = v.against;
    return fields;
  }
  private mapFields(): Question {
    const v = this.view, [a, b, c, d] = v.box, at = Object.fromEntries(Object.entries(v.start).filter(([name]) => !v.axes.includes(name)));
    return { axes: { [v.axes[0]]: [a, b], [v.axes[1]]: [c, d] }, size: v.size, values: this.changed(), at, method: v.method, ...this.about.view.map };
  }
  private responseFields(): Question { const v = this.view; return { values: this.changed(), parameter: v.over, range: v.range, quantity: v.quantity }; }
  shownView(): Question { return { motion: this.motionFields(), map: this.mapFields(), ...(this.view.over ? { responses: this.responseFields() } : {}) }; }

  askAll(): void { this.askMotion(); this.askMap(); this.askedValues = ""; this.askResponses(); this.later("settle", SETTLE, () => this.settleNow()); }
  private askMotion(): void {
    const orbit = this.view.orbit;
    if (!orbit) this.link.newest("motion", { ...this.motionFields(), errors: this.dragging ? "local" : "measured" });
    else if (orbit.track) this.link.newest("track", { ...(orbit.track as Question), values: this.view.values });
    else this.link.newest("orbit", { ...orbit, values: this.view.values });
  }
  private settleNow(): void { if (!this.view.orbit) this.link.newest("settle", { start: this.view.start, values: this.changed(), method: this.view.method }); }
  /** The known orbit follows the values by Newton's method. */
  private track(): void {
    const known = this.orbit, point = known?.start ?? known?.attractor?.points?.[0];
    if (!known || !point || !known.periods && !known.attractor) { if (this.view.orbit) { this.view.orbit = null; this.askMotion(); } return; }
    const period = known.attractor?.period || known.periods || 1;
    if (period > 64) return;
    this.link.newest("track", { values: this.view.values, source: known.values, point: Array.isArray(point) ? point : states(this.about).map(name => point[name]), period });
  }
  private askedValues = "";
  private askResponses(): void {
    if (!this.view.over) return;
    const fields = this.responseFields(), { [this.view.over]: _, ...others } = fields.values as Record<string, number>, key = JSON.stringify({ ...fields, values: others });
    if (key === this.askedValues) return;
    this.askedValues = key; this.link.ask("responses", fields);
  }
  private mapKey(fields: Question): string { return JSON.stringify({ ...fields, values: this.view.values }); }
  private pickSheet(): void { const sheet = this.map.sheets.get(this.mapKey(this.mapFields())); if (sheet) { this.map.sheet = sheet; this.legend(); this.map.draw(); } }
  private askCoarse(): void {
    this.pickSheet();
    const wait = this.coarse + COARSE - performance.now();
    if (wait <= 0) { this.coarse = performance.now(); this.askMap(true); } else this.later("map", wait, () => { this.coarse = performance.now(); this.askMap(this.dragging); });
  }
  private askMap(coarse = false): void {
    clearTimeout(this.timers.map); delete this.timers.map;
    const fields = this.mapFields(), key = this.mapKey(fields), v = this.view, { axes, size, values, ...plane } = fields;
    let sheet = this.map.sheets.get(key);
    if (this.map.sheet && this.map.sheet !== sheet && !this.map.sheet.known) this.map.sheets.drop(this.map.sheet);
    if (!sheet) this.map.sheets.add((sheet = new Sheet(key, { ...v.values }, JSON.stringify([v.axes, plane]), [...v.box], ...v.size)));
    this.map.sheet = sheet; this.map.draw(); this.legend();
    if (sheet.done) { this.link.tell("stop", { of: "map" }); this.status.say(this.mapText()); return; }
    this.begun = performance.now(); this.status.say(this.mapText());
    const id = this.link.ask("map", coarse ? { ...fields, coarse } : fields);
    if (id >= 0) { this.maps.clear(); this.maps.set(id, sheet); }
  }

  // -- what the user does -------------------------------------------------------------------------------------------------------
  private slide(name: string, value: number, done: boolean): void { this.values.refuse(`values.${name}`, ""); this.dragged = name; this.settled = null; this.status.say(`${plain(name)} ${spoken(value, this.about.parameters.find(p => p.name === name)!.unit, 5)}`); this.go({ values: { ...this.view.values, [name]: value } }, { drag: !done }); if (done) { this.dragged = ""; this.marks(); } }
  private type(group: "values" | "start", name: string, text: string): void {
    const fields = this.motionFields(), id = this.link.ask("motion", { ...fields, [group]: { ...(fields[group] as object), [name]: text } });
    this.typed = { key: `${group}.${name}`, text, id };
  }
  private orbitOf(choice: { point?: number; event?: number }): void { const key = this.responses.head?.key; if (key !== undefined) this.go({ orbit: { responses: key, ...choice } }, { half: true }); }
  private attractor(key: number): void { this.go({ orbit: this.view.orbit?.attractor === key ? null : { attractor: key } }); }
  leaveOrbit(): void { this.go({ orbit: null }); this.status.say("the motion from the start"); }
  stop(): void { for (const name of ["map", "settle"]) { clearTimeout(this.timers[name]); delete this.timers[name]; } this.link.tell("stop"); this.askedValues = ""; this.status.say("stopped"); }
  back(): void { this.undo.undo(); }
  forth(): void { this.undo.redo(); }

  /** Another axis of the map: both are states, or both are sensors. */
  private axis(i: 0 | 1, name: string): void {
    const { about, view } = this, axes = [...view.axes] as [string, string], kind = isOutput(about, name);
    if (axes[1 - i] === name) axes[1 - i] = axes[i];
    axes[i] = name;
    if (isOutput(about, axes[1 - i]) !== kind) axes[1 - i] = about.choices.find(other => other !== name && isOutput(about, other) === kind) ?? view.axes[1 - i];
    if (axes[0] === axes[1] || isOutput(about, axes[0]) !== isOutput(about, axes[1])) return this.show();
    this.whole = this.wholeOf(axes); this.go({ axes, box: [...this.whole], start: startOf(about, axes, { ...this.motion?.head.start, ...view.start }) });
  }
  /** The start of an answer in the coordinates of the map; sensors to the seven digits of their samples. */
  private beginning(head: Head, arrays: Arrays): Record<string, number> {
    const known = (name: string): number => head.start[name] ?? (arrays[`sample:${name}`] ? +arrays[`sample:${name}`][0].toPrecision(7) : this.view.start[name]);
    return Object.fromEntries(coordinates(this.about, this.view.axes).map(name => [name, known(name)]));
  }
  private wholeOf([a, b]: [string, string]): Box {
    const own = (name: string): Range => this.about.axes[name] ?? (this.about.ranges?.[name]) ?? [-1, 1];
    return [...own(a), ...own(b)];
  }
  private controls(): void {
    const { about } = this, names = about.quantities.map(q => [q.name, plain(q.name)] as [string, string]), on = (id: string, what: (value: string) => void) => { $<HTMLSelectElement>(id).onchange = e => what((e.target as HTMLSelectElement).value); };
    options($("method"), about.methods.map(m => [m, m]), this.view.method); on("method", method => this.go({ method }));
    options($("against"), [["", "nothing"], ...about.methods.map(m => [m, m] as [string, string])], ""); on("against", against => this.go({ against }));
    for (const [id, i] of [["map-first", 0], ["map-second", 1]] as const) {
      options($(id), about.choices.map(name => [name, plain(name)]), this.view.axes[i]); $(id).hidden = about.choices.length < 3;
      on(id, name => { this.axis(i, name); });
    }
    const sizes = new Map([...SIZES.map(n => [n, n]), about.size, this.view.size].sort((p, q) => p[0] * p[1] - q[0] * q[1]).map(([n, m]) => [`${n},${m}`, `${n} × ${m}`]));
    options($("map-size"), [...sizes], String(this.view.size)); on("map-size", n => this.go({ size: n.split(",").map(Number) as [number, number] }));
    for (const id of ["history-of", "phase-first", "phase-second", "quantity"]) options($(id), names, "");
    $("history-of").hidden = names.length < 2; on("history-of", history => this.go({ history }));
    on("phase-first", name => this.go({ phase: [name, this.view.phase[1]] })); on("phase-second", name => this.go({ phase: [this.view.phase[0], name] }));
    options($("over"), about.parameters.map(p => [p.name, plain(p.name)]), ""); on("over", over => { const p = about.parameters.find(q => q.name === over)!; this.go({ over, range: [p.low, p.high] }); });
    on("quantity", quantity => this.go({ quantity }));
    for (const [id, i] of [["range-low", 0], ["range-high", 1]] as const) $<HTMLInputElement>(id).onchange = e => this.typeRange(i, (e.target as HTMLInputElement).value);
    $("responses").hidden = !about.parameters.length; $("periods").previousElementSibling!.textContent = about.forced ? "periods shown" : "turns shown";
    $<HTMLInputElement>("periods").onchange = e => {
      const n = +(e.target as HTMLInputElement).value, fine = Number.isInteger(n) && n >= 1 && n <= 100_000;
      $("periods-note").textContent = fine ? "" : "a whole number from 1 to 100 000"; if (fine) this.go({ periods: n });
    };
    $<HTMLInputElement>("hold").onchange = e => { const held = (e.target as HTMLInputElement).checked; this.history.hold(held); this.phase.hold(held); };
    const click = (id: string, what: () => void) => { $(id).onclick = what; };
    click("map-in", () => this.map.zoom(0.7)); click("map-out", () => this.map.zoom(1 / 0.7)); click("map-whole", () => this.map.showWhole());
    click("undo", () => this.back()); click("redo", () => this.forth()); click("orbit-leave", () => this.leaveOrbit()); click("reset", () => this.go({ values: { ...this.first.values }, start: startOf(this.about, this.view.axes, this.first.start), orbit: null }));
    click("save-open", () => this.openSave()); click("responses-table", () => this.table());
  }
  openSave(): void { this.save.open(`${about_(this.about)}-${Object.entries(this.changed()).slice(0, 2).map(([name, v]) => spoken(v, this.about.parameters.find(p => p.name === name)!.unit, 4).replace(/\s/g, "")).join("-")}`.replace(/[^\w.-]/g, "").replace(/-$/, "")); }
  table(): void {
    const button = $("responses-table"), on = button.getAttribute("aria-pressed") !== "true";
    button.setAttribute("aria-pressed", String(on)); $("points-scroll").hidden = !on; $("responses-canvas").hidden = on;
    if (on) this.responses.table($("points").querySelector("thead")!, $("points").querySelector("tbody")!, ALL_POINTS);
  }
  /** A range is typed with units: the desk reads it. */
  private typeRange(i: number, text: string): void {
    const p = this.about.parameters.find(q => q.name === this.view.over)!, typed = text.trim().replace("−", "-"), bare = /^[-+]?[\d.,]+(e[-+]?\d+)?$/i.test(typed);
    const range: (number | string)[] = [...this.view.range]; range[i] = bare && p.shown.unit ? `${typed} ${p.shown.unit}` : typed;
    this.askedValues = ""; this.link.ask("responses", { ...this.responseFields(), range });
  }

  // -- answers ------------------------------------------------------------------------------------------------------------------
  hear(head: Head, arrays: Arrays, question: Question): void {
    const { ask, kind } = head;
    if (this.typed && head.id === this.typed.id && kind !== "waits") return this.heardTyped(head, arrays);
    if (kind === "refused") return this.refused(head);
    if (kind === "failed") { if (ask === "save") this.save.refuse(String(head.why)); return this.says.say(`Something went wrong at the desk: ${head.why} (number ${head.number}, in the terminal too).`); }
    if (kind === "waits") return this.status.say((head.words ?? []).join(" "));
    if (kind.startsWith("map-")) return this.heardMap(head, arrays);
    if (kind === "motion") { if (!this.view.orbit) this.showMotion(head, arrays); }
    else if (kind === "settle") this.heardSettle(head, arrays, question);
    else if (kind === "track") this.heardTrack(head, arrays);
    else if (kind === "orbit") this.heardOrbit(head, arrays, question);
    else if (kind === "responses-progress") $("responses-under").textContent = `the branches are followed: ${Math.round(100 * head.share)} %`;
    else if (kind === "responses") this.heardResponses(head, arrays);
    else if (kind === "save") this.save.take(head, arrays);
  }
  private heardTyped(head: Head, arrays: Arrays): void {
    const { key, text } = this.typed!, group = key.startsWith("values.") ? "values" : "start";
    this.typed = null;
    if (head.kind === "stopped") return this.type(group, key.slice(group.length + 1), text);    // a newer motion took its place
    if (head.kind !== "motion") { this.values.refuse(key, String(head.why ?? "")); return; }
    this.values.accept(key); this.go({ [group]: group === "values" ? this.known(head.values) : this.beginning(head, arrays), ...(group === "start" ? { orbit: null } : {}) });
  }
  private known(values: Record<string, number>): Record<string, number> { return Object.fromEntries(this.about.parameters.map(p => [p.name, values[p.name] ?? this.view.values[p.name]])); }
  private refused(head: Head): void {
    const why = String(head.why), field: string = head.field ?? "";
    if (head.ask === "save" && this.save.shown) return this.save.refuse(why);
    if (field && this.values.refuse(field, why)) return;
    if (head.ask === "track" && !this.view.orbit) return clearOrbit(why);
    if ((head.ask === "orbit" || head.ask === "track") && this.view.orbit) this.go({ orbit: null }, { past: true });
    this.says.say(why);
  }
  private showMotion(head: Head, arrays: Arrays): void {
    this.heard = performance.now(); this.motion = motionOf(head, arrays); const { history, phase } = this.view;
    this.history.show(this.motion, history); this.phase.show(this.motion, phase);
    this.later("contacts", this.dragging ? 120 : 0, () => { if (this.motion) this.contacts.show(this.motion); });
    notes($("motion-words"), head.words); $("motion-what").textContent = this.motionText();
    $("motion-title").textContent = this.motion.orbit ? "Orbit's motion" : "Motion"; this.marks();
  }
  private motionText(): string {
    const head = this.motion?.head, n = this.about.forced ? "periods" : "turns";
    if (!head) return "";
    if (this.motion!.orbit) return `${head.name ?? "orbit"}${stability(head.stable) ? `, ${stability(head.stable)}` : ""}, ${head.repeats === false ? "some periods of it" : "repeated: nothing is integrated on"}`;
    const starts = Object.entries(this.view.start), from = starts.every(([, v]) => v === 0) ? "rest at zero" : starts.slice(0, 3).map(([name, v]) => `${plain(name)} = ${spoken(v, unitOf(this.about, name))}`).join(", ");
    const parts = [`from ${from}`, `${head.periods} ${n}`, `${head.contacts} ${head.contacts === 1 ? "contact" : "contacts"}`];
    if (this.settled && !this.dragging) parts.push(this.settledText(this.settled));
    return parts.join(" · ") + (head.against ? `. ${head.against.words}` : "");
  }
  private settledText(head: Head): string {
    return head.words?.[0] ?? (head.attractor ? `settles to ${head.attractor.name}` : this.about.codes[String(head.code)] ?? "not settled");
  }
  private heardSettle(head: Head, arrays: Arrays, question: Question): void {
    if (this.view.orbit || JSON.stringify(question.start) !== JSON.stringify(this.view.start)) return;
    this.settledFrom = JSON.stringify(question.start); this.settled = head; this.orbit = head.attractor ? head : null;
    if (head.attractor) showOrbit(this.about, head, `${head.attractor.name}${stability(head.attractor.stable) ? `, ${stability(head.attractor.stable)}` : ""}`); else clearOrbit(this.settledText(head));
    this.phase.over(head.attractor && arrays[`sample:${this.view.phase[0]}`] ? motionOf(head, arrays) : null);
    $("motion-what").textContent = this.motionText(); this.status.say(this.settledText(head)); this.marks();
  }
  private heardTrack(head: Head, arrays: Arrays): void {
    if (head.lost) {
      clearOrbit(`lost: ${head.lost}`); this.phase.over(null);
      if (this.view.orbit) { this.orbit = null; this.go({ orbit: null }, { past: true }); this.says.say(`The orbit was lost: ${head.lost}. The motion from the start is shown.`); }
      return this.marks();
    }
    this.orbit = head; this.settled = null;
    showOrbit(this.about, head, `${head.name ?? "orbit"}${stability(head.stable) ? `, ${stability(head.stable)}` : ""}`);
    if (this.view.orbit) { this.view.orbit = { track: { point: Object.values(head.start), period: head.periods || 1, source: head.values } }; this.showMotion(head, arrays); } else this.phase.over(motionOf(head, arrays));
    this.marks();
  }
  private heardOrbit(head: Head, arrays: Arrays, question: Question): void {
    if (!this.view.orbit) return;
    this.orbit = head; this.settled = null; this.settledFrom = ""; this.phase.over(null);
    showOrbit(this.about, head, `${head.name ?? "orbit"}${stability(head.stable) ? `, ${stability(head.stable)}` : ""}`); this.showMotion(head, arrays);
    if (question.responses !== undefined) this.go({ values: this.known(head.values), start: this.beginning(head, arrays) }, { shown: true });
    this.status.say($("motion-what").textContent!);
  }
  private heardResponses(head: Head, arrays: Arrays): void {
    this.responses.show(head, arrays); notes($("responses-words"), head.words);
    if (JSON.stringify(head.range) !== JSON.stringify(this.view.range) || head.quantity !== this.view.quantity) this.go({ range: head.range, quantity: head.quantity }, { shown: true });
    $("responses-under").textContent = head.done === false ? `followed to ${Math.round(100 * (head.share ?? 0))} %` : "click a point: that orbit. Solid: stable; dashed: unstable";
    if ($("responses-table").getAttribute("aria-pressed") === "true") this.responses.table($("points").querySelector("thead")!, $("points").querySelector("tbody")!, ALL_POINTS);
    this.marks();
  }
  private heardMap(head: Head, arrays: Arrays): void {
    const sheet = this.maps.get(head.id);
    if (!sheet || head.kind === "map-stopped") return;
    if (head.attractors) { sheet.attractors = head.attractors; sheet.dirty = true; }
    if (head.kind === "map-piece") { sheet.piece(head.level, arrays); sheet.known = head.known; sheet.of = head.of; }
    if (head.fractions) {
      const by = new Map<number, any>(head.fractions.map((f: any) => [f.key, f])); sheet.level = head.level;
      sheet.attractors = sheet.attractors.map(one => ({ ...one, ...(by.get(one.key) ?? {}) })); sheet.dirty = true;
    }
    if (head.kind === "map-end") {
      sheet.done = !head.coarse; sheet.took = (performance.now() - this.begun) / 1000;
      if (head.flip_rate != null) sheet.flip = `${digits(100 * head.flip_rate, 2)} % of the starts lead elsewhere when computed more exactly`;
      sheet.words = head.words ?? [];
    }
    if (sheet !== this.map.sheet) return;
    if (head.kind !== "map-piece") this.legend();
    this.map.draw(); this.status.say(this.mapText());
  }
  private mapText(): string {
    const s = this.map.sheet, grouped = (n: number) => String(n).replace(/\B(?=(\d{3})+$)/g, " ");
    if (!s) return "";
    if (s.done) return `${grouped(s.of)} starts, all known`;
    return `${grouped(s.known)} of ${grouped(s.of)} starts, ${((performance.now() - this.begun) / 1000).toFixed(1)} s`;
  }
  private legend(): void {
    const s = this.map.sheet, present = s ? new Set(s.label) : new Set<number>();
    const codes = Object.entries(this.about.codes).filter(([code]) => present.has(+code)).map(([code, name]) => [name, this.about.code_colors[code] ?? [120, 120, 120], ""] as [string, number[], string]);
    if (s && !s.known && !s.attractors.length) return;                    // the one before stays, dim, until there is another
    showLegend(this.about, s?.attractors ?? [], codes, this.view.history, this.map.only, key => this.attractor(key));
    notes($("map-words"), s?.words); this.map.tell();
    this.map.label(`basins of ${plain(this.view.axes[0])} and ${plain(this.view.axes[1])}, ${s?.attractors.length ?? 0} attractors; arrows move the start, shift and arrows the view, plus and minus zoom, Enter settles; the table of attractors follows`);
  }
  private hover(where: Place | null, at: [number, number] | null, sheet: Sheet | null): void {
    const [a, b] = this.view.axes, say = (p: [number, number]) => `${plain(a)} = ${spoken(p[0], unitOf(this.about, a), 5)}, ${plain(b)} = ${spoken(p[1], unitOf(this.about, b), 5)}`;
    if (!at) { const s = this.map.sheet; $("map-under").textContent = s?.flip || (s?.level && s.level > 1 ? `shares of the starts in every ${ORDINAL[s.level] ?? `${s.level}th`} row and column` : "click: a start; drag: the view; wheel: closer"); return; }
    if (!where || !sheet) { $("map-under").textContent = `${say(at)}: not known yet`; return; }
    const one = sheet.attractors.find((o: Attractor) => o.key === where.label), what = one ? one.name : this.about.codes[String(where.label)] ?? "";
    const when = one && where.age < 255 ? `, settles within ${2 ** where.age} ${this.about.forced ? "periods" : "turns"}` : "";
    $("map-under").textContent = `${say(where.at)}: ${what}${when}${where.stride > 1 ? " (one start for the whole block)" : ""}`;
  }
}
const ORDINAL: Record<number, string> = { 2: "second", 4: "fourth", 8: "eighth" };
const about_ = (about: About): string => about.system!.name.replace(/\s*\(.*/, "");
