// Compare: the version without refitting beside the recording. Points, lines, surfaces and turns all come from one answer.

import { get } from "../../core/http/api.js";
import { h } from "../../core/elements.js";
import { cardWithHeader, loadInto } from "../../core/components.js";
import { toggleGroup } from "../../core/fields.js";
import { number } from "../../core/format.js";
import { query, updateQuery } from "../../core/router.js";
import { allPanels, overRate, overTemperature } from "./model_lines.js";
import { asked } from "../chosen_recordings.js";
import { atRest } from "./at_rest.js";
import { motionComparison } from "./motion_comparison.js";
import { surfaces } from "./surfaces.js";
import { fullTurn } from "./full_turn.js";

/** @import { Comparison } from "../../../../types/api.js" */
/** @import { ExploreState } from "../state.js" */

/** At rest nothing hangs on the rate. */
const AT_REST = new Set(["warm", "rest"]);
/** Views in which the data sets of several recordings have marks of their own. */
const SEVERAL = new Set(["lines", "warm", "panels", "rest"]);
/** @type {[id: string, text: string, draw: (comparison: Comparison, state: ExploreState, signal: AbortSignal) => HTMLElement][]} */
const VIEWS = [
  ["lines", "Error over rate", overRate],
  ["warm", "Error over temperature", overTemperature],
  ["panels", "Every output and axis", allPanels],
  ["surface", "Surface", surfaces],
  ["rest", "At rest", atRest],
  ["turn", "Error of a full turn", fullTurn],
];

/**
 * Whether a motion is compared by the answer of a comparison, or by one of its own.
 * @param {{ motion: ExploreState["motion"], recordings: readonly number[] }} chosen
 */
export const isByRates = ({ motion, recordings }) => motion === "rates" || recordings.length > 1;

/**
 * Request the comparison that will be drawn.
 * @param {Pick<ExploreState, "serial" | "version" | "recording" | "recordings">} chosen
 * @param {AbortSignal} signal
 */
export function askComparison(chosen, signal) {
  const asking = get("/api/units/{serial}/calibrations/{version}/comparison", {
    path: { serial: chosen.serial, version: chosen.version },
    query: asked(chosen),
    signal,
  });
  asking.catch(() => {}); // shown where it is awaited
  return asking;
}

/**
 * @param {ExploreState} state
 * @param {Promise<Comparison> | null} asking the comparison, where it is requested already
 * @param {AbortSignal} signal
 */
export function errorComparison(state, asking, signal) {
  const place = h("div", { style: "min-height: 28rem" });
  const source = h("p", { class: "muted small" });
  if (!isByRates(state)) return motionComparison(state, signal);
  const views = VIEWS.filter(
    ([id]) => (state.motion !== "rest" || AT_REST.has(id)) && (state.recordings.length < 2 || SEVERAL.has(id)),
  );
  let view = views.find(([id]) => id === query().view) ?? views[0];
  const shown = () =>
    loadInto(place, "Reading the data sets", async () => {
      asking ??= askComparison(state, signal);
      const comparison = await asking.catch((error) => {
        asking = null; // it is sent again
        throw error;
      });
      source.textContent = sourceText(comparison);
      return view[2](comparison, state, signal);
    });
  shown();
  state.onchange((what) => what === "axis" && shown());
  return cardWithHeader(
    "Compare",
    toggleGroup("What to compare", views, view[0], (value) => {
      view = views.find(([id]) => id === value) ?? views[0];
      updateQuery({ view: view === views[0] ? null : value });
      shown();
    }),
    source,
    place,
  );
}

/** @param {Comparison} comparison */
function sourceText({ source, held, left_out: leftOut, earth_turning_dps: turning }) {
  const at = Object.entries(held).map(([name, value]) => `${name} ${Number(value.toPrecision(4))}`);
  return `Error model from ${source}.${at.length ? ` Lines are at ${at.join(", ")}.` : ""}${leftOut.length ? ` Without ${leftOut.map((line) => line.effect.replaceAll("_", " ")).join(", ")}, which ${leftOut.length > 1 ? "do" : "does"} not leave with the calibration.` : ""}${turning ? ` The part of the Earth's rate that goes round with the table, ${number(turning, 2)} deg/s, is in these errors; a fit takes it off.` : ""}`;
}
