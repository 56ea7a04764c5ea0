/** What the desk says of its system, and the names of what answers hold. */
import type { Range } from "./axes";
import type { Head } from "./link";

export interface Shown {
  unit: string;
  factor: number;
}
export interface Quantity {
  name: string;
  unit: string;
  shown: Shown;
  kind: "state" | "output";
}
export interface Parameter {
  name: string;
  unit: string;
  shown: Shown;
  value: number;
  low: number;
  high: number;
  step: number | null;
  scale: "linear" | "log";
  least: number | null;
  most: number | null;
}
export interface About extends Head {
  system: { name: string; description: string; text: string; source?: string } | null;
  forced: boolean;
  forced_at: string | null;
  method: string;
  methods: string[];
  quantities: Quantity[];
  parameters: Parameter[];
  guards: { name: string; quantity: string | null; unit: string }[];
  turn: number;
  axes: Record<string, Range>;
  at: Record<string, number>;
  ranges?: Record<string, Range>;
  size: [number, number];
  choices: string[];
  panels: {
    history: string[];
    phase: string[];
    response: { parameter: string; range: Range; quantity: string } | null;
  };
  start: Record<string, number> | null;
  view: Record<string, any>;
  results: { name: string; kind: string; words: string }[];
  hues: number[][];
  hue_shades: number[][][];
  codes: Record<string, string>;
  code_colors: Record<string, number[]>;
  agreement_colors: Record<string, number[]>;
  contact_kinds: string[];
  models: { name: string; words: string }[] | null;
}
export interface Attractor {
  key: number;
  hue: number;
  period: number;
  name: string;
  kind: string;
  peak: Record<string, number>;
  seconds: number | null;
  multipliers: [number, number][];
  stable: boolean | null;
  margin: number | null;
  eigenvalues?: boolean;
  contacts?: number | null;
  exponent?: number | null;
  rms?: Record<string, number>;
  points: number[][];
  fraction: number | null;
  low: number | null;
  high: number | null;
  order: number;
}

/** A name as people read it: upper_gap is "upper gap". */
export const plain = (name: string): string => name.replaceAll("_", " ");
export const unitOf = (about: About, name: string): string => about.quantities.find(q => q.name === name)?.unit ?? "";
export const parameterOf = (about: About, name: string): Parameter | undefined =>
  about.parameters.find(p => p.name === name);
/** What a start is given by: of a map over sensors these two, else all states. */
export const coordinates = (about: About, axes: [string, string]): string[] =>
  isOutput(about, axes[0]) ? [...axes] : states(about);
export const isOutput = (about: About, name: string): boolean =>
  about.quantities.find(q => q.name === name)?.kind === "output";
export const states = (about: About): string[] => about.quantities.filter(q => q.kind === "state").map(q => q.name);
