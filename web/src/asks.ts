/** What the page asks of the desk for the view that is looked at. */
import { isOutput, states } from "./about";
import type { Explorer } from "./explorer";
import type { Question } from "./link";
import { FOLLOWED } from "./responses";
import { Agreement, Sheet } from "./sheets";

/** Milliseconds of rest before a start is settled; between two coarse maps of a drag, and at most if the first has no
 *  cell yet: were it stopped again and again, none would come. */
export const SETTLE = 300;
const COARSE = 250,
  SLOW = 1000;
/** Milliseconds of the desk's work from which a motion is shown before its errors are measured, once the start rests. */
const DEAR = 10;

export class Asks {
  constructor(private of: Explorer) {}

  changed(): Record<string, number> {
    return Object.fromEntries(
      this.of.about.parameters
        .filter(p => this.of.view.values[p.name] !== p.value)
        .map(p => [p.name, this.of.view.values[p.name]]),
    );
  }
  motionFields(): Question {
    const v = this.of.view,
      fields: Question = {
        start: v.start,
        values: this.changed(),
        periods: v.periods,
        method: v.method,
        quantities: [...new Set([v.history, ...v.phase, ...(isOutput(this.of.about, v.axes[0]) ? v.axes : [])])],
      };
    if (v.against) fields.against = v.against;
    return fields;
  }
  mapFields(): Question {
    const v = this.of.view,
      [a, b, c, d] = v.box,
      at = Object.fromEntries(Object.entries(v.start).filter(([name]) => !v.axes.includes(name)));
    return {
      axes: { [v.axes[0]]: [a, b], [v.axes[1]]: [c, d] },
      size: v.size,
      values: this.changed(),
      at,
      method: v.method,
      ...this.of.about.view.map,
    };
  }
  responseFields(): Question {
    const v = this.of.view;
    return { values: this.changed(), parameter: v.over, range: v.range, quantity: v.quantity };
  }
  shownView(): Question {
    return {
      motion: this.motionFields(),
      map: this.mapFields(),
      ...(this.of.view.against ? { agreement: { ...this.mapFields(), against: this.of.view.against } } : {}),
      ...(this.of.view.over ? { responses: this.responseFields() } : {}),
    };
  }

  askAll(): void {
    this.askMotion();
    this.askMap();
    this.askedValues = "";
    this.askResponses();
    this.of.later("settle", SETTLE, () => this.settleNow());
  }
  askMotion(): void {
    const orbit = this.of.view.orbit,
      dear = (this.of.motion?.head.ms ?? 0) > DEAR;
    this.of.later("errors", SETTLE, () => this.withErrors(), orbit !== null || this.of.dragging || !dear);
    if (!orbit) {
      if (dear || this.of.dragging) this.of.link.newest("motion", { ...this.motionFields(), errors: "local" });
      else this.withErrors();
    } else if (orbit.track) this.of.link.newest("track", { ...(orbit.track as Question), values: this.of.view.values });
    else this.of.link.newest("orbit", { ...orbit, values: this.of.view.values });
  }
  /** The motion, with the errors of its contacts measured: the desk runs it twice. */
  withErrors(): void {
    this.of.link.newest("motion", { ...this.motionFields(), errors: "measured" });
  }
  settleNow(): void {
    if (!this.of.view.orbit)
      this.of.link.newest("settle", { start: this.of.view.start, values: this.changed(), method: this.of.view.method });
  }
  /** The known orbit follows the values by Newton's method. */
  track(): void {
    const known = this.of.orbit,
      point = known?.start ?? known?.attractor?.points?.[0];
    if (!known || !point || (!known.periods && !known.attractor)) {
      if (this.of.view.orbit) {
        this.of.view.orbit = null;
        this.askMotion();
      }
      return;
    }
    const period = known.attractor?.period || known.periods || 1;
    if (period > 64) return;
    this.of.link.newest("track", {
      values: this.of.view.values,
      source: known.values,
      point: Array.isArray(point) ? point : states(this.of.about).map(name => point[name]),
      period,
    });
  }
  askedValues = "";
  askResponses(): void {
    if (!this.of.view.over) return;
    const fields = this.responseFields(),
      { [this.of.view.over]: _, ...others } = fields.values as Record<string, number>,
      key = JSON.stringify({ ...fields, values: others });
    if (key === this.askedValues) return;
    this.askedValues = key;
    this.of.responses.without = FOLLOWED;
    this.of.link.ask("responses", fields);
  }
  mapKey(fields: Question): string {
    return JSON.stringify({ ...fields, values: this.of.view.values });
  }
  pickSheet(): void {
    const sheet = this.of.map.sheets.get(this.mapKey(this.mapFields()));
    if (sheet) {
      this.of.map.sheet = sheet;
      this.of.answers.legend();
      this.of.map.draw();
    }
  }
  askCoarse(): void {
    this.pickSheet();
    const sheet = this.of.map.sheet,
      wait = this.of.coarse + (sheet && !sheet.known && !sheet.open ? SLOW : COARSE) - performance.now();
    if (wait <= 0) {
      this.of.coarse = performance.now();
      this.askMap(true);
    } else
      this.of.later("map", wait, () => {
        this.of.coarse = performance.now();
        this.askMap(this.of.dragging);
      });
  }
  askMap(coarse = false): void {
    clearTimeout(this.of.timers.map);
    delete this.of.timers.map;
    const fields = this.mapFields(),
      key = this.mapKey(fields),
      v = this.of.view,
      { axes, size, values, ...plane } = fields;
    let sheet = this.of.map.sheets.get(key);
    if (this.of.map.sheet && this.of.map.sheet !== sheet && !this.of.map.sheet.known)
      this.of.map.sheets.drop(this.of.map.sheet);
    if (!sheet)
      this.of.map.sheets.add(
        (sheet = new Sheet(key, { ...v.values }, JSON.stringify([v.axes, plane]), [...v.box], ...v.size)),
      );
    this.of.map.sheet = sheet;
    this.of.map.draw();
    this.of.answers.legend();
    if (sheet.done) {
      this.of.link.tell("stop", { of: "map" });
      this.of.status.say(this.of.answers.mapText());
      return this.askAgreement();
    }
    this.of.begun = performance.now();
    this.of.status.say(this.of.answers.mapText());
    const id = this.of.link.ask("map", coarse ? { ...fields, coarse } : fields);
    if (id >= 0) {
      this.of.maps.clear();
      this.of.maps.set(id, sheet);
    }
  }
  /** Of a map that is finished: where a second method leads elsewhere. */
  askAgreement(): void {
    const sheet = this.of.map.sheet,
      against = this.of.view.against;
    if (this.of.agreeing) this.of.link.tell("stop", { of: "map" });
    this.of.agreeing = null;
    if (!against || !sheet?.done || (sheet.agreement?.against === against && sheet.agreement.done)) return this.of.answers.legend();
    sheet.agreement = new Agreement(against, sheet);
    const id = this.of.link.ask("agreement", { ...this.mapFields(), against });
    if (id >= 0) this.of.agreeing = { id, sheet };
  }
}
