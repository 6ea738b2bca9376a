// Measured and modelled error over rate, over temperature, at rest, and per full turn.

import { get } from "../core/api.js";
import { h } from "../core/elements.js";
import { axisColour, colour, figure, temperatureColour } from "../core/figure.js";
import { plainNumber } from "../core/format.js";
import { cardWithHeader, loadInto, toggleGroup } from "../core/components.js";
import { query, updateQuery } from "../core/router.js";
import { groupLevels } from "./dataset_rows.js";

const VIEWS = [["lines", "Error over rate"], ["warm", "Error over temperature"], ["surface", "Surface"], ["rest", "At rest"], ["turn", "Per full turn"]];
/** Below this rate the table is at rest, deg/s; the Earth turns at 0.004. */
const AT_REST_DPS = 0.01;

export function errorComparison(state, path, signal) {
  const place = h("div", { style: "min-height: 28rem" });
  let view = query().view ?? "lines";
  let columns = null;
  const shown = () => loadInto(place, "Reading the data sets", async () => {
    columns ??= (await get(`${path}/residuals`, { query: { recording: state.recording }, signal })).columns;
    const rows = axisRows(columns, state.axis);
    return FIGURES[view](rows, state, path, signal);
  });
  shown();
  state.onchange((what) => what === "axis" && shown());
  return cardWithHeader("Compare", toggleGroup("What to compare", VIEWS, view, (value) => {
    view = value;
    updateQuery({ view: value === "lines" ? null : value });
    shown();
  }), place);
}

/** The rows of one axis: those in which it lies along the table axis, or all where there are none. */
function axisRows(columns, axis) {
  const all = columns.axis.map((a, k) => (a === axis ? k : -1)).filter((k) => k >= 0);
  const along = all.filter((k) => columns.position[k].replace("-", "") === axis);
  const rows = along.length ? along : all;
  return Object.fromEntries(Object.entries(columns).map(([name, values]) => [name, rows.map((k) => values[k])]));
}

const FIGURES = { lines: (rows, state) => levelFigure(rows, state, "own_rate_dps", "temperature_c", "rate", "deg/s", "deg C"), warm: (rows, state) => levelFigure(rows, state, "temperature_c", "own_rate_dps", "gyro temperature", "deg C", "deg/s"), surface: surfaceFigure, rest: restFigure, turn: turnFigure };

/** The model as a line and the measurement as dots, for each level of the other variable. */
function levelFigure(rows, state, along, by, name, unit, other) {
  const [centres, which] = groupLevels(rows[by], by === "temperature_c" ? 1 : 1e-3, 24);
  const draw = () => ({
    data: centres.flatMap((centre, g) => {
      const here = which.map((w, k) => (w === g ? k : -1)).filter((k) => k >= 0).sort((a, b) => rows[along][a] - rows[along][b]);
      const shade = temperatureColour(centres.length > 1 ? g / (centres.length - 1) : 0.5);
      const x = here.map((k) => rows[along][k]);
      const label = `${plainNumber(centre, 3)} ${other}`;
      return [
        { type: "scatter", mode: "lines", name: label, legendgroup: label, x, y: here.map((k) => rows.modelled_error_dps[k]), line: { color: shade, width: 1.5 }, hoverinfo: "skip" },
        { type: "scatter", mode: "markers", name: `measured at ${label}`, legendgroup: label, showlegend: false, x, y: here.map((k) => rows.measured_error_dps[k]), marker: { color: shade, size: 5 }, customdata: here.map((k) => rows.dataset[k]), hovertemplate: `${label}, data set %{customdata}<br>%{x:.5g} ${unit}: %{y:.4g} deg/s<extra></extra>` },
      ];
    }),
    layout: { xaxis: { title: { text: `${name}, ${unit}` } }, yaxis: { title: { text: "error, deg/s" } }, legend: { orientation: "v", x: 1.01, y: 1, xanchor: "left", yanchor: "top", font: { size: 11 } }, showlegend: centres.length > 1 && window.innerWidth > 760 },
  });
  return figure(`Error over ${name}`, `Dots are measured, lines the model of axis ${state.axis}; cold is blue, hot is red. Where dots leave their line, the model fails.`, draw, { height: "24rem" });
}

