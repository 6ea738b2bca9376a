// Compare, for a recording at rest, in turns, of a profile or in poses: the version without refitting beside it.

import { get } from "../../core/http/api.js";
import { h, setChildren } from "../../core/elements.js";
import { cardWithHeader, loadInto } from "../../core/components.js";
import { motionView } from "../../motions/view.js";

/** @import { Motion } from "../../../../types/api.js" */
/** @import { ExploreState } from "../state.js" */

/**
 * @param {Pick<ExploreState, "serial" | "version" | "recording" | "axis" | "onchange" | "calibration">} state
 * @param {AbortSignal} signal
 */
export function motionComparison(state, signal) {
  const place = h("div", { class: "stack", style: "min-height: 20rem" });
  const source = h("p", { class: "muted small" });
  /** @type {Motion | null} */
  let found = null;
  const shown = () =>
    loadInto(place, "Reading the recording", async () => {
      found ??= await get("/api/units/{serial}/calibrations/{version}/motion", {
        path: { serial: state.serial, version: state.version },
        query: { recording: state.recording },
        signal,
      });
      setChildren(source, `Model: ${found.source}.${leftOut(state.calibration.left_out)}`);
      return motionView(found, state.axis);
    });
  shown();
  state.onchange((what) => what === "axis" && shown());
  return cardWithHeader("Compare", null, source, place);
}

/** @param {readonly { effect: string }[] | undefined} effects */
function leftOut(effects) {
  if (!effects?.length) return "";
  const names = effects.map(({ effect }) => effect.replaceAll("_", " ")).join(", ");
  return ` Without ${names}, which ${effects.length > 1 ? "do" : "does"} not belong to the exported calibration.`;
}
