// The error over rate and temperature as surfaces on the same axes: measured with the model, and what the model leaves.

import { colour, figure } from "../../core/figure.js";
import { alongRate, linesOf, ownRows, positionsOf, rms, span } from "./rows.js";
import { capitalised, number } from "../../core/format.js";
import { get } from "../../core/http/api.js";
import { h, setChildren } from "../../core/elements.js";
import { loadInto } from "../../core/components.js";
import { query, updateQuery } from "../../core/router.js";
import { asked } from "../chosen_recordings.js";
import { barPlace, linkCameras, sceneLayout, sides, twoScenes } from "./scenes.js";

/** @import { Comparison } from "../../../../types/api.js" */
/** @import { Picture, PlotTrace } from "../../../../types/pages.js" */
/** @import { Rows } from "./rows.js" */
/** @import { Axes } from "./scenes.js" */
/** @import { ExploreState } from "../state.js" */

const SCALE = "Viridis";

/**
 * The surfaces of the version, or its residual beside that of another version, by choice.
 * @param {Comparison} comparison
 * @param {ExploreState} state
 * @param {AbortSignal} signal
 */
export function surfaces(comparison, state, signal) {
  const others = state.versions.filter((version) => version !== state.version);
  if (!others.length) return modelAndResidual(comparison, state);
  const place = h("div", {});
  let beside = others.find((version) => String(version) === query().beside) ?? null;
  async function show() {
    if (beside === null) return setChildren(place, modelAndResidual(comparison, state));
    const version = beside;
    return loadInto(place, `Reading version ${version}`, async () => {
      const other = await get("/api/units/{serial}/calibrations/{version}/comparison", {
        path: { serial: state.serial, version },
        query: asked(state),
        signal,
      });
      return twoVersions([comparison, other], [state.version, version], state.axis);
    });
  }
  const choice = h(
    "select",
    {
      /** @param {Event} event */
      onchange: (event) => {
        beside = Number(/** @type {HTMLSelectElement} */ (event.target).value) || null;
        updateQuery({ beside: beside === null ? null : String(beside) });
        show();
      },
    },
    h("option", { value: "" }, "the measured error and the model"),
    others.map((version) =>
      h("option", { value: String(version), selected: version === beside }, `the residual of version ${version}`),
    ),
  );
  show();
  return h("div", { class: "stack" }, h("label", { class: "field" }, "Beside the residual", choice), place);
}

/**
 * The residuals of two versions of the same recordings, with one scale and one camera.
 * @param {readonly Comparison[]} comparisons
 * @param {readonly number[]} versions
 * @param {string} axis
 */
function twoVersions(comparisons, versions, axis) {
  const all = comparisons.map((each) => ownRows(each, axis));
  /** @returns {Picture} */
  const draw = () => {
    const reach = span(all.flatMap((rows) => rows.residual_dps));
    const shared = { colorscale: SCALE, cmin: reach[0], cmax: reach[1] };
    /** @type {Axes} */
    const axes = {
      x: ["rate, deg/s", span(all.flatMap((rows) => rows.rate))],
      y: ["°C", span(all.flatMap((rows) => rows.temperature_c))],
      z: ["residual, deg/s", reach],
    };
    const bar = {
      showscale: true,
      colorbar: { title: { text: "deg/s" }, thickness: 12, outlinewidth: 0, ...barPlace() },
    };
    return {
      data: all.flatMap((rows, k) => {
        const scene = k ? "scene2" : "scene";
        const surface = residualSurface(rows, shared, scene);
        return [
          ...(surface ? [{ ...surface, ...(k ? {} : bar) }] : []),
          dots(rows, rows.residual_dps, `version ${versions[k]}`, scene),
        ];
      }),
      layout: {
        ...sceneLayout(
          all.map((rows, k) => `version ${versions[k]}: residual, RMS ${number(rms(rows.residual_dps), 2)} deg/s`),
          axes,
        ),
        showlegend: false,
      },
    };
  };
  const element = figure(
    "Residual surfaces of two versions",
    `Axis ${axis} turned about itself: what version ${versions[0]} (${sides()[0]}) and version ${versions[1]} (${sides()[1]}) leave of the same data sets. One scale, one camera: drag either to rotate both.`,
    draw,
    { height: twoScenes() },
  );
  element.ondrawn = linkCameras;
  return element;
}