async function surfaceFigure(rows, state, path, signal) {
  const grid = (await get(`${path}/surface`, { signal })).axes[state.axis];
  const draw = () => ({
    data: [
      { type: "surface", name: "model", x: grid.rate_dps, y: grid.temperature_c, z: grid.error_dps, colorscale: "Viridis", opacity: 0.85, colorbar: { title: { text: "deg/s" }, thickness: 12 }, hovertemplate: "%{x:.4g} deg/s, %{y:.3g} deg C<br>modelled %{z:.4g} deg/s<extra></extra>" },
      { type: "scatter3d", mode: "markers", name: "measured", x: rows.own_rate_dps, y: rows.temperature_c, z: rows.measured_error_dps, marker: { size: 2.5, color: colour("text") }, hovertemplate: "%{x:.4g} deg/s, %{y:.3g} deg C<br>measured %{z:.4g} deg/s<extra></extra>" },
    ],
    layout: { margin: { l: 0, r: 0, t: 0, b: 0 }, showlegend: false, scene: { xaxis: { title: { text: "rate, deg/s" }, gridcolor: colour("border") }, yaxis: { title: { text: "deg C" }, gridcolor: colour("border") }, zaxis: { title: { text: "error, deg/s" }, gridcolor: colour("border") } } },
  });
  return figure("Error surface", `The model of axis ${state.axis} as a surface, the data sets as dots. Drag to turn it.`, draw, { height: "28rem" });
}

function restFigure(rows, state) {
  const here = rows.own_rate_dps.map((rate, k) => (Math.abs(rate) < AT_REST_DPS ? k : -1)).filter((k) => k >= 0).sort((a, b) => rows.temperature_c[a] - rows.temperature_c[b]);
  if (!here.length) return h("p", { class: "muted" }, "No data set of this recording is at rest.");
  const at = (name) => here.map((k) => rows[name][k]);
  const draw = () => ({
    data: [
      { type: "scatter", mode: "markers", name: "measured", x: at("temperature_c"), y: at("measured_error_dps"), error_y: { type: "data", array: at("floor_dps").map((f) => 2 * f), thickness: 1, width: 0 }, marker: { color: axisColour(state.axis), size: 7 }, hovertemplate: "%{x:.4g} deg C: %{y:.4g} deg/s<extra></extra>" },
      { type: "scatter", mode: "lines", name: "model", x: at("temperature_c"), y: at("modelled_error_dps"), line: { color: colour("text"), width: 1.5 }, hoverinfo: "skip" },
    ],
    layout: { xaxis: { title: { text: "gyro temperature, deg C" } }, yaxis: { title: { text: "output at rest, deg/s" } } },
  });
  return figure("Output at rest", `Axis ${state.axis} at rest over temperature; bars are two noise floors.`, draw, { height: "22rem" });
}

function turnFigure(rows, state) {
  const here = rows.own_rate_dps.map((rate, k) => (Math.abs(rate) > 1 ? k : -1)).filter((k) => k >= 0);
  if (!here.length) return h("p", { class: "muted" }, "No data set of this recording turns fast enough.");
  const perTurn = (name) => here.map((k) => (360 * rows[name][k]) / Math.abs(rows.own_rate_dps[k]));
  const x = here.map((k) => rows.own_rate_dps[k]);
  const shade = here.map((k) => rows.temperature_c[k]);
  const one = (values, name, axis) => ({ type: "scatter", mode: "markers", name, x, y: values, ...axis, marker: { size: 6, color: shade, colorscale: "RdBu", reversescale: true, showscale: !axis, colorbar: { title: { text: "deg C" }, thickness: 12 } }, hovertemplate: "%{x:.4g} deg/s: %{y:.3g} deg per turn<extra></extra>" });
  const draw = () => ({
    data: [one(perTurn("measured_error_dps"), "before", null), one(perTurn("residual_dps"), "after the model", { xaxis: "x2", yaxis: "y2" })],
    layout: {
      grid: { rows: 1, columns: 2, pattern: "independent", xgap: 0.16 }, showlegend: false,
      xaxis: { title: { text: "rate, deg/s" } }, yaxis: { title: { text: "error after 360 deg, deg: before" } },
      xaxis2: { title: { text: "rate, deg/s" } }, yaxis2: { title: { text: "after the model" } },
    },
  });
  return figure("Error after a full turn", "How far a heading is off after one turn about the axis: as the unit is, and with the model. Colours are temperatures.", draw, { height: "22rem" });
}

