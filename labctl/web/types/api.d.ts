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

export type AnyAxisUncertainty = Schema<"AnyAxisUncertainty">;
export type Assessment = Schema<"AssessmentResponse">;
export type Attendance = Schema<"AttendanceResponse">;
export type AxisUncertainty = Schema<"AxisUncertainty">;
export type BenchCheck = Schema<"BenchCheckResponse">;
export type BenchStatus = Schema<"BenchStatus">;
export type Budget = Schema<"BudgetJson">;
export type BudgetLine = Schema<"BudgetLineJson">;
export type CalibrationEvent = Schema<"CalibrationEventResponse">;
export type CalibrationRow = Schema<"CalibrationRow">;
export type Campaign = Schema<"CampaignResponse">;
export type CampaignPlan = Schema<"CampaignPlanResponse">;
export type Certificate = Schema<"CertificateResponse">;
export type Certification = Schema<"CertificationResponse">;
export type Characteristic = Schema<"Characteristic">;
export type Comparison = Schema<"ComparisonResponse">;
export type ComparisonColumns = Schema<"ComparisonColumns">;
export type ContributionLines = Schema<"ContributionLinesJson">;
export type ContributionsOver = Schema<"ContributionsOverJson">;
export type Course = Schema<"CourseResponse">;
export type Datasheet = Schema<"DatasheetResponse">;
export type DeviceCheck = Schema<"DeviceCheck">;
export type Diagnosis = Schema<"DiagnosisResponse">;
export type DiagnosisRound = Schema<"DiagnosisRound">;
export type DataSets = Schema<"DataSetsResponse">;
export type Draft = Schema<"DraftResponse">;
export type Drift = Schema<"Drift">;
export type Imported = Schema<"ImportResponse">;
export type Joint = NonNullable<Schema<"CriticismResponse">["joint"]>;
export type Ladder = Schema<"LadderResponse">;
export type LadderRow = Schema<"LadderRow">;
export type ModelLines = Schema<"ModelLines">;
export type LiveHistory = Schema<"LiveHistoryResponse">;
export type LiveMoment = Schema<"LiveMoment">;
export type LiveState = Schema<"LiveStateResponse">;
export type LogPreview = Schema<"LogPreview">;
export type Motion = Schema<"MotionResponse">;
export type Output = Schema<"OutputResponse">;
export type Parameter = Schema<"ParameterJson">;
export type Plan = Schema<"PlannedResponse">;
export type Prompt = Schema<"PromptResponse">;
export type Turn = Schema<"TurnResponse">;
export type WatchedLimit = Schema<"WatchedLimitResponse">;
export type MissingFact = Schema<"MissingFactResponse">;
export type PublicCertificate = Schema<"PublicCertificate">;
export type Recipe = Schema<"RecipeResponse">;
export type RecordingRow = Schema<"RecordingResponse">;
export type ReleaseRequest = Schema<"ReleaseRequestResponse">;
export type ResidualColumns = Schema<"ResidualColumns">;
export type RestColumns = Schema<"RestColumns">;
export type Scheduled = Schema<"ScheduledResponse">;
export type SensorVersion = Schema<"SensorVersionResponse">;
export type Standard = Schema<"StandardResponse">;
export type StartEvent = Schema<"StartEventResponse">;
export type TargetUnit = Schema<"TargetUnitResponse">;
export type Trace = Schema<"TraceResponse">;
export type Trend = Schema<"TrendResponse">;
export type TrendPoint = Schema<"TrendPoint">;
export type TurnColumns = Schema<"TurnColumns">;
export type Uncertainty = Schema<"UncertaintyResponse">;
export type Design = Schema<"DesignResponse">;
export type DesignedCampaign = Schema<"DesignedCampaign">;
export type TiltedDesign = Schema<"TiltedDesign">;
export type Batch = Schema<"BatchResponse">;
export type FleetChart = Schema<"FleetChartResponse">;
export type FleetChartPoint = Schema<"FleetChartPoint">;
export type FleetJob = Schema<"FleetJobResponse">;
export type FleetReport = Schema<"FleetReportResponse">;
export type FleetType = Schema<"FleetTypeResponse">;
export type FleetUnit = Schema<"FleetUnitResponse">;
export type UncertaintyCourse = Schema<"UncertaintyCourseResponse">;
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

export type Allan = Schema<"AllanResponse">;
export type Inspection = Schema<"InspectionResponse">;
export type AllanAxis = Schema<"AllanJson">;
export type Bench = Schema<"BenchResponse">;
export type CampaignEvent = Schema<"EventResponse">;
export type Coefficient = Schema<"Coefficient">;
export type CoefficientAxis = Schema<"VersionResponse">["axes"][string];
export type Criticism = Schema<"CriticismResponse">;
export type Effect = Schema<"CataloguedEffect">;
export type Fetch = Schema<"FetchResponse">;
export type Heartbeat = Schema<"HeartbeatResponse">;
export type NoiseFigure = Schema<"NoiseFigure">;
export type EvaluatedRecipe = Schema<"EvaluateResponse">;
export type FigurePoint = Schema<"FigurePointResponse">;
export type Point = Schema<"PointResponse">;
export type Preview = Schema<"PreviewResponse">;
export type ResidualMap = Schema<"ResidualMap">;
export type Suspect = Schema<"Suspect">;
export type Verification = Schema<"VerificationResponse">;
export type Version = Schema<"VersionResponse"> | Schema<"ImprovedVersionResponse">;
export type TypePrior = NonNullable<Schema<"VersionResponse">["type_prior"]>;
export type CoefficientTable = Schema<"CoefficientTable">;
/** The unit of each output axis. */
export type Outputs = Record<string, { unit?: string }>;

/* What is open in the OpenAPI document, because it is open in a recording: its conditions, and its columns by name */

export interface RecordingInfo {
  motion?: RecordingRow["motion"];
  rate_reference?: "computed" | "demanded" | "measured" | null;
  axes: string[];
  output?: Outputs;
  model?: string | null;
  technology?: string | null;
  notes?: string | null;
  sample_rate_hz?: number | null;
  max_rate_dps?: number | null;
  latitude_deg: number | null;
}

export type Recording = Omit<Schema<"RecordingAlone">, "info"> & { info: RecordingInfo };
/** Columns of equal length by name; most are numbers. */
export type SampleColumns = Record<string, number[]>;
export type Samples = Omit<Schema<"SamplesResponse">, "columns"> & { columns: SampleColumns };

interface Untyped {
  "get /api/recordings/{recording}": Recording;
  "get /api/recordings/{recording}/samples": Samples;
}

/** Messages of the event streams: the data of each event by its name. */
export interface Streams {
  "/api/live/events": { state: LiveState };
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
  problems?: string[];
  /** What is wrong with the request, each with its place in it. */
  errors?: { place: string[]; text: string }[];
  /** Facts of a certificate that are not stated. */
  missing?: MissingFact[];
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