/**
 * @param {Comparison} comparison
 * @param {ExploreState} state
 */
function modelAndResidual(comparison, state) {
  const rows = ownRows(comparison, state.axis);
  const lines = linesOf(comparison.over_rate, state.axis, positionsOf(rows));
  /** @returns {Picture} */
  const draw = () => {
    const reach = span([
      ...rows.measured_error_dps,
      ...rows.residual_dps,
      ...lines.flatMap((each) => each.error_dps.flat()),
    ]);
    const titles = [
      `before: measured and model, RMS ${number(rms(rows.measured_error_dps), 2)} deg/s`,
      `after: residual, RMS ${number(rms(rows.residual_dps), 2)} deg/s`,
    ];
    const shared = { colorscale: SCALE, cmin: reach[0], cmax: reach[1] };
    /** @type {Axes} */
    const axes = {
      x: ["rate, deg/s", span(rows.rate)],
      y: ["°C", span(rows.temperature_c)],
      z: ["error, deg/s", reach],
    };
    return {
      data: [
        ...lines.map((each, k) => ({
          type: "surface",
          name: "model",
          scene: "scene",
          ...shared,
          showscale: k === 0,
          colorbar: { title: { text: "deg/s" }, thickness: 12, outlinewidth: 0, ...barPlace() },
          opacity: 0.85,
          x: alongRate(each, each.error_dps)[0],
          y: each.level,
          z: each.error_dps,
          hovertemplate: "%{x:.4g} deg/s, %{y:.3g} °C<br>modelled %{z:.4g} deg/s<extra></extra>",
        })),
        dots(rows, rows.measured_error_dps, "measured", "scene"),
        residualSurface(rows, shared, "scene2"),
        dots(rows, rows.residual_dps, "residual", "scene2"),
      ].filter((trace) => trace !== null),
      layout: { ...sceneLayout(titles, axes), showlegend: false },
    };
  };
  const element = figure(
    "Error surface",
    `Axis ${state.axis} turned about itself. ${capitalised(sides()[0])}: the measured error (dots) and the model (surface). ${capitalised(sides()[1])}: the residual of the model. Both plots have the same scale and one camera; drag either to rotate both.`,
    draw,
    { height: twoScenes() },
  );
  element.ondrawn = linkCameras;
  return element;
}

/**
 * @param {Rows} rows
 * @param {readonly number[]} z
 * @param {string} label
 * @param {string} scene
 * @returns {PlotTrace}
 */
const dots = (rows, z, label, scene) => ({
  type: "scatter3d",
  mode: "markers",
  name: label,
  scene,
  x: rows.rate,
  y: rows.temperature_c,
  z,
  marker: { size: 2.5, color: colour("text") },
  customdata: rows.dataset,
  hovertemplate: `data set %{customdata}<br>%{x:.4g} deg/s, %{y:.3g} °C<br>${label} %{z:.4g} deg/s<extra></extra>`,
});

/**
 * The mean residual of each cell as a surface; null where cells do not make a grid.
 * @param {Rows} rows
 * @param {object} shared
 * @param {string} scene
 * @returns {PlotTrace | null}
 */
function residualSurface(rows, shared, scene) {
  const rates = [...new Set(rows.rate_level_dps)].sort((a, b) => a - b);
  const warm = [...new Set(rows.temperature_level_c)].sort((a, b) => a - b);
  /** @type {Map<string, number[]>} */
  const cells = new Map();
  rows.dataset.forEach((_, k) => {
    const id = `${rows.rate_level_dps[k]} ${rows.temperature_level_c[k]}`;
    cells.set(id, [...(cells.get(id) ?? []), rows.residual_dps[k]]);
  });
  if (positionsOf(rows).length > 1 || cells.size < 0.9 * rates.length * warm.length) return null;
  const sign = positionsOf(rows)[0].startsWith("-") ? -1 : 1;
  /** @param {readonly number[] | undefined} values */
  const mean = (values) => (values ? values.reduce((sum, value) => sum + value, 0) / values.length : null);
  return {
    type: "surface",
    name: "residual",
    scene,
    ...shared,
    showscale: false,
    opacity: 0.85,
    x: rates.map((rate) => sign * rate),
    y: warm,
    z: warm.map((level) => rates.map((rate) => mean(cells.get(`${rate} ${level}`)))),
    hoverinfo: "skip",
  };
}
