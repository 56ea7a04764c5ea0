/** Labels of maps, cell by cell, and their pictures: each map that was asked for is a sheet, the newest few are kept. */
import type { About, Attractor } from "./about";
import type { Arrays } from "./link";
import type { Box } from "./state";

/** Columns of the strips along which cells are counted; a step so long goes on in the next one. */
const STRIP = 64,
  FAR = 255;
/** A label and its age make a place in the table of colours: so many ages a label. */
const AGES = 16,
  GREY = [150, 156, 162];
/** Cells of all sheets that are kept: some 45 MB. */
const MOST_CELLS = 4_000_000;
/** `age` is log2 of the periods to settle, rounded up; 255 where it isn't known. */
const shadeOf = (age: number): number => Math.min(AGES - 1, age);

export interface Place {
  cell: [number, number];
  at: [number, number];
  label: number;
  age: number;
  stride: number;
}

export class Sheet {
  /** Stride of the level that a cell's label is from; 0 where nothing is known. */
  readonly rank: Uint8Array;
  readonly label: Int8Array;
  readonly age: Uint8Array;
  attractors: Attractor[] = [];
  known = 0;
  /** Starts that were followed and haven't settled yet; share of the search for all attractors that is done. */
  open = 0;
  looked = 1;
  of = 0;
  level = 0;
  done = false;
  covered = false;
  words: string[] = [];
  flip = "";
  took = 0;
  agreement: Agreement | null = null;
  dirty = true;
  private canvas: OffscreenCanvas;
  private image: ImageData;
  private pixels: Uint32Array;
  constructor(
    readonly key: string,
    readonly values: Record<string, number>,
    readonly plane: string,
    readonly box: Box,
    readonly n: number,
    readonly m: number,
  ) {
    this.rank = new Uint8Array(n * m);
    this.label = new Int8Array(n * m);
    this.age = new Uint8Array(n * m);
    this.of = n * m;
    this.canvas = new OffscreenCanvas(n, m);
    this.image = new ImageData(n, m);
    this.pixels = new Uint32Array(this.image.data.buffer);
  }

  /** Take in cells of a level as the desk packs them: steps along strips of columns, and rows of a table of labels and ages. */
  packed(stride: number, { step, rows, look, label, age }: Arrays): void {
    const cell = new Uint32Array(look.length),
      strip = rows[0] * STRIP;
    let place = 0,
      k = 0;
    for (const by of step) {
      place += by;
      if (by === FAR) continue;
      const within = place % strip;
      cell[k++] = Math.floor(within / STRIP) * this.m + Math.floor(place / strip) * STRIP + (within % STRIP);
    }
    const of = Array.from(look);
    this.piece(stride, { cell, label: Int8Array.from(of, i => label[i]), age: Uint8Array.from(of, i => age[i]) });
  }
  /** Take in cells of a level: each is one start, drawn as the block about it until finer ones come. */
  piece(stride: number, cells: Arrays): void {
    const { n, m, rank, label, age } = this,
      { cell, label: labels, age: ages } = cells,
      half = stride >> 1;
    for (let k = 0; k < cell.length; k++) {
      const i = Math.floor(cell[k] / m),
        j = cell[k] % m;
      const i0 = i - half,
        j0 = j - half,
        i1 = i + stride >= n ? n : i0 + stride,
        j1 = j + stride >= m ? m : j0 + stride;
      for (let a = Math.max(i0, 0); a < i1; a++)
        for (let b = Math.max(j0, 0); b < j1; b++) {
          const at = a * m + b;
          if (rank[at] === 0 || rank[at] >= stride) {
            rank[at] = stride;
            label[at] = labels[k];
            age[at] = ages[k];
          }
        }
    }
    this.dirty = true;
  }

  /** The start that a point of the plane shows: that of the block in which it lies. */
  find(x: number, y: number): Place | null {
    const [a, b, c, d] = this.box,
      { n, m } = this,
      i = Math.round(((x - a) / (b - a)) * (n - 1)),
      j = Math.round(((y - c) / (d - c)) * (m - 1));
    if (!(i >= 0 && i < n && j >= 0 && j < m)) return null;
    const stride = this.rank[i * m + j];
    if (!stride) return null;
    const own = (k: number, count: number) =>
      Math.min(Math.floor((k + (stride >> 1)) / stride) * stride, Math.floor((count - 1) / stride) * stride);
    const cell: [number, number] = [own(i, n), own(j, m)];
    return {
      cell,
      at: [a + ((b - a) * cell[0]) / (n - 1), c + ((d - c) * cell[1]) / (m - 1)],
      label: this.label[i * m + j],
      age: this.age[i * m + j],
      stride,
    };
  }

