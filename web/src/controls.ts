/** The controls of the page and what each does. */
import { plain } from "./about";
import type { Explorer } from "./explorer";
import { startOf } from "./state";
import { $, options } from "./words";

const SIZES = [50, 100, 160, 250, 400, 700, 1000];

/** What each control of the page does. */
export function connect(explorer: Explorer): void {
  const { about } = explorer,
    names = about.quantities.map(q => [q.name, plain(q.name)] as [string, string]),
    on = (id: string, what: (value: string) => void) => {
      $<HTMLSelectElement>(id).onchange = e => what((e.target as HTMLSelectElement).value);
    };
  options(
    $("method"),
    about.methods.map(m => [m, m]),
    explorer.view.method,
  );
  on("method", method => explorer.go({ method }));
  options($("against"), [["", "nothing"], ...about.methods.map(m => [m, m] as [string, string])], "");
  on("against", against => explorer.go({ against }));
  for (const [id, i] of [
    ["map-first", 0],
    ["map-second", 1],
  ] as const) {
    options(
      $(id),
      about.choices.map(name => [name, plain(name)]),
      explorer.view.axes[i],
    );
    $(id).hidden = about.choices.length < 3;
    on(id, name => {
      explorer.axis(i, name);
    });
  }
  const sizes = new Map(
    [...SIZES.map(n => [n, n]), about.size, explorer.view.size]
      .sort((p, q) => p[0] * p[1] - q[0] * q[1])
      .map(([n, m]) => [`${n},${m}`, `${n} × ${m}`]),
  );
  options($("map-size"), [...sizes], String(explorer.view.size));
  on("map-size", n => explorer.go({ size: n.split(",").map(Number) as [number, number] }));
  for (const id of ["history-of", "phase-first", "phase-second", "quantity"]) options($(id), names, "");
  $("history-of").hidden = names.length < 2;
  on("history-of", history => explorer.go({ history }));
  on("phase-first", name => explorer.go({ phase: [name, explorer.view.phase[1]] }));
  on("phase-second", name => explorer.go({ phase: [explorer.view.phase[0], name] }));
  options(
    $("over"),
    about.parameters.map(p => [p.name, plain(p.name)]),
    "",
  );
  on("over", over => {
    const p = about.parameters.find(q => q.name === over)!;
    explorer.go({ over, range: [p.low, p.high] });
  });
  on("quantity", quantity => explorer.go({ quantity }));
  for (const [id, i] of [
    ["range-low", 0],
    ["range-high", 1],
  ] as const)
    $<HTMLInputElement>(id).onchange = e => explorer.range.type(i, (e.target as HTMLInputElement).value);
  $("responses").hidden = !about.parameters.length;
  $("periods").previousElementSibling!.textContent = about.forced ? "periods shown" : "turns shown";
  $<HTMLInputElement>("periods").onchange = e => {
    const n = +(e.target as HTMLInputElement).value,
      fine = Number.isInteger(n) && n >= 1 && n <= 100_000;
    $("periods-note").textContent = fine ? "" : "a whole number from 1 to 100 000";
    if (fine) explorer.go({ periods: n });
  };
  $<HTMLInputElement>("hold").onchange = e => {
    const held = (e.target as HTMLInputElement).checked;
    explorer.history.hold(held);
    explorer.phase.hold(held);
  };
  const click = (id: string, what: () => void) => {
    $(id).onclick = what;
  };
  click("map-in", () => explorer.map.zoom(0.7));
  click("map-out", () => explorer.map.zoom(1 / 0.7));
  click("map-differ", () => explorer.go({ differ: !explorer.view.differ }));
  click("map-whole", () => explorer.map.showWhole());
  click("undo", () => explorer.back());
  click("redo", () => explorer.forth());
  click("orbit-leave", () => explorer.leaveOrbit());
  click("reset", () => {
    explorer.values.forget();
    explorer.go({
      values: { ...explorer.first.values },
      start: startOf(explorer.about, explorer.view.axes, explorer.first.start),
      orbit: null,
    });
  });
  click("save-open", () => explorer.openSave());
  click("responses-table", () => explorer.table());
  click("responses-log", () => explorer.responses.toggle());
}
