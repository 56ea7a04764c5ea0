/** The page of one system: what is looked at, what is asked for it, and where the answers go. */
import { type About, coordinates, isOutput, plain, states } from "./about";
import { onTheme, type Range, spoken } from "./axes";
import { ALL_POINTS, Answers } from "./answers";
import { Contacts } from "./contacts";
import { Asks, SETTLE } from "./asks";
import { connect } from "./controls";
import { History } from "./history";
import type { Arrays, Head, Link } from "./link";
import { BasinMap } from "./map";
import type { Motion } from "./motion";
import { Phase } from "./phase";
import { RangeFields } from "./range";
import { Responses } from "./responses";
import { SaveSheet } from "./save";
import { Sheet } from "./sheets";
import { type Box, firstView, fromAddress, snapped, startOf, toAddress, Undo, type View } from "./state";
import { Values } from "./values";
import { $, differing, marked, only, type Says, type Status } from "./words";

/** drag: the finger is down; past: from the list of undo; shown: the motion and the curves are of it already; half: its values are still to come. */
interface Change {
  drag?: boolean;
  past?: boolean;
  shown?: boolean;
  half?: boolean;
}
/** Milliseconds of rest before a map of another view is asked, before a view is kept for undo, before the desk is told of it. */
const REST = 150,
  KEEP = 400,
  TELL = 1000;
/** Milliseconds without an answer after which what follows a slider is dimmed. */
const LATE = 250;

export class Explorer {
  view: View;
  readonly first: View;
  map: BasinMap;
  history: History;
  phase: Phase;
  responses: Responses;
  values: Values;
  contacts: Contacts;
  readonly save: SaveSheet;
  readonly asks = new Asks(this);
  readonly answers = new Answers(this);
  readonly range = new RangeFields(this);
  motion: Motion | null = null;
  maps = new Map<number, Sheet>();
  agreeing: { id: number; sheet: Sheet } | null = null;
  undo: Undo;
  orbit: Head | null = null;
  settled: Head | null = null;
  timers: Record<string, number> = {};
  kept = "";
  keptView: View;
  moves = false;
  slid = "";
  dragging = false;
  dragged = "";
  heard = 0;
  settledFrom = "";
  coarse = 0;
  begun = 0;
  typed: { key: string; text: string; id: number } | null = null;
  whole: Box;

  constructor(
    readonly about: About,
    readonly link: Link,
    readonly status: Status,
    readonly says: Says,
    address: string | null,
  ) {
    this.first = firstView(about);
    const opened =
      address === null
        ? { view: structuredClone(this.first), damaged: false }
        : fromAddress(address, this.first, about);
    this.view = opened.view;
    this.whole = [...this.first.box];
    if (opened.damaged)
      says.say("The address of the view is damaged: what could be read of it is shown, the rest is as at first.");
    $("system").textContent = about.system!.name;
    $("system").title = about.system!.description;
    document.title = `${about.system!.name} - saltus explorer`;
    this.values = new Values(about, {
      slide: (name, value, done) => this.slide(name, value, done),
      type: (group, name, text) => this.type(group, name, text),
    });
    this.map = new BasinMap($("map-canvas"), about, {
      start: (at, done) =>
        this.go(
          { start: { ...this.view.start, [this.view.axes[0]]: at[0], [this.view.axes[1]]: at[1] }, orbit: null },
          { drag: !done },
        ),
      view: (box, done) => this.go({ box: done ? snapped(box, this.view) : box }, { drag: !done }),
      hover: (where, at, sheet) => this.answers.hover(where, at, sheet),
      settle: () => this.asks.settleNow(),
    });
    this.map.painted = () => this.marks();
    this.history = new History($("history"), about, text => {
      $("motion-what").textContent = text || this.answers.motionText();
    });
    this.phase = new Phase($("phase-canvas"), $("phase-under"), about);
    this.responses = new Responses($("responses-canvas"), about, {
      orbit: choice => this.orbitOf(choice),
      hover: text => {
        $("responses-under").textContent = text;
      },
    });
    this.contacts = new Contacts(about, i => {
      this.history.choose(i);
      this.phase.choose(i);
    });
    this.save = new SaveSheet(
      $("save"),
      fields => this.link.ask("save", { ...fields, view: this.asks.shownView() }),
      () => this.address(),
      () => this.answers.mapText(),
      () => this.view.against !== "",
    );
    this.undo = new Undo(
      view => this.go(view, { past: true }),
      (undo, redo) => {
        $<HTMLButtonElement>("undo").disabled = !undo;
        $<HTMLButtonElement>("redo").disabled = !redo;
      },
    );
    connect(this);
    onTheme(() => {
      this.history.draw();
      this.phase.draw();
      this.responses.draw();
      this.map.draw();
    });
    this.show();
    this.kept = toAddress(this.view, this.first);
    this.keptView = this.view;
    this.asks.askAll();
    this.keep();
    setInterval(() => this.answers.tick(), 1000);
  }

