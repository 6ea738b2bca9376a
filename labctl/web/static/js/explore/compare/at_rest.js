// The output at rest over temperature, measured and modelled.

import { h } from "../../core/elements.js";
import { axisColour, colour, figure } from "../../core/figure.js";
import { recordingMarks } from "../../core/recording_marks.js";
import { linesOf, ownRows, pickRows, positionsOf } from "./rows.js";

/** @import { Comparison } from "../../../../types/api.js" */
/** @import { Picture } from "../../../../types/pages.js" */
/** @import { ExploreState } from "../state.js" */

/**
 * @param {Comparison} comparison
 * @param {ExploreState} state
 */
export function atRest(comparison, state) {
  const own = ownRows(comparison, state.axis);
  const here = own.table_rate_dps
    .map((rate, k) => (Math.abs(rate) < comparison.at_rest_dps ? k : -1))
    .filter((k) => k >= 0);
  if (!here.length) return h("p", { class: "muted" }, "No data set of this recording is at rest.");
  const rest = pickRows(own, here);
  const lines = linesOf(comparison.over_temperature, state.axis, positionsOf(rest));
  const marks = recordingMarks(rest.recording, axisColour(state.axis));
  const floor = state.criticism.error.noise_floor_dps;
  /** @returns {Picture} */
  const draw = () => ({
    data: [
      ...lines.flatMap((each) =>
        each.level.flatMap((level, k) =>
          Math.abs(level) < comparison.at_rest_dps
            ? [
                {
                  type: "scatter",
                  mode: "lines",
                  name: "model",
                  x: each.at,
                  y: each.error_dps[k],
                  line: { color: colour("text"), width: 1.5 },
                  hoverinfo: "skip",
                },
              ]
            : [],
        ),
      ),
      {
        type: "scatter",
        mode: "markers",
        name: "measured",
        x: rest.temperature_c,
        y: rest.measured_error_dps,
        customdata: rest.dataset,
        error_y: floor ? { type: "constant", value: 2 * floor, thickness: 1, width: 0 } : undefined,
        text: rest.recording.map((recording) => (marks.legend.length ? `recording ${recording}, ` : "")),
        marker: { color: axisColour(state.axis), size: 7, ...marks.marker },
        hovertemplate: "%{text}data set %{customdata}<br>%{x:.4g} °C: %{y:.4g} deg/s<extra></extra>",
      },
      ...marks.legend,
    ],
    layout: {
      xaxis: { title: { text: "gyro temperature, °C" } },
      yaxis: { title: { text: "error at rest, deg/s" } },
    },
  });
  return figure(
    "Error at rest",
    `Axis ${state.axis} at rest over temperature, with the Earth's rate subtracted where the latitude is known; bars are two noise floors.`,
    draw,
    { height: "22rem" },
  );
}
