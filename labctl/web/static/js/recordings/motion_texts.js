// What a data set's position and rate mean, by what moved the unit.

/** @import { RecordingRow } from "../../../types/api.js" */

/** Motions in which a position says which axis pointed up. */
export const POSITIONED = new Set(["rates", "turns", "profile"]);
/** What a table's rate is known from. */
export const REFERENCE_TEXTS = {
  computed: "computed from the step clock",
  demanded: "the demanded rate, not measured",
  measured: "measured by the encoder",
};
/**
 * What a data set's one rate is; none at rest and in poses.
 * @type {Partial<Record<RecordingRow["motion"], string>>}
 */
export const RATE_TITLES = { rates: "Table rate", turns: "Mean rate of the turn", profile: "Mean table rate" };
