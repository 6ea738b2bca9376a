// The course of a unit over its recordings: what a version leaves, the line through it with its interval, the limit.

import { faded } from "../core/colour_scales.js";
import { axisColour, colour, figure } from "../core/figure.js";
import { pointPlace, selectPoints } from "../core/figure_point.js";
import { isNumber } from "../core/format.js";
import { ticksOf } from "../core/log_ticks.js";
import { shownUnit } from "../core/shown_unit.js";
import { trendPoint } from "./point.js";

/** @import { Drift, Trend, TrendPoint } from "../../../types/api.js" */
/** @import { Picture, PlotTrace } from "../../../types/pages.js" */
/** @import { Quantity } from "./point.js" */

const K = 2;

/** @typedef {"bias" | "scale_factor"} What */
/** @typedef {{ recording: number[], at: string[], value: number[], u: number[] }} Series */

/**
 * What the version leaves on an axis, recording by recording.
 * @param {readonly TrendPoint[]} points
 * @param {string} axis
 * @param {What} what
 * @returns {Series}
 */
export function seriesOf(points, axis, what) {
  /** @type {Series} */
  const found = { recording: [], at: [], value: [], u: [] };
  for (const point of points) {
    const left = point.axes[axis];
    const value = what === "bias" ? left?.bias_dps : left?.scale_factor;
    if (value === null || value === undefined) continue;
    found.recording.push(point.recording);
    found.at.push(point.at);
    found.value.push(value);
    found.u.push((what === "bias" ? left.u_bias_dps : left.u_scale_factor) ?? 0);
  }
  return found;
}

/**
 * @param {string} serial
 * @param {Trend} trend
 * @param {What} what
 * @param {ReturnType<typeof pointPlace>} place where a selected point is shown
 */
export function driftFigure(serial, trend, what, place) {
  const lines = trend.drifts.filter((drift) => drift.what === what);
  const axes = [...new Set(trend.points.flatMap((point) => Object.keys(point.axes)))].sort();
  const share = what === "scale_factor";
  const [factor, unit] = shownUnit(share ? "1" : "deg/s", what);
  /** @returns {Picture} */
  const draw = () => ({
    data: [
      ...lines.flatMap((drift) => band(drift, factor)),
      ...axes.map((axis) => measured(seriesOf(trend.points, axis, what), axis, factor, unit)),
      ...(share ? [] : limits(trend, lines)),
    ],
    layout: {
      xaxis: { type: "date" },
      yaxis: { title: { text: `${share ? "scale factor" : "bias"} left, ${unit}` } },
      showlegend: true,
    },
  });
  const drawn = figure(
    share ? "Scale factor over the years" : "Bias over the years",
    `Error of the ${share ? "scale factor" : "bias"} that remains on each recording with version ${trend.version}, not refitted; bars are expanded uncertainties, k = 2. Line and band: drift with its 95 % interval, valid only if the unit continues to age as before.${
      share || trend.limit_dps === null ? "" : " Dashed: the limit."
    } Click a point to see what it is made of.`,
    draw,
    { height: "19rem" },
  );
  selectPoints(drawn, place, (series, k) => {
    const axis = String(drawn.plot.data?.[series].name ?? "").replace(/^axis /, "");
    const recording = axes.includes(axis) ? seriesOf(trend.points, axis, what).recording[k] : undefined;
    return recording === undefined ? null : trendPoint(serial, trend.version, recording, what, axis);
  });
  return drawn;
}

/**
 * @param {Series} series
 * @param {string} axis
 * @param {number} factor
 * @param {string} unit
 * @returns {PlotTrace}
 */
const measured = (series, axis, factor, unit) => ({
  type: "scatter",
  mode: "markers",
  name: `axis ${axis}`,
  x: series.at,
  y: series.value.map((value) => factor * value),
  customdata: series.recording,
  error_y: { type: "data", array: series.u.map((u) => K * factor * u), thickness: 1, width: 3 },
  marker: { size: 8, color: axisColour(axis) },
  hovertemplate: `recording %{customdata}<br>%{x|%d %b %Y}: %{y:.4g} ${unit}<extra>axis ${axis}</extra>`,
});

/**
 * A drift as a line, and its interval where one is known.
 * @param {Drift} drift
 * @param {number} factor
 * @returns {PlotTrace[]}
 */
