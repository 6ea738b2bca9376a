// The error after a full turn over rate and temperature (Ojeda et al. 2000, figures 8 and 9): with the static bias alone
// taken off, and after the calibration.

import { temperatureColours } from "../../core/colour_scales.js";
import { h } from "../../core/elements.js";
import { figure } from "../../core/figure.js";
import { capitalised, number, plainNumber } from "../../core/format.js";
import { ownRows, pickRows, rms, span } from "./rows.js";
import { barPlace, sceneLayout, sides, twoScenes } from "./scenes.js";

/** @import { Comparison } from "../../../../types/api.js" */
/** @import { PlotTrace } from "../../../../types/pages.js" */
/** @import { Rows } from "./rows.js" */
/** @import { Axes } from "./scenes.js" */
/** @import { ExploreState } from "../state.js" */

/** More temperature levels than this are dots without lines. */
const MAX_LINES = 24;

/**
 * @param {Comparison} comparison
 * @param {ExploreState} state
 */
export function fullTurn(comparison, state) {
  const own = ownRows(comparison, state.axis);
  const here = own.dataset.map((_, k) => k).filter((k) => own.turn_before_deg[k] !== null);
  if (!here.length)
    return h(
      "p",
      { class: "muted" },
      `This figure needs data sets of this axis at ${comparison.least_turn_rate_dps} deg/s or more and at rest. This recording lacks one of the two: choose another recording.`,
    );
  const rows = pickRows(own, here);
  const turn = { before: numbersOf(rows.turn_before_deg), after: numbersOf(rows.turn_after_deg) };
  const draw = () => {
    const colours = temperatureColours(rows.temperature_c, barPlace());
    const titles = [
      `before: only static bias subtracted, RMS ${number(rms(turn.before), 2)} deg`,
      `after the calibration, RMS ${number(rms(turn.after), 2)} deg`,
    ];
    /** @type {Axes} */
    const axes = {
      x: ["rate, deg/s", span(rows.rate)],
      y: ["°C", span(rows.temperature_c)],
      z: ["deg per turn", span([...turn.before, ...turn.after])],
    };
    return {
      data: [
        ...turnTraces(rows, turn.before, "turn_before_deg", "scene", colours),
        ...turnTraces(rows, turn.after, "turn_after_deg", "scene2", colours),
      ],
      layout: { ...sceneLayout(titles, axes), coloraxis: colours.axis, showlegend: false },
    };
  };
  return figure(
    "Error after a full turn",
    `Error of the heading after one full turn about axis ${state.axis}, for rates of ${comparison.least_turn_rate_dps} deg/s or more. ${capitalised(sides()[0])}: only the static bias at rest is subtracted. ${capitalised(sides()[1])}: the calibration is applied, and the remaining static bias is subtracted. Both plots have the same scale. Blue is cold, red is hot.`,
    draw,
    { height: twoScenes() },
  );
}

/** @param {readonly (number | null)[]} values */
const numbersOf = (values) => values.map((value) => value ?? 0);

/**
 * @param {Rows} rows
 * @param {readonly number[]} turn
 * @param {string} name
 * @param {string} scene
 * @param {{ of: (temperature: number) => string }} colours
 * @returns {PlotTrace[]}
 */
function turnTraces(rows, turn, name, scene, colours) {
  const levels = [...new Set(rows.temperature_level_c)].sort((a, b) => a - b);
  const dots = {
    type: "scatter3d",
    mode: "markers",
    name,
    scene,
    x: rows.rate,
    y: rows.temperature_c,
    z: turn,
    marker: { size: 3, color: rows.temperature_c, coloraxis: "coloraxis" },
    customdata: rows.dataset,
    hovertemplate: "data set %{customdata}<br>%{x:.4g} deg/s, %{y:.3g} °C<br>%{z:.3g} deg per turn<extra></extra>",
  };
  return levels.length > MAX_LINES
    ? [dots]
    : [
        ...levels.flatMap((level) =>
          [-1, 1].map((side) => {
            const line = rows.rate
              .map((_, k) => k)
              .filter((k) => rows.temperature_level_c[k] === level && side * rows.rate[k] > 0)
              .sort((a, b) => rows.rate[a] - rows.rate[b]);
            return {
              type: "scatter3d",
              mode: "lines",
              name: `${plainNumber(level, 3)} °C`,
              scene,
              x: line.map((k) => rows.rate[k]),
              y: line.map((k) => rows.temperature_c[k]),
              z: line.map((k) => turn[k]),
              line: { color: colours.of(level), width: 3 },
              hoverinfo: "skip",
            };
          }),
        ),
        dots,
      ];
}
