// Measured errors as dots and the model as lines: over rate, over temperature, and for every output and turning axis.

import { rateColours, temperatureColours } from "../../core/colour_scales.js";
import { colour, figure } from "../../core/figure.js";
import { plainNumber } from "../../core/format.js";
import { signOf } from "../../core/positions.js";
import { recordingMarks } from "../../core/recording_marks.js";
import { alongRate, linesOf, ownRows, positionsOf, rowsWhere } from "./rows.js";

/** @import { Comparison, ModelLines } from "../../../../types/api.js" */
/** @import { PlotLayout, PlotTrace } from "../../../../types/pages.js" */
/** @import { Rows } from "./rows.js" */
/** @import { ExploreState } from "../state.js" */

const PANEL_PX = { wide: 210, narrow: 230 };
const isNarrow = () => window.innerWidth < 760;

/**
 * Dots of some rows, coloured by `colours`.
 * @param {Rows} rows
 * @param {readonly number[]} x
 * @param {readonly number[]} colours
 * @param {string} unit
 * @param {object} [more]
 * @returns {PlotTrace[]}
 */
const dots = (rows, x, colours, unit, more) => {
  const marks = recordingMarks(rows.recording, colour("text-muted"));
  return [
    {
      type: "scatter",
      mode: "markers",
      name: "measured",
      x,
      y: rows.measured_error_dps,
      customdata: rows.dataset,
      text: rows.recording.map((recording) => (marks.legend.length ? `recording ${recording}, ` : "")),
      marker: { size: marks.legend.length ? 6 : 5, color: colours, coloraxis: "coloraxis", ...marks.marker },
      showlegend: false,
      hovertemplate: `%{text}data set %{customdata}<br>%{x:.5g} ${unit}: %{y:.4g} deg/s<extra></extra>`,
      ...more,
    },
    ...marks.legend,
  ];
};
/**
 * @param {readonly number[]} x
 * @param {readonly number[]} y
 * @param {string} name
 * @param {string} shade
 * @param {object} [more]
 * @returns {PlotTrace}
 */
const line = (x, y, name, shade, more) => ({
  type: "scatter",
  mode: "lines",
  name,
  x,
  y,
  line: { color: shade, width: 1.5 },
  hovertemplate: `model at ${name}<br>%{x:.5g}: %{y:.4g} deg/s<extra></extra>`,
  showlegend: false,
  ...more,
});

/** @param {PlotTrace} trace */
const markerOf = ({ marker }) => /** @type {object} */ (marker);

/** @param {readonly ModelLines[]} lines */
const ofAll = (lines) =>
  lines.length && lines[0].level.length < lines[0].levels
    ? ` Lines: ${lines[0].level.length} of ${lines[0].levels} levels, all dots.`
    : "";

/**
 * @param {Comparison} comparison
 * @param {ExploreState} state
 */
export function overRate(comparison, state) {
  const rows = ownRows(comparison, state.axis);
  const lines = linesOf(comparison.over_rate, state.axis, positionsOf(rows));
  const draw = () => {
    const colours = temperatureColours(rows.temperature_c);
    return {
      data: [
        ...lines.flatMap((each) =>
          each.level.map((level, k) =>
            line(...alongRate(each, each.error_dps[k]), `${plainNumber(level, 3)} °C`, colours.of(level)),
          ),
        ),
        ...dots(rows, rows.rate, rows.temperature_c, "deg/s"),
      ],
      layout: {
        coloraxis: colours.axis,
        xaxis: { title: { text: "rate about the axis, deg/s" } },
        yaxis: { title: { text: "error of the output, deg/s" } },
      },
    };
  };
  return figure(
    "Error over rate",
    `Dots are measured errors; lines are the model of axis ${state.axis} at each temperature level. Blue is cold, red is hot. Where dots lie far from their line, the model is wrong.${ofAll(lines)}`,
    draw,
    { height: "24rem" },
  );
}

/**
 * @param {Comparison} comparison
 * @param {ExploreState} state
 */