function band(drift, factor) {
  const shade = axisColour(drift.axis);
  /** @param {readonly (number | null)[]} values */
  const scaled = (values) => values.map((value) => (value === null ? null : factor * value));
  /** @param {readonly (number | null)[]} y */
  const edge = (y) => ({
    type: "scatter",
    mode: "lines",
    x: drift.line.at,
    y: scaled(y),
    line: { width: 0 },
    hoverinfo: "skip",
    showlegend: false,
  });
  const known = drift.line.low.some((value) => value !== null);
  return [
    ...(known
      ? [
          { ...edge(drift.line.low), name: `low ${drift.axis}` },
          {
            ...edge(drift.line.high),
            name: `high ${drift.axis}`,
            fill: "tonexty",
            fillcolor: faded(shade, 0.16),
          },
        ]
      : []),
    {
      type: "scatter",
      mode: "lines",
      name: `drift ${drift.axis}`,
      x: drift.line.at,
      y: scaled(drift.line.value),
      line: { color: shade, width: 1.5 },
      hoverinfo: "skip",
      showlegend: false,
    },
  ];
}

/**
 * @param {Trend} trend
 * @param {readonly Drift[]} lines
 * @returns {PlotTrace[]}
 */
function limits({ limit_dps: limit, points }, lines) {
  if (limit === null || !points.length) return [];
  const until = lines[0]?.line.at.at(-1) ?? points[points.length - 1].at;
  return [limit, -limit].map((y, k) => ({
    type: "scatter",
    mode: "lines",
    name: "limit",
    x: [points[0].at, until],
    y: [y, y],
    line: { color: colour("bad"), dash: "dash", width: 1.2 },
    showlegend: k === 0,
    hovertemplate: `limit ${y} deg/s<extra></extra>`,
  }));
}

/** The series of the figure of errors, in the order in which they are drawn. @type {readonly Quantity[]} */
const ERRORS = ["as_found", "as_left", "error"];

/**
 * @param {string} serial
 * @param {Trend} trend
 * @param {ReturnType<typeof pointPlace>} place where a selected point is shown
 */
export function errorFigure(serial, trend, place) {
  /**
   * @param {string} name
   * @param {(point: TrendPoint) => { version: number, rms_dps: number } | null} of
   * @param {string} symbol
   * @param {string} shade
   * @returns {PlotTrace}
   */
  const series = (name, of, symbol, shade) => {
    const known = trend.points.flatMap((point) => {
      const applied = of(point);
      return applied ? [{ ...applied, at: point.at, recording: point.recording }] : [];
    });
    return {
      type: "scatter",
      mode: "markers",
      name,
      x: known.map(({ at }) => at),
      y: known.map(({ rms_dps }) => rms_dps),
      customdata: known.map(({ recording }) => recording),
      text: known.map(({ recording, version }) => `version ${version} on recording ${recording}`),
      marker: { size: symbol.endsWith("open") ? 14 : 9, symbol, color: shade },
      hovertemplate: "%{text}<br>%{y:.4g} deg/s<extra>%{fullData.name}</extra>",
    };
  };
  const sizes = () =>
    trend.points.flatMap(({ as_found, as_left, rms_dps }) =>
      [as_found?.rms_dps, as_left?.rms_dps, rms_dps].filter(isNumber),
    );
  /** @returns {Picture} */
  const draw = () => ({
    data: [
      series("as found", (point) => point.as_found, "circle", colour("bad")),
      series("as left", (point) => point.as_left, "square", colour("good")),
      series(
        `version ${trend.version}`,
        ({ rms_dps }) => (rms_dps === null ? null : { version: trend.version, rms_dps }),
        "diamond-open",
        colour("accent"),
      ),
    ],
    layout: {
      xaxis: { type: "date" },
      yaxis: { type: "log", title: { text: "RMS error, deg/s" }, ...ticksOf(sizes()) },
      showlegend: true,
    },
  });
  const drawn = figure(
    "Error over the years",
    `As found: error on each recording of the newest version that was fitted only to recordings made before it. As left: error of the newest version that was fitted to the recording itself. Diamonds: error of version ${trend.version} on every recording.`,
    draw,
    { height: "19rem" },
  );
  selectPoints(drawn, place, (series, k) => {
    const recording = /** @type {number[] | undefined} */ (drawn.plot.data?.[series].customdata)?.[k];
    return recording === undefined ? null : trendPoint(serial, trend.version, recording, ERRORS[series]);
  });
  return drawn;
}
