/** Types that several modules of the pages share: elements, figures, and what the router gives a page. */

import type { DataSets, Outputs, RecordingRow } from "./api.js";

/** What may stand in an element; null, undefined and false are left out. */
export type Child = Node | string | number | false | null | undefined | readonly Child[];

type Value = string | number | boolean | null | undefined;

type Names =
  | "accept"
  | "autocomplete"
  | "class"
  | "checked"
  | "datetime"
  | "disabled"
  | "download"
  | "for"
  | "height"
  | "hidden"
  | "href"
  | "id"
  | "list"
  | "max"
  | "maxlength"
  | "method"
  | "min"
  | "minlength"
  | "multiple"
  | "name"
  | "open"
  | "placeholder"
  | "required"
  | "role"
  | "rows"
  | "scope"
  | "selected"
  | "spellcheck"
  | "src"
  | "step"
  | "style"
  | "tabindex"
  | "title"
  | "type"
  | "value"
  | "webkitdirectory"
  | "width"
  | "alt";

/** Attributes and event handlers of an HTML element. */
export type Attributes = { [K in Names]?: Value } & {
  [K in keyof HTMLElementEventMap as `on${K}`]?: ((event: HTMLElementEventMap[K]) => unknown) | null;
} & { [name: `aria-${string}` | `data-${string}`]: Value };

export type SvgAttributes = Record<string, Value>;

/** A column of a table: how a row is shown in it. */
export interface Column<Row> {
  title: string | Node;
  number?: boolean;
  prose?: boolean;
  acts?: boolean;
  cell: (row: Row) => Child;
}

/** A line of a list of facts: name, value, unit, secondary text. */
export type Fact = readonly [Child, Child, Child?, Child?];

/** A field of a dialog. A checkbox answers "on" or "". */
export interface Field {
  name: string;
  label: string;
  value?: string;
  hint?: string | null;
  type?: string;
  required?: boolean;
  minlength?: number | null;
  maxlength?: number | null;
  min?: number | null;
  max?: number | null;
}

/** The answers of a dialog by the name of the field. */
export type Answers = Record<string, string>;

/** What the router gives the function `page` of a module. */
export interface PageContext {
  params: Record<string, string>;
  query: Query;
  signal: AbortSignal;
}

/** The query string of the address. */
export type Query = Record<string, string | undefined>;

export interface PageModule {
  page: (context: PageContext) => HTMLElement | Promise<HTMLElement>;
}

/** A trace for Plotly: what the pages read of it, and whatever else Plotly takes. */
export interface PlotTrace {
  type: string;
  name?: string;
  x?: ArrayLike<unknown>;
  y?: ArrayLike<unknown>;
  z?: ArrayLike<unknown>;
  [option: string]: unknown;
}

// Plotly brings no types, and its options are a language of their own.
export type PlotLayout = Record<string, any>;

export interface Picture {
  data: PlotTrace[];
  layout?: PlotLayout;
}

/** The element that Plotly has drawn into. */
export interface Plot extends HTMLElement {
  data?: PlotTrace[];
  layout?: PlotLayout;
  /** Of a plot that is drawn: each axis with its place in the plot, px, and what gives the px of a number along it. */
  _fullLayout: Record<`${"x" | "y"}axis${string}`, { _offset: number; c2p: (value: number) => number }>;
  on: (name: string, act: (event: PlotEvent) => unknown) => void;
}

export interface PlotEvent {
  points: { x: number; y: number; customdata?: any; curveNumber?: number; pointNumber?: number }[];
  [range: `xaxis.${string}`]: unknown;
  [camera: `scene${string}.camera`]: unknown;
}

/** Rows of a CSV file, the first of them its headings. */
export type CsvRows = readonly (readonly unknown[])[];

/** A figure: draw it, draw it again if it was drawn, and the callback for its first drawing. */
export interface Figure extends HTMLElement {
  plot: Plot;
  update: () => Promise<void>;
  redraw: () => Promise<void> | undefined;
  /** Draw now, so wide in px; null: as wide as the page lets it be. */
  drawAt: (width: number | null) => void;
  /** Put a picture of a figure in three dimensions beside it, for paper; null: it is flat, and prints as it is. */
  solidPicture: (width: number) => Promise<HTMLElement | null>;
  ondrawn?: (plot: Plot) => void;
}

export interface Plotly {
  Fx: {
    hover: (plot: HTMLElement, points: { curveNumber: number; pointNumber: number }[]) => unknown;
    unhover: (plot: HTMLElement) => unknown;
  };
  restyle: (plot: HTMLElement, changed: object, traces: number[]) => Promise<unknown>;
  react: (plot: HTMLElement, data: PlotTrace[], layout: PlotLayout, config: object) => Promise<unknown>;
  purge: (plot: HTMLElement) => unknown;
  relayout: (plot: HTMLElement, changed: object) => Promise<unknown>;
  toImage: (plot: HTMLElement | Picture, options: object) => Promise<string>;
}

/** The state of the page of a recording: which channel, window and data set are shown. */
export interface RecordingState {
  id: number;
  kind: string;
  motion: RecordingRow["motion"];
  sets: DataSets;
  output: Outputs;
  channel: string;
  /** The window of the trace, s; null: all of it. */
  from: number | null;
  until: number | null;
  dataset: number | null;
  pick: (dataset: number | null) => void;
  /** Show a data set, by its place in the columns, in the trace; absent where there are no times. */
  showInTrace?: (k: number) => void;
}

/** A part of a page that is drawn again when the state changes. */
export interface Part extends HTMLElement {
  redraw: () => unknown;
}

declare global {
  interface Window {
    Plotly: Plotly;
  }
  interface WindowEventMap {
    "labctl:key": CustomEvent<string | undefined>;
    "labctl:moved": CustomEvent;
    "labctl:fresh": CustomEvent;
    "labctl:heard": CustomEvent;
    "labctl:theme": CustomEvent;
  }
}
