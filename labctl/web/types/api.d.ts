/**
 * The HTTP interface as the pages see it. All of it comes from `openapi.d.ts`, which is generated from the OpenAPI document;
 * what that document leaves open is stated here, in `Untyped`, and nowhere else.
 */

import type { components, paths } from "./openapi.js";

type Schemas = components["schemas"];

/** A type without the keys that nobody declared: a wrong name is an error, not `unknown`. */
export type Declared<T> = T extends readonly (infer Item)[]
  ? Declared<Item>[]
  : T extends object
    ? { [K in keyof T as string extends K ? (unknown extends T[K] ? never : K) : K]: Declared<T[K]> }
    : T;

export type Schema<Name extends keyof Schemas> = Declared<Schemas[Name]>;

/* Answers */

export type Assessment = Schema<"AssessmentResponse">;
export type Attendance = Schema<"AttendanceResponse">;
export type AxisUncertainty = Schema<"AxisUncertainty">;
export type BenchStatus = Schema<"BenchStatus">;
export type CalibrationRow = Schema<"CalibrationRow">;
export type Campaign = Schema<"CampaignResponse">;
export type CampaignPlan = Schema<"CampaignPlanResponse">;
export type Certification = Schema<"CertificationResponse">;
export type ComparisonColumns = Schema<"ComparisonColumns">;
export type DataSets = Schema<"DataSetsResponse">;
export type Imported = Schema<"ImportResponse">;
export type Ladder = Schema<"LadderResponse">;
export type LadderRow = Schema<"LadderRow">;
export type ModelLines = Schema<"ModelLines">;
export type Output = Schema<"OutputResponse">;
export type Plan = Schema<"PlannedResponse">;
export type Prompt = Schema<"PromptResponse">;
export type Recipe = Schema<"RecipeResponse">;
export type RecordingRow = Schema<"RecordingResponse">;
export type ResidualColumns = Schema<"ResidualColumns">;
export type Scheduled = Schema<"ScheduledResponse">;
export type StartEvent = Schema<"StartEventResponse">;
export type Trace = Schema<"TraceResponse">;
export type Uncertainty = Schema<"UncertaintyResponse">;
export type Unit = Schema<"UnitResponse">;
export type Validity = Schema<"Validity">;
export type Visibility = Schema<"Visibility">;
export type Warning = Schema<"DataWarning">;
/** What a person makes sure of before a real bench starts. */
export type Check = NonNullable<Schemas["CampaignRequest"]["checks"]>[number];
/** A state of a campaign. */
export type CampaignState = Campaign["state"];
/** The columns of a plan; those of a campaign also say what has been done. */
export type Timeline = Schema<"TimelineColumns"> & Partial<Schema<"RunColumns">>;

/* What the OpenAPI document leaves open */

export interface Bench {
  name: string;
  simulated: boolean;
  units: { serial: string }[];
  unconfirmed?: string | null;
  campaign?: number | null;
  start_questions?: Record<string, string>;
}

export interface Effect {
  id: string;
  term: string;
  sentence: string;
  origin: string;
  rows: string;
  needs: string[];
  order: number | null;
  max_order: number | null;
  parameters: { name: string; unit: string; low: number; high: number }[];
  plausible: Record<string, [number, number]>;
  aliases: string[];
  experiment: string;
  draws: string[];
  unit: string;
  leaves: boolean;
}

export interface RecordingInfo {
  axes: string[];
  output?: Outputs;
  model?: string | null;
  technology?: string | null;
  notes?: string | null;
  sample_rate_hz?: number | null;
  max_rate_dps?: number | null;
  latitude_deg: number | null;
}

/** The unit of each output axis. */
export type Outputs = Record<string, { unit?: string }>;

export interface Recording extends RecordingRow {
  info: RecordingInfo;
}

export interface Samples {
  readings: number;
  columns: SampleColumns;
}

/** Columns of equal length by name; most are numbers. */
export type SampleColumns = Record<string, number[]>;

export interface Coefficient {
  value: number;
  u: number | null;
  unit: string;
}

export interface CoefficientTable {
  temperature_c?: number[];
  [name: string]: unknown;
}

export interface CoefficientAxis extends CoefficientTable {
  coefficients?: Record<string, Coefficient> & CoefficientTable;
}

export type Version = Omit<Schema<"VersionResponse">, "axes"> & { axes: Record<string, CoefficientAxis> };

export type Preview = Omit<Schema<"PreviewResponse">, "axes" | "plausible" | "left_out"> & {
  axes: Record<string, CoefficientAxis>;
  plausible: Record<string, { from: number; to: number; inside: boolean } | undefined>;
  left_out: { effect: string; origin?: string }[];
};

export type Comparison = Omit<Schema<"ComparisonResponse">, "left_out"> & { left_out: { effect: string }[] };

export interface Suspect {
  effect: string;
  log_bayes_factor: number;
  share_removed: number;
  coefficients: Record<string, Record<string, Coefficient>>;
  coefficients_from: string;
  physical: boolean | null;
  rms_after_dps: number | null;
  heldout_rms_after_dps: number | null;
  alias_group: string[];
  explanation: string;
}

