/** Orbits of branches in a word, events by their shapes. */

/** T, 2T, ... of an orbit in forcing periods; of others its kind stands with its branch. */
export const periodText = (n: number): string => (n > 1 ? `${n}T` : n ? "T" : "");

/** Pixels about a mark in which a lesser one isn't drawn: it appears where one looks closer. */
const APART = 7;
const RANK = [/fold/, /doubling|Neimark|Hopf|branch point/, /corner|two contacts/, /./];
/** The events that are drawn of those at given pixels: of some that would overlap the one that says most. */
export function shownMarks(kinds: string[], x: number[], y: number[]): number[] {
  const rank = (i: number) => RANK.findIndex(one => one.test(kinds[i].replaceAll("_", " "))),
    kept: number[] = [];
  for (const i of [...kinds.keys()].sort((a, b) => rank(a) - rank(b) || a - b))
    if (!kept.some(k => Math.hypot(x[k] - x[i], y[k] - y[i]) < APART)) kept.push(i);
  return kept.reverse(); // what says most is drawn last
}

/** An event by its shape: a fold is a triangle, a doubling a diamond, a graze a triangle upwards, all else a square. */
export function mark(
  c: CanvasRenderingContext2D,
  kind: string,
  x: number,
  y: number,
  size: number,
  fill: string,
  edge: string,
): void {
  const shapes: [RegExp, [number, number][]][] = [
    [
      /fold/,
      [
        [-4, -5],
        [6, 0],
        [-4, 5],
      ],
    ],
    [
      /doubling/,
      [
        [0, -6],
        [6, 0],
        [0, 6],
        [-6, 0],
      ],
    ],
    [
      /graz/,
      [
        [-5, 4],
        [0, -6],
        [5, 4],
      ],
    ],
    [
      /branch point/,
      [
        [-5, -3],
        [-3, -5],
        [0, -2],
        [3, -5],
        [5, -3],
        [2, 0],
        [5, 3],
        [3, 5],
        [0, 2],
        [-3, 5],
        [-5, 3],
        [-2, 0],
      ],
    ],
    [
      /corner|two contacts/,
      [
        [-5, -4],
        [0, 6],
        [5, -4],
      ],
    ],
    [
      /Neimark|Hopf/,
      [
        [-3, -5],
        [3, -5],
        [6, 0],
        [3, 5],
        [-3, 5],
        [-6, 0],
      ],
    ],
  ];
  const shape = shapes.find(([pattern]) => pattern.test(kind.replaceAll("_", " ")))?.[1] ?? [
    [-4, -4],
    [4, -4],
    [4, 4],
    [-4, 4],
  ];
  c.beginPath();
  for (const [u, v] of shape) c.lineTo(x + size * u, y + size * v);
  c.closePath();
  c.fillStyle = fill;
  c.fill();
  c.strokeStyle = edge;
  c.lineWidth = 1;
  c.stroke();
}
