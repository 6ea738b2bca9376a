// A unit at rest: bias over temperature, heating and cooling told apart, and what a version leaves.

import { h } from "../core/elements.js";
import { axisColour, colour, figure } from "../core/figure.js";
import { ofAxis, shownOf, times } from "./rows.js";

/** @import { Motion, RestColumns } from "../../../types/api.js" */
/** @import { Picture, PlotTrace } from "../../../types/pages.js" */

const K = 2;
/** @type {[leg: string, name: string, symbol: string, shade: string][]} */
const LEGS = [
  ["heating", "heating", "triangle-up", "bad"],
  ["cooling", "cooling", "triangle-down", "accent"],
  ["", "", "circle", ""],
];

/**
 * @param {Motion} found
 * @param {string} axis
 */
export function restFigures(found, axis) {
  if (!found.rest) return null;
  const rows = ofAxis(found.rest, axis);
  const along = alongOf(rows);
  /** @returns {Picture} */
  const bias = () => ({
    data: [...legs(rows, along.x, rows.bias_dps, axis, true), ...modelLine(rows, along.x)],
    layout: { xaxis: { title: { text: along.title } }, yaxis: { title: { text: "bias, deg/s" } } },
  });
  /** @returns {Picture} */
  const residual = () => ({
    data: legs(rows, along.x, rows.residual_dps, axis, true),
    layout: {
      xaxis: { title: { text: along.title } },
      yaxis: { title: { text: "residual of<br>the corrected rate, deg/s" } },
    },
  });
  const both =
    new Set(rows.leg).size > 1
      ? " Triangles pointing up: while the unit warms up; pointing down: while the unit cools."
      : "";
  return h(
    "div",
    { class: "stack" },
    figure(
      "Bias at rest",
      `Axis ${axis}: the output of each data set, or piece of a long one, at rest; bars are the expanded uncertainty of the mean due to white noise, k = 2.${both}${
        found.version === null
          ? ""
          : " Line: the bias by the version, in order of time, with the lag and hysteresis that the version models."
      }${shownOf(found, "rows")}`,
      bias,
      { height: "24rem" },
    ),
    found.version === null
      ? null
      : figure("Residual at rest", `Axis ${axis}: measured bias minus bias by the version.${both}`, residual, {
          height: "17rem",
        }),
  );
}

/** @param {RestColumns} rows */
function alongOf(rows) {
  if (rows.temperature_c.some((value) => value !== null))
    return { x: rows.temperature_c, title: "gyro temperature, °C" };
  if (rows.t_s.some((value) => value !== null)) return { x: times(rows.t_s, 1 / 3600), title: "time, h" };
  return { x: rows.dataset, title: "data set" };
}

/**
 * A trace for each leg.
 * @param {RestColumns} rows
 * @param {readonly (number | null)[]} x
 * @param {readonly (number | null)[]} y
 * @param {string} axis
 * @param {boolean} bars
 * @returns {PlotTrace[]}
 */
function legs(rows, x, y, axis, bars) {
  return LEGS.flatMap(([leg, name, symbol, shade]) => {
    const here = rows.leg.flatMap((each, k) => (each === leg ? [k] : []));
    if (!here.length) return [];
    return [
      {
        type: "scatter",
        mode: "markers",
        name: name || "at rest",
        x: here.map((k) => x[k]),
        y: here.map((k) => y[k]),
        customdata: here.map((k) => rows.dataset[k]),
        error_y: bars
          ? { type: "data", array: here.map((k) => K * (rows.u_dps[k] ?? 0)), thickness: 1, width: 0 }
          : undefined,
        marker: { size: 7, symbol, color: shade ? colour(shade) : axisColour(axis) },
        hovertemplate: `data set %{customdata}<br>%{x:.4g}: %{y:.4g} deg/s<extra>${name}</extra>`,
      },
    ];
  });
}

/**
 * The model at the data sets, in order of time.
 * @param {RestColumns} rows
 * @param {readonly (number | null)[]} x
 * @returns {PlotTrace[]}
 */
function modelLine(rows, x) {
  if (rows.modelled_dps.every((value) => value === null)) return [];
  return [
    {
      type: "scatter",
      mode: "lines",
      name: "model",
      x,
      y: rows.modelled_dps,
      line: { color: colour("text"), width: 1.5 },
      hoverinfo: "skip",
    },
  ];
}