  // -- what is looked at ------------------------------------------------------------------------------------------------------
  /** Look at something else: ask what it needs, and keep it for undo once it rests. */
  go(change: Partial<View>, { drag = false, past = false, shown = false, half = false }: Change = {}): void {
    const before = this.view,
      next = (this.view = { ...before, ...structuredClone(change) });
    const other = (...keys: (keyof View)[]) => keys.some(k => JSON.stringify(before[k]) !== JSON.stringify(next[k])),
      released = this.dragging && !drag;
    this.dragging = drag;
    if (other("start", "values", "method")) this.settled = null;
    if (other("start")) this.phase.over(null);
    if (other("orbit") && next.orbit === null) this.responses.unchoose();
    if (past && other("axes")) this.whole = this.wholeOf(next.axes);
    this.show();
    const values = other("values");
    if (!shown)
      this.askMotions(
        values || released,
        other("values", "start", "periods", "method", "against", "orbit", "history", "phase") || released,
        other("start", "method") || released,
        past || other("orbit"),
      );
    const others = states(this.about).some(
      name => !next.axes.includes(name) && before.start[name] !== next.start[name],
    );
    if (other("history")) this.answers.legend();
    if (values && drag) this.asks.askCoarse();
    else if (values || other("method", "size", "axes") || others) this.asks.askMap();
    else if (other("box")) {
      this.asks.pickSheet();
      this.later("map", REST, () => this.asks.askMap());
    } else if (released) this.asks.askMap();
    else if (other("against")) this.asks.askAgreement();
    const apart = Object.keys(next.values).some(
      name => name !== next.over && next.values[name] !== before.values[name],
    );
    if (!drag && !shown && (apart || other("over", "range", "quantity") || released)) this.asks.askResponses();
    if (!past) this.later("keep", KEEP, () => this.keep(), drag || half);
    else {
      this.later("keep", 0, () => {}, true);
      this.kept = toAddress(next, this.first);
      this.keptView = next;
      this.moves = false;
    }
  }
  askMotions(values: boolean, motion: boolean, start: boolean, orbit: boolean): void {
    if (values && this.view.orbit && !orbit) return this.asks.track();
    if (motion) this.asks.askMotion();
    if (this.view.orbit) return;
    if (values) this.asks.track();
    if (values || start) this.later("settle", SETTLE, () => this.asks.settleNow(), this.dragging);
  }
  later(name: string, wait: number, what: () => void, hold = false): void {
    clearTimeout(this.timers[name]);
    delete this.timers[name];
    if (!hold)
      this.timers[name] = window.setTimeout(() => {
        delete this.timers[name];
        what();
      }, wait);
  }
  /** True if all that was asked is answered, and nothing is going to be. */
  get rests(): boolean {
    return this.link.quiet && Object.keys(this.timers).every(name => name === "told") && this.motion !== null;
  }
  /** Keep the view for undo; moves of the map one after the other are one step. */
  keep(): void {
    const address = toAddress(this.view, this.first),
      moved = JSON.stringify({ ...this.keptView, box: this.view.box }) === JSON.stringify(this.view);
    if (address !== this.kept && !(moved && this.moves)) this.undo.push(this.view, address);
    else this.undo.replace(this.view, address);
    if (address !== this.kept) this.moves = moved;
    this.kept = address;
    this.keptView = this.view;
    this.later("told", TELL, () => this.link.tell("show", { view: this.asks.shownView() }));
  }
  address(): string {
    return `${location.origin}/#token=${this.token()}&view=${toAddress(this.view, this.first)}`;
  }
  token: () => string = () => "";

  show(): void {
    const v = this.view;
    this.values.show(v.values, v.start);
    this.map.at = [v.start[v.axes[0]], v.start[v.axes[1]]];
    this.map.look(v.axes, v.box, this.whole);
    this.map.against = v.differ ? v.against : "";
    $("map-differ").hidden = v.against === "";
    $("map-differ").setAttribute("aria-pressed", String(v.differ));
    const only = (v.orbit?.attractor as number | undefined) ?? null;
    if (only !== this.map.only) {
      this.map.only = only;
      this.map.recolour();
      this.answers.legend();
    }
    for (const [id, value] of [
      ["method", v.method],
      ["against", v.against],
      ["map-first", v.axes[0]],
      ["map-second", v.axes[1]],
      ["map-size", String(v.size)],
      ["history-of", v.history],
      ["phase-first", v.phase[0]],
      ["phase-second", v.phase[1]],
      ["over", v.over],
      ["quantity", v.quantity],
    ] as const)
      $<HTMLSelectElement>(id).value = value;
    this.range.show();
    if (document.activeElement?.id !== "periods") $<HTMLInputElement>("periods").value = String(v.periods);
    this.responses.now = v.values[v.over];
    this.responses.draw();
    $("orbit-leave").hidden = v.orbit === null;
    this.marks();
  }

