/** The sheet that saves what is seen: a study, a script, a picture, data. */
import type { Arrays, Head, Question } from "./link";
import { element } from "./words";

const KINDS: [string, string, string[]][] = [
  ["study", "study: runs again with saltus run", ["toml"]],
  ["script", "script: the same as calls of saltus", ["py"]],
  ["picture", "picture: drawn by sl.plot", ["png", "svg", "pdf"]],
  ["data", "data: numbers with their units", ["nc", "csv", "mat"]],
];
const PARTS: [string, string][] = [
  ["motion", "motion, contacts"],
  ["map", "map"],
  ["agreement", "differences of both methods"],
  ["responses", "responses"],
];

export class SaveSheet {
  private note = element("p", "", "note");
  private words = element("p", "", "under");
  constructor(
    private dialog: HTMLDialogElement,
    private ask: (fields: Question) => void,
    private address: () => string,
    private known: () => string,
    private compares: () => boolean,
  ) {}

  open(name: string): void {
    const title = element("h2", "Save what I see"),
      form = element("form");
    title.id = "save-title";
    form.method = "dialog";
    const kinds = element("fieldset"),
      parts = element("fieldset"),
      format = element("select"),
      file = element("input");
    kinds.append(element("legend", "as"));
    parts.append(element("legend", "of"));
    format.setAttribute("aria-label", "format");
    file.type = "text";
    file.value = name;
    file.autocomplete = "off";
    const chosen = () => (form.elements.namedItem("kind") as RadioNodeList).value,
      row = (...all: (Node | string)[]) => {
        const at = element("div", "", "row");
        at.append(...all);
        return at;
      };
    for (const [value, text] of KINDS) {
      const label = element("label"),
        radio = element("input");
      Object.assign(radio, { type: "radio", name: "kind", value, checked: value === "study" });
      label.append(radio, text);
      kinds.append(row(label));
    }
    for (const [value, text] of PARTS) {
      if (value === "agreement" && !this.compares()) continue;
      const label = element("label"),
        box = element("input");
      Object.assign(box, { type: "checkbox", name: "part", value, checked: value === "motion" || value === "map" });
      label.append(box, text);
      parts.append(label);
    }
    const known = element("p", this.known(), "under");
    const label = element("label"),
      download = element("button", "download"),
      copy = element("button", "copy the address of this view"),
      close = element("button", "close");
    label.append("name ", file);
    download.type = copy.type = "button";
    download.id = "save-download";
    close.value = "close";
    const fit = () => {
      const [, , formats] = KINDS.find(k => k[0] === chosen())!,
        boxes = [...form.querySelectorAll<HTMLInputElement>("[name=part]")],
        single = chosen() === "picture";
      format.replaceChildren(...formats.map(f => element("option", f)));
      for (const box of boxes) box.type = single ? "radio" : "checkbox";
      if (single && boxes.filter(b => b.checked).length !== 1) boxes.forEach(b => (b.checked = b.value === "map"));
    };
    const send = () => {
      const asked = [...form.querySelectorAll<HTMLInputElement>("[name=part]:checked")].map(b => b.value);
      this.note.textContent = "";
      this.words.textContent = "being made";
      this.ask({ what: chosen(), format: format.value, name: file.value.trim(), parts: asked });
    };
    kinds.onchange = fit;
    download.onclick = send;
    form.onkeydown = e => {
      if (e.key === "Enter" && e.target !== close && e.target !== copy) {
        e.preventDefault();
        send();
      }
    };
    copy.onclick = async () => {
      try {
        await navigator.clipboard.writeText(this.address());
        this.words.textContent = "copied: it opens this view on this machine while this server runs";
      } catch {
        this.words.textContent = this.address();
      }
    };
    const end = element("div", "", "end");
    end.append(download, copy, close);
    this.note.textContent = this.words.textContent = "";
    form.append(kinds, parts, known, row(label, " format ", format), this.note, this.words, end);
    this.dialog.replaceChildren(title, form);
    fit();
    this.dialog.showModal();
    file.focus();
    file.select();
  }
  /** The desk's file becomes a download. */
  take(head: Head, arrays: Arrays): void {
    const link = element("a");
    link.href = URL.createObjectURL(new Blob([arrays.file as Uint8Array<ArrayBuffer>], { type: head.media }));
    link.download = head.name;
    link.click();
    setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
    this.words.textContent = [`${head.name} was given to the browser.`, ...(head.words ?? [])].join(" ");
  }
  refuse(why: string): void {
    this.note.textContent = why;
    this.words.textContent = "";
  }
  get shown(): boolean {
    return this.dialog.open;
  }
}
