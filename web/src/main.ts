/** Opens the line, then the page of a system, or the list of models. */
import type { About } from "./about";
import { Explorer } from "./explorer";
import { type Arrays, type Head, Link, type Question } from "./link";
import { $, element, Says, Status } from "./words";

/** The token goes from the address into the tab; a frame of another origin (a notebook) may be denied storage by an exception. */
function tokenOf(given: string | null): string {
  try {
    if (given) sessionStorage.setItem("saltus-token", given);
    return given ?? sessionStorage.getItem("saltus-token") ?? "";
  } catch {
    return given ?? "";
  }
}
const parts = new URLSearchParams(location.hash.slice(1)),
  token = tokenOf(parts.get("token")),
  rawView = /(?:^#|&)view=([^&]*)/.exec(location.hash)?.[1] ?? null;
history.replaceState(history.state, "", rawView === null ? location.pathname : `#view=${rawView}`);

const status = new Status($("status")),
  says = new Says($("says"));
let explorer: Explorer | null = null,
  lost = false,
  view = rawView;

const link = new Link(token, {
  ready(first, again) {
    if (!first && again) says.say("saltus was started again: everything is asked anew.");
    if (explorer && !again) {
      explorer.asks.askAll();
      return;
    }
    view = /#view=([^&]*)/.exec(location.hash)?.[1] ?? view;
    link.ask("about");
  },
  line(text, final) {
    lost = text !== "";
    document.body.classList.toggle("lost", lost);
    if (lost) {
      status.say(final ? "no line" : "line lost");
      says.say(text);
    } else {
      says.clear();
      status.say("connected");
    }
  },
  hear(head: Head, arrays: Arrays, question: Question) {
    if (head.kind === "about") return begin(head as About);
    if (head.kind === "reload")
      return says.say(String(head.why ?? "This page is of another version of saltus: reload it."));
    if (head.kind === "dropped") return;
    if (explorer) return explorer.answers.hear(head, arrays, question);
    if (head.kind === "refused" || head.kind === "failed") says.say(String(head.why));
    else if (head.kind === "waits") status.say((head.words ?? []).join(" "));
  },
});

function begin(about: About): void {
  $("models").hidden = about.system !== null;
  $("main").hidden = about.system === null;
  for (const part of $("top").querySelectorAll<HTMLElement>(".choice, .tools")) part.hidden = about.system === null;
  if (!about.system) {
    status.say("choose a system");
    $("models")
      .querySelector("ul")!
      .replaceChildren(
        ...(about.models ?? []).map(model => {
          const item = element("li"),
            button = element("button", model.name);
          button.type = "button";
          button.append(element("small", model.words));
          button.onclick = () => {
            link.ask("open", { model: model.name });
            status.say(`opening ${model.name}`);
          };
          item.append(button);
          return item;
        }),
      );
    return;
  }
  explorer = new Explorer(about, link, status, says, view);
  explorer.token = () => token;
  Object.assign(window, { explorer });
}

// -- panels and keys ------------------------------------------------------------------------------------------------------------
function large(panel: Element): void {
  const main = $("main"),
    on = !panel.classList.contains("whole");
  for (const other of document.querySelectorAll(".whole")) other.classList.remove("whole");
  panel.classList.toggle("whole", on);
  main.classList.toggle("one", on);
  for (const button of document.querySelectorAll(".panel .large")) say(button as HTMLElement);
}
function say(button: HTMLElement): void {
  const on = button.closest(".panel")!.classList.contains("whole"),
    name = button.closest(".panel")!.querySelector("h2")!.textContent!;
  button.textContent = on ? "⤡" : "⤢";
  button.title = on ? "as before (f)" : "large (f)";
  button.setAttribute("aria-label", on ? `${name} as before` : `${name} large`);
}
for (const button of document.querySelectorAll<HTMLElement>(".panel .large")) {
  say(button);
  button.onclick = () => large(button.closest(".panel")!);
}
for (const title of document.querySelectorAll<HTMLElement>(".panel > header"))
  title.ondblclick = e => {
    if (!(e.target as HTMLElement).closest(".tools")) large(title.closest(".panel")!);
  };
$("keys-open").onclick = () => $<HTMLDialogElement>("keys").showModal();
addEventListener("keydown", e => {
  const at = e.target as HTMLElement,
    typing = at.matches("input:not([type=range]), select, textarea"),
    key = e.key.toLowerCase();
  if ((e.ctrlKey || e.metaKey) && key === "z" && !typing) {
    e.preventDefault();
    if (e.shiftKey) explorer?.forth();
    else explorer?.back();
    return;
  }
  if ((e.ctrlKey || e.metaKey) && key === "y" && !typing) {
    e.preventDefault();
    explorer?.forth();
    return;
  }
  if (e.ctrlKey || e.metaKey || e.altKey || typing || document.querySelector("dialog[open]")) return;
  if (e.key === "Escape") explorer?.stop();
  else if (key === "f") {
    const panel = at.closest(".panel") ?? document.querySelector(".whole") ?? $("map");
    large(panel);
  } else if (e.key === "?") $<HTMLDialogElement>("keys").showModal();
  else if (key === "s" && explorer) {
    e.preventDefault();
    explorer.openSave();
  } else if (key === "t" && at.closest("#responses")) explorer?.table();
});
document.addEventListener("visibilitychange", () => link.tell("pause", { on: document.hidden }));