export function overTemperature(comparison, state) {
  const rows = ownRows(comparison, state.axis);
  const lines = linesOf(comparison.over_temperature, state.axis, positionsOf(rows));
  const draw = () => {
    const colours = rateColours(rows.rate);
    return {
      data: [
        ...lines.flatMap((each) =>
          each.level.map((level, k) =>
            line(
              each.at,
              each.error_dps[k],
              `${plainNumber(signOf(each.position) * level, 4)} deg/s`,
              colours.of(signOf(each.position) * level),
            ),
          ),
        ),
        ...dots(rows, rows.temperature_c, rows.rate, "°C"),
      ],
      layout: {
        coloraxis: colours.axis,
        xaxis: { title: { text: "gyro temperature, °C" } },
        yaxis: { title: { text: "error of the output, deg/s" } },
      },
    };
  };
  return figure(
    "Error over temperature",
    `Dots are measured errors; lines are the model of axis ${state.axis} at each rate. Violet: negative rates; green: positive rates.${ofAll(lines)}`,
    draw,
    { height: "24rem" },
  );
}

/**
 * A panel for each output (row) and turning axis (column): Yang's nine where three axes were turned.
 * @param {Comparison} comparison
 */
export function allPanels(comparison) {
  const outputs = [...new Set(comparison.columns.axis)];
  const positions = [...new Set(comparison.columns.position)];
  const panels = outputs.flatMap((axis) => positions.map((position) => ({ axis, position })));
  const draw = () => {
    const below = isNarrow();
    const columns = below ? 1 : positions.length;
    const colours = temperatureColours(comparison.columns.temperature_c);
    const rowsOfPanels = Math.ceil(panels.length / columns);
    /** @type {PlotLayout} */
    const layout = {
      coloraxis: colours.axis,
      annotations: [],
      margin: { l: 62, r: 8, t: 26, b: 46 },
      height: 60 + rowsOfPanels * (below ? PANEL_PX.narrow : PANEL_PX.wide),
      grid: { rows: rowsOfPanels, columns, pattern: "independent", xgap: 0.22, ygap: 0.34 },
    };
    const data = panels.flatMap(({ axis, position }, panel) => {
      const id = panel ? String(panel + 1) : "";
      const place = { xaxis: `x${id}`, yaxis: `y${id}` };
      const rows = rowsWhere(comparison, (k, each) => each.axis[k] === axis && each.position[k] === position);
      layout[`xaxis${id}`] = {
        title: panel >= panels.length - columns ? { text: "rate about the axis, deg/s" } : undefined,
      };
      layout[`yaxis${id}`] = { title: panel % columns ? undefined : { text: "error of the output, deg/s" }, nticks: 5 };
      layout.annotations.push({
        text: `output ${axis}, turning about ${position}`,
        showarrow: false,
        xref: `x${id} domain`,
        yref: `y${id} domain`,
        x: 0,
        y: 1.02,
        xanchor: "left",
        yanchor: "bottom",
        font: { size: 12 },
      });
      const lines = linesOf(comparison.over_rate, axis, [position]);
      const [measured, ...legend] = dots(rows, rows.rate, rows.temperature_c, "deg/s", {
        ...place,
        name: `${axis} about ${position}`,
      });
      return [
        ...lines.flatMap((each) =>
          each.level.map((level, k) =>
            line(...alongRate(each, each.error_dps[k]), `${plainNumber(level, 3)} °C`, colours.of(level), place),
          ),
        ),
        { ...measured, marker: { ...markerOf(measured), size: 4 } },
        ...(panel ? [] : legend),
      ];
    });
    return { data, layout };
  };
  const height =
    60 +
    Math.ceil(panels.length / (isNarrow() ? 1 : positions.length)) * (isNarrow() ? PANEL_PX.narrow : PANEL_PX.wide);
  return figure(
    "Error of every output for every turning axis",
    "Rows: outputs; columns: the axis that is turned. Panels on the diagonal show scale factor errors, the others misalignment and cross effects. Blue is cold, red is hot; each panel has its own scale of errors.",
    draw,
    { height: `${height}px` },
  );
}