export interface ResidualMap {
  axis: string;
  position: string;
  dataset: number[];
  rate_level_dps: number[];
  temperature_level_c: number[];
  level_width_c: number;
  over_floor: number[];
}

export interface DataSetViews {
  of: number;
  dataset: number[];
  position: string[];
  channels: Record<string, number[]>;
  residual_dps: Record<string, number[]>;
  over_floor: Record<string, number[]>;
}

export type Criticism = Omit<
  Schema<"CriticismResponse">,
  "error" | "noise" | "suspects" | "experiments" | "not_testable" | "views"
> & {
  error: { rms_dps: number; heldout_rms_dps: number | null; noise_floor_dps: number };
  noise: { drift_dps: number | null; vs_datasheet: number | null };
  suspects: Suspect[];
  experiments: { do: string; hours?: number | null; separates: string[]; power: number; toml?: string | null }[];
  not_testable: { effect: string; why: string; needs: string[] }[];
  maps: ResidualMap[];
  views: { sets: DataSetViews };
};

/** The Allan deviation of an axis, as columns of equal length, and its figures. */
export type AllanAxis = Record<"tau_s" | "deviation_dps" | "low_dps" | "high_dps" | "model_dps", number[]> &
  Partial<Record<"N" | "B" | "K", NoiseFigure | null>>;

export type Allan = Omit<Schema<"AllanResponse">, "axes"> & { axes: Record<string, AllanAxis> };

export interface NoiseFigure {
  value: number | null;
  u: number;
  unit: string;
  at_most?: number | null;
  why?: string | null;
}

export interface CampaignEvent {
  at: string;
  t_s: number;
  level: string;
  message: string;
  device?: string | null;
  value?: number | null;
  limit?: number | null;
  unit?: string | null;
}

export interface Heartbeat {
  heard_s?: number | null;
}

/** Answers that the OpenAPI document does not describe, or only in part, by method and path. */
interface Untyped {
  "get /health/heartbeat": Heartbeat;
  "get /api/benches": Bench[];
  "get /api/effects": { effects: Effect[] };
  "get /api/recordings/{recording}": Recording;
  "get /api/recordings/{recording}/allan": Allan;
  "get /api/recordings/{recording}/samples": Samples;
  "get /api/units/{serial}/calibrations/{version}": Version;
  "get /api/units/{serial}/calibrations/{version}/comparison": Comparison;
  "get /api/units/{serial}/calibrations/{version}/criticism": Criticism;
  "post /api/units/{serial}/calibrations/{version}/preview": Preview;
}

/** Messages of the event streams: the data of each event by its name. */
export interface Streams {
  "/api/campaigns/{campaign}/events": { progress: Campaign; message: CampaignEvent };
  "/api/units/{serial}/calibrations/{version}/criticism/events": {
    stage: { stage: string };
    answer: Criticism;
    problem: ProblemDocument;
  };
}

/** A problem document (RFC 9457). */
export interface ProblemDocument {
  status: number;
  type?: string;
  title?: string;
  detail?: string;
  warnings?: Warning[];
}

/* Requests: path, parameters, body and answer of each operation */

type Method = "get" | "post" | "delete";
/** The paths that answer to a method. */
export type PathOf<M extends Method> = {
  [P in keyof paths]: paths[P] extends Record<M, { responses: unknown }> ? P : never;
}[keyof paths];

type Operation<M extends Method, P extends keyof paths> = paths[P] extends Record<M, infer O> ? O : never;

export type PathParameters<P extends keyof paths> = P extends `${string}{${string}`
  ? { path: NamesIn<P> }
  : { path?: never };
type NamesIn<P extends string> = P extends `${string}{${infer Name}}${infer Rest}`
  ? { [K in Name]: string | number } & NamesIn<Rest>
  : unknown;

/** The query of an operation; null and undefined are left out of the address. */
export type QueryOf<M extends Method, P extends keyof paths> =
  Operation<M, P> extends { parameters: { query?: infer Q } } ? { [K in keyof Q]?: Q[K] | null } : never;

export type BodyOf<M extends Method, P extends keyof paths> =
  Operation<M, P> extends { requestBody: { content: { "application/json": infer B } } } ? B : undefined;

type Json<O> = O extends { responses: infer R }
  ? {
      [Code in keyof R]: Code extends 200 | 201
        ? R[Code] extends { content: { "application/json": infer J } }
          ? J
          : never
        : never;
    }[keyof R]
  : never;

export type AnswerOf<M extends Method, P extends keyof paths> = `${M} ${P & string}` extends keyof Untyped
  ? Untyped[`${M} ${P & string}`]
  : Declared<Json<Operation<M, P>>>;

export type Options<M extends Method, P extends keyof paths> = PathParameters<P> & {
  query?: QueryOf<M, P>;
  signal?: AbortSignal;
};

export type PostOptions<P extends PathOf<"post">> = PathParameters<P> & {
  body: BodyOf<"post", P>;
  signal?: AbortSignal;
};
