// What the noise floor of a recording is computed from.

/** @import { ExploreState } from "./state.js" */

/**
 * By the name of the source in the answer: in words, and whether it is one number for data sets of all rates.
 * @type {Record<string, { text: string, isOne: boolean }>}
 */
const SOURCES = {
  "within and between data sets": { text: "by the scatter within and between data sets", isOne: false },
  "within data sets, and by the data sheet": {
    text: "by the scatter within data sets, and the drift of the data sheet",
    isOne: false,
  },
  "within data sets": { text: "by the scatter within data sets", isOne: false },
  repeats: { text: "by data sets that repeat each other, at nearly equal rate and temperature", isOne: true },
  "scatter about a smooth surface": { text: "by the scatter about a smooth surface", isOne: true },
};

/** @typedef {ExploreState["criticism"]["error"]} Errors */

/**
 * Where the floor comes from; null where it has no source.
 * @param {Errors} error
 */
export function floorText({ noise_floor_source: name }) {
  const source = SOURCES[name];
  return source ? `${source.text}${source.isOne ? "; one number for all rates" : ""}` : null;
}

/**
 * What one noise floor for all data sets hides, where no readings say what each has; with a space before it.
 * @param {Errors} error
 */
export const oneFloorText = ({ noise_floor_source: name }) =>
  SOURCES[name]?.isOne
    ? " Here the noise floor is one number for all data sets, since the recording has no readings within them: where the noise grows with the rate, an error at low rates is larger against the noise than its cell shows, and at high rates smaller."
    : "";