  /** Rule one: every panel says of which values it is. */
  marks(): void {
    const { about, view } = this,
      now = view.values;
    for (const [panel, head] of [
      ["motion", this.motion?.head],
      ["phase", this.motion?.head],
      ["orbit", this.orbit],
    ] as const) {
      const apart = differing(about, head?.values, now),
        follows = this.dragging && this.dragged !== "" && head != null;
      if (
        panel === "orbit" &&
        apart === "" &&
        this.settledFrom !== "" &&
        this.settledFrom !== JSON.stringify(this.view.start)
      ) {
        marked(panel, "of the start before");
        continue;
      }
      if (follows)
        marked(panel, only(about, this.dragged, head.values), apart !== "" && performance.now() - this.heard > LATE);
      else marked(panel, apart);
    }
    marked(
      "responses",
      this.responses.head ? differing(about, this.responses.head.values, now, [this.responses.head.parameter]) : "",
    );
    const under = this.map.under,
      of = under ? differing(about, under.values, now) : "";
    $("map-of").textContent = of ? `pale: ${of}` : this.map.paler ? "pale: cells of another view" : "";
    $("map").classList.toggle("stale", of !== "");
  }

  // -- what the user does -------------------------------------------------------------------------------------------------------
  slide(name: string, value: number, done: boolean): void {
    this.values.refuse(`values.${name}`, "");
    this.dragged = this.slid = name;
    this.settled = null;
    this.status.say(`${plain(name)} ${spoken(value, this.about.parameters.find(p => p.name === name)!.unit, 5)}`);
    this.go({ values: { ...this.view.values, [name]: value } }, { drag: !done });
    if (done) {
      this.dragged = "";
      this.marks();
    }
  }
  type(group: "values" | "start", name: string, text: string): void {
    const fields = this.asks.motionFields(),
      id = this.link.ask("motion", { ...fields, [group]: { ...(fields[group] as object), [name]: text } });
    this.typed = { key: `${group}.${name}`, text, id };
  }
  orbitOf(choice: { point?: number; event?: number }): void {
    const key = this.responses.head?.key;
    if (key !== undefined) this.go({ orbit: { responses: key, ...choice } }, { half: true });
  }
  attractor(key: number): void {
    this.go({ orbit: this.view.orbit?.attractor === key ? null : { attractor: key } });
  }
  leaveOrbit(): void {
    this.go({ orbit: null });
    this.status.say("the motion from the start");
  }
  stop(): void {
    for (const name of ["map", "settle"]) {
      clearTimeout(this.timers[name]);
      delete this.timers[name];
    }
    this.link.tell("stop");
    this.asks.askedValues = "";
    this.status.say("stopped");
  }
  back(): void {
    if (this.timers.keep) {
      this.later("keep", 0, () => {}, true);
      this.keep(); // what was changed just now is a step of its own
    }
    this.values.forget();
    this.undo.undo();
  }
  forth(): void {
    this.values.forget();
    this.undo.redo();
  }

  /** Another axis of the map: both are states, or both are sensors. */
  axis(i: 0 | 1, name: string): void {
    const { about, view } = this,
      axes = [...view.axes] as [string, string],
      kind = isOutput(about, name);
    if (axes[1 - i] === name) axes[1 - i] = axes[i];
    axes[i] = name;
    if (isOutput(about, axes[1 - i]) !== kind)
      axes[1 - i] = about.choices.find(other => other !== name && isOutput(about, other) === kind) ?? view.axes[1 - i];
    if (axes[0] === axes[1] || isOutput(about, axes[0]) !== isOutput(about, axes[1])) return this.show();
    this.whole = this.wholeOf(axes);
    this.go({ axes, box: [...this.whole], start: startOf(about, axes, { ...this.motion?.head.start, ...view.start }) });
  }
  /** The start of an answer in the coordinates of the map; sensors to the seven digits of their samples. */
  beginning(head: Head, arrays: Arrays): Record<string, number> {
    const known = (name: string): number =>
      head.start[name] ??
      (arrays[`sample:${name}`] ? +arrays[`sample:${name}`][0].toPrecision(7) : this.view.start[name]);
    return Object.fromEntries(coordinates(this.about, this.view.axes).map(name => [name, known(name)]));
  }
  wholeOf([a, b]: [string, string]): Box {
    const own = (name: string): Range => this.about.axes[name] ?? this.about.ranges?.[name] ?? [-1, 1];
    return [...own(a), ...own(b)];
  }
  openSave(): void {
    this.save.open(
      `${shortName(this.about)}-${Object.entries(this.asks.changed())
        .slice(0, 2)
        .map(([name, v]) => spoken(v, this.about.parameters.find(p => p.name === name)!.unit, 4).replace(/\s/g, ""))
        .join("-")}`
        .replace(/[^\w.-]/g, "")
        .replace(/-$/, ""),
    );
  }
  table(): void {
    const button = $("responses-table"),
      on = button.getAttribute("aria-pressed") !== "true";
    button.setAttribute("aria-pressed", String(on));
    $("points-scroll").hidden = !on;
    $("responses-canvas").hidden = on;
    if (on) this.responses.table($("points").querySelector("thead")!, $("points").querySelector("tbody")!, ALL_POINTS);
  }
}
/** A system's name without what stands in brackets behind it. */
const shortName = (about: About): string => about.system!.name.replace(/\s*\(.*/, "");
