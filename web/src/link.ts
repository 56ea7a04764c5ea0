/** The line to the desk: questions out as JSON, answers in as binary frames that are viewed in place. */

export type Numbers = Float32Array | Float64Array | Uint8Array | Int8Array | Uint16Array | Uint32Array | Int32Array;
export type Arrays = Record<string, Numbers>;
/** What an answer says beside its arrays; each kind of answer has fields of its own. */
export interface Head {
  kind: string;
  ask: string;
  id: number;
  arrays: [string, string, number, number][];
  words?: string[];
  [key: string]: any;
}
export type Question = Record<string, unknown>;
export interface Listener {
  /** An answer; the question that it answers, if this page asked one of that number. */
  hear(head: Head, arrays: Arrays, question: Question): void;
  /** The line is open and the desk known: ask what is to be seen. `again`: another desk than before. */
  ready(first: boolean, again: boolean): void;
  /** The line is lost, or back (empty text). `final`: it won't be tried again. */
  line(text: string, final: boolean): void;
}

const WIRE = 2;
const VIEWS: Record<string, any> = {
  f4: Float32Array,
  f8: Float64Array,
  u1: Uint8Array,
  i1: Int8Array,
  u2: Uint16Array,
  u4: Uint32Array,
  i4: Int32Array,
};
const FIRST_WAIT = 500,
  LONGEST_WAIT = 8000;
/** What a page can't mend by trying again. */
const FINAL: Record<number, string> = {
  4403: "not let in: open the address that saltus explore printed in the terminal, or one that save copied from the page",
  4409: "this page is of another version of saltus: reload it",
  4429: "eight pages are open already: close one and reload",
};

/** The parts of a frame: head and typed views of its arrays. */
export function read(data: ArrayBuffer): [Head, Arrays] {
  const length = new DataView(data).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(new Uint8Array(data, 4, length))) as Head,
    arrays: Arrays = {};
  for (const [name, type, count, at] of head.arrays ?? []) arrays[name] = new VIEWS[type](data, 4 + length + at, count);
  return [head, arrays];
}

export class Link {
  private socket?: WebSocket;
  private id = 0;
  private wait = FIRST_WAIT;
  private timer = 0;
  private desk = "";
  private welcome = false;
  private asked = new Map<number, Question>();
  private since = new Map<number, [string, number]>();
  private flying = new Map<number, string>();
  private waiting = new Map<string, Question>();
  bytes = 0;

  constructor(
    private token: string,
    private listener: Listener,
  ) {
    this.open();
    const now = () => {
      if (this.timer && document.visibilityState === "visible") {
        clearTimeout(this.timer);
        this.open();
      }
    };
    addEventListener("online", now);
    document.addEventListener("visibilitychange", now);
  }

  private open(): void {
    this.timer = 0;
    this.welcome = false;
    const socket = (this.socket = new WebSocket(`ws://${location.host}/socket`));
    socket.binaryType = "arraybuffer";
    socket.onopen = () => {
      this.asked.clear();
      this.since.clear();
      this.flying.clear();
      this.waiting.clear();
      this.ask("hello", { token: this.token, wire: WIRE, desk: this.desk });
    };
    socket.onmessage = event => {
      const data = event.data as ArrayBuffer;
      this.bytes += data.byteLength;
      this.hear(...read(data));
    };
    socket.onclose = event => {
      this.welcome = false;
      if (FINAL[event.code]) return this.listener.line(FINAL[event.code], true);
      this.listener.line(`The line to saltus is lost; trying again in ${this.wait / 1000} s.`, false);
      this.timer = window.setTimeout(() => this.open(), this.wait);
      this.wait = Math.min(2 * this.wait, LONGEST_WAIT);
    };
  }

  private hear(head: Head, arrays: Arrays): void {
    if (head.kind === "hello") {
      const first = !this.desk;
      this.asked.delete(head.id);
      this.since.delete(head.id);
      this.desk = head.desk;
      this.wait = FIRST_WAIT;
      this.welcome = true;
      this.listener.line("", false);
      return this.listener.ready(first, !first && !head.same);
    }
    const question = this.asked.get(head.id) ?? {},
      kind = head.ask;
    const last =
      kind === "map"
        ? ["map-end", "map-stopped", "refused", "failed"].includes(head.kind)
        : head.kind !== "waits" && head.kind !== "responses-progress" && head.done !== false;
    if (head.kind === "map-piece") this.send({ ask: "seen", id: head.id });
    if (last) this.asked.delete(head.id);
    if (last) this.since.delete(head.id);
    if (last && this.flying.delete(head.id)) {
      const next = this.waiting.get(kind);
      if (next) {
        this.waiting.delete(kind);
        this.newest(kind, next);
      }
    }
    this.listener.hear(head, arrays, question);
  }

  /** Seconds for which the oldest question of each kind has been under way. */
  get underWay(): Record<string, number> {
    const now = performance.now(),
      found: Record<string, number> = {};
    for (const [kind, at] of this.since.values()) found[kind] = Math.max(found[kind] ?? 0, (now - at) / 1000);
    return found;
  }
  private send(message: Question): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  /** True if all that was asked is answered. */
  get quiet(): boolean {
    return this.welcome && this.asked.size === 0;
  }

  /** Ask now; gives the number of the question, or -1 while there is no line. */
  ask(kind: string, fields: Question = {}): number {
    if (!this.welcome && kind !== "hello") return -1;
    const id = this.id++;
    this.asked.set(id, fields);
    this.since.set(id, [kind, performance.now()]);
    this.send({ ask: kind, id, ...fields });
    if (this.asked.size > 400) this.asked.delete(this.asked.keys().next().value!);
    if (this.since.size > 400) this.since.delete(this.since.keys().next().value!);
    return id;
  }

  /** Ask, but have one question of a kind under way, two of motions, so that the desk has the next one while this
   *  is drawn: of those that come meanwhile only the newest is asked. */
  newest(kind: string, fields: Question): void {
    if ([...this.flying.values()].filter(one => one === kind).length >= (kind === "motion" ? 2 : 1)) {
      this.waiting.set(kind, fields);
      return;
    }
    const id = this.ask(kind, fields);
    if (id >= 0) this.flying.set(id, kind);
  }

  /** Tell the desk something that has no answer. */
  tell(kind: string, fields: Question = {}): void {
    if (this.welcome) this.send({ ask: kind, id: this.id++, ...fields });
  }
}