  /** The sheet's picture: row 0 is the top. */
  picture(colour: (attractors: Attractor[]) => Uint32Array): OffscreenCanvas {
    if (this.dirty) {
      const { n, m, rank, label, age, pixels } = this,
        table = colour(this.attractors);
      let covered = true;
      for (let j = 0; j < m; j++)
        for (let i = 0, to = (m - 1 - j) * n; i < n; i++, to++) {
          const at = i * m + j;
          if (rank[at]) pixels[to] = table[(label[at] & 255) * AGES + shadeOf(age[at])];
          else {
            pixels[to] = 0;
            covered = false;
          }
        }
      this.canvas.getContext("2d")!.putImageData(this.image, 0, 0);
      this.covered = covered;
      this.dirty = false;
    }
    return this.canvas;
  }

  intersects([a, b, c, d]: Box): boolean {
    const [p, q, r, s] = this.box;
    return a < q && p < b && c < s && r < d;
  }
}

/** Where a second method leads the starts of a map elsewhere: 1 agree, 0 differ, -1 not settled in one of them. */
export class Agreement {
  readonly sheet: Sheet;
  done = false;
  words: string[] = [];
  constructor(
    readonly against: string,
    { key, values, plane, box, n, m }: Sheet,
  ) {
    this.sheet = new Sheet(key, values, plane, box, n, m);
  }
  /** Take in the starts whose indices are multiples of a stride. */
  take(stride: number, label: Arrays[string]): void {
    const { n, m } = this.sheet,
      cell: number[] = [];
    for (let i = 0; i < n; i += stride) for (let j = 0; j < m; j += stride) cell.push(i * m + j);
    this.sheet.piece(stride, { cell: Uint32Array.from(cell), label, age: new Uint8Array(cell.length) });
  }
}

const word = ([r, g, b]: number[]): number => (0xff000000 | (b << 16) | (g << 8) | r) >>> 0;
/** Colours of codes, of every age. */
export function codeTable(colours: Record<string, number[]>): Uint32Array {
  const table = new Uint32Array(256 * AGES).fill(word(GREY));
  for (const [code, rgb] of Object.entries(colours))
    for (let s = 0; s < AGES; s++) table[(+code & 255) * AGES + s] = word(rgb);
  return table;
}
/** Colours of labels: a table of words, one for each label and shade. `only` leaves the hue to one attractor. */
export function colourTable(about: About, attractors: Attractor[], only: number | null): Uint32Array {
  const table = codeTable(about.code_colors);
  for (const one of attractors) {
    const shades = about.hue_shades[one.hue % about.hue_shades.length];
    for (let s = 0; s < AGES; s++) {
      const rgb = shades[s === AGES - 1 ? shades.length >> 1 : Math.min(s, shades.length - 1)];
      if (only === null || only === one.key) {
        table[(one.key & 255) * AGES + s] = word(rgb);
        continue;
      }
      const grey = Math.round(0.6 * (0.3 * rgb[0] + 0.6 * rgb[1] + 0.1 * rgb[2]) + 0.4 * 214);
      table[(one.key & 255) * AGES + s] = word([grey, grey, grey]);
    }
  }
  return table;
}

/** The newest sheets, by what they show: going back to one asks nothing anew. */
export class Sheets {
  private all = new Map<string, Sheet>();
  get(key: string): Sheet | undefined {
    const sheet = this.all.get(key);
    if (sheet) {
      this.all.delete(key);
      this.all.set(key, sheet);
    }
    return sheet;
  }
  add(sheet: Sheet): void {
    this.all.set(sheet.key, sheet);
    let cells = 0;
    for (const one of [...this.all.values()].reverse()) {
      cells += one.n * one.m;
      if (cells > MOST_CELLS && one !== sheet) this.all.delete(one.key);
    }
  }
  /** Of all sheets, oldest first. */
  [Symbol.iterator](): IterableIterator<Sheet> {
    return this.all.values();
  }
  drop(sheet: Sheet): void {
    this.all.delete(sheet.key);
  }
}
