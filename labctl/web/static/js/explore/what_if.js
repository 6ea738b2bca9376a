// What if: the size of a suspected effect as a slider; what it would leave follows at once. A second effect lies over it.

import { setChildren, h } from "../core/elements.js";
import { axisColour, colour, figure } from "../core/figure.js";
import { faded } from "../core/colour_scales.js";
import { idText, isNumber, number, percent, withUncertainty } from "../core/format.js";
import { notice } from "../core/components.js";
import { option, selectField } from "../core/fields.js";
import { planAddress } from "../core/routes.js";
import { channelTitle, scaled, shownText } from "./dataset_rows.js";
import { channelOf } from "./preview_result.js";
import { hasMap, mapsOf } from "./residual_cells.js";
import { residualMap, selectedRows } from "./residual_map.js";
import { shapeSliders } from "./what_if_shape.js";
import {
  bandOf,
  freeCoefficients,
  leftWith,
  levelMeans,
  partingLevels,
  partingRecipe,
  rmsOf,
} from "./what_if_numbers.js";

/** @import { Parameter, Suspect } from "../../../types/api.js" */
/** @import { Figure, PlotTrace } from "../../../types/pages.js" */
/** @import { ExploreState } from "./state.js" */
/** @import { Values } from "./what_if_numbers.js" */

/** The slider goes from none to twice the fitted size. */
const MAX_SHARE = 2;
const STEP = 0.01;
/** Rates and temperatures of one level agree to this many digits. */
const LEVEL_DIGITS = 2;

/** @param {number} value */
const levelOf = (value) => Number(value.toPrecision(LEVEL_DIGITS));

/**
 * @typedef {object} Shown
 * @property {number} share of the fitted size
 * @property {Values} explained deg/s, what a fit with the effect in the chosen shape takes off
 * @property {boolean} isFitted whether the shape is the fitted one
 * @property {{ name: string, explained: Values } | null} beside the effect that lies over it
 * @property {readonly number[]} parts levels at which the two part
 */

/**
 * @typedef {object} Given
 * @property {ExploreState} state
 * @property {Suspect} suspect
 * @property {readonly Parameter[]} parameters of the effect, with the range of each
 * @property {readonly Suspect[]} others the other suspects, one of which may lie over it
 * @property {Values} explained deg/s, what a fit with the suspect takes off, one for each data set
 * @property {(term: string) => Promise<Values>} explain the same of another effect, or of this one in another shape
 */

/**
 * The part of the page for one suspect.
 * @param {Given} given
 */
export function whatIf({ state, suspect, parameters, others, explained, explain }) {
  const rows = selectedRows(state);
  const channel = channelOf(rows.channels);
  const x = scaled(channel, rows.channels[channel]);
  /** @type {Shown} */
  const shown = { share: 1, explained, isFitted: true, beside: null, parts: [] };
  const left = () => leftWith(rows.residual, shown.explained, shown.share);
  const figures = [
    explainedFigure({
      name: idText(suspect.effect),
      x,
      channel,
      state,
      shown,
      band: bandOf(suspect.coefficients[state.axis] ?? {}),
    }),
    leftFigure({ x, channel, state, left }),
    leftMap(state, left),
  ].filter((each) => each !== null);
  const words = h("output", { class: "what-if-words" });
  const parting = h("div", {});
  const follow = () => {
    setChildren(words, sizeWords(suspect, state, shown, left()));
    for (const each of figures) each.redraw();
  };
  const slider = h("input", {
    type: "range",
    min: "0",
    max: String(MAX_SHARE),
    step: String(STEP),
    value: "1",
    "aria-label": `Size of ${idText(suspect.effect)}, as a share of the fitted size`,
    oninput: (/** @type {Event} */ event) => {
      shown.share = Number(/** @type {HTMLInputElement} */ (event.target).value);
      follow();
    },
  });
  const part = () => {
    shown.parts = shown.beside ? partingOf(state, x, shown.explained, shown.beside.explained) : [];
    setChildren(parting, shown.beside ? partingNotice(state, suspect, shown.beside.name, channel, shown.parts) : null);
  };
  const shape = shapeSliders(suspect, parameters, async (term) => {
    shown.explained = term ? await explain(term) : explained;
    shown.isFitted = term === null;
    part();
    follow();
  });
  const beside = selectField(
    "Lay another effect over it",
    [option("", "none"), ...others.map((each) => option(each.effect, idText(each.effect)))],
    "",
    async (value) => {
      shown.beside = value ? { name: idText(value), explained: await explain(value) } : null;
      part();
      follow();
    },
  );
  follow();
  return h(
    "section",
    { class: "what-if stack", "aria-label": `What if: ${idText(suspect.effect)}` },
    h("h3", {}, `What if: ${idText(suspect.effect)}`),
    h(
      "div",
      { class: "row" },
      h("label", { class: "field what-if-slider" }, `Size of ${idText(suspect.effect)}`, slider),
      words,
    ),
    shape,
    h("div", { class: "columns" }, figures),
    h("div", { class: "row" }, others.length ? beside : null),
    parting,
  );
}

/**
 * The size in words, and what is left with it.
 * @param {Suspect} suspect
 * @param {ExploreState} state
 * @param {Shown} shown
 * @param {Values} left
 */
function sizeWords(suspect, state, { share, isFitted }, left) {
  const coefficients = isFitted ? freeCoefficients(suspect.coefficients[state.axis] ?? {}) : [];
  const sizes = coefficients.map(([name, { value, unit }]) =>
    coefficients.length > 1 ? null : `${idText(name)} ${withUncertainty(share * value, null, unit, name)}`,
  );
  const size = [`${percent(share)} of the fitted size`, ...sizes].filter(Boolean).join(", ");
  const of = shownText(state.criticism) ?? `${left.length} data sets`;
  return `${size}: ${number(rmsOf(left))} deg/s RMS left on axis ${state.axis}, over ${of}${isFitted ? "" : "; the size and all else are fitted again with this shape"}.`;
}

/**
 * A line through the means of levels, times a factor.
 * @param {readonly { x: number, mean: number }[]} levels
 * @param {number} factor
 */
const levelLine = (levels, factor) => ({
  x: levels.map((level) => level.x),
  y: levels.map((level) => factor * level.mean),
});

/**
 * The residual, and the part of it that the effect (and the other one) would explain.
 * @param {object} given
 * @param {string} given.name
 * @param {Values} given.x
 * @param {string} given.channel
 * @param {ExploreState} given.state
 * @param {Shown} given.shown
 * @param {number | null} given.band
 * @returns {Figure}
 */
function explainedFigure({ name, x, channel, state, shown, band }) {
  const rows = selectedRows(state);
  /**
   * @param {number} factor
   * @param {object} more
   * @returns {PlotTrace}
   */
  const line = (factor, more) => ({
    type: "scatter",
    mode: "lines",
    ...levelLine(levelMeans(x, shown.explained, levelOf), factor),
    hoverinfo: "skip",
    ...more,
  });
  const shade = { showlegend: false, line: { width: 0 } };
  const draw = () => {
    const { share, beside, parts } = shown;
    const others = beside ? levelMeans(x, beside.explained, levelOf) : [];
    /** @type {PlotTrace[]} */
    const data = [
      {
        type: "scatter",
        mode: "markers",
        name: "residual without it",
        x,
        y: rows.residual,
        marker: { size: 5, color: colour("border-strong") },
        hovertemplate: "%{x:.5g}: %{y:.3g} deg/s<extra></extra>",
      },
    ];
    if (band !== null && shown.isFitted)
      data.push(
        line(share * (1 - band), { ...shade, name: "band, from" }),
        line(share * (1 + band), {
          ...shade,
          name: "band, to",
          fill: "tonexty",
          fillcolor: faded(colour("accent"), 0.3),
        }),
      );
    data.push(line(share, { name, line: { color: colour("accent"), width: 2.5 } }));
    if (beside)
      data.push({
        type: "scatter",
        mode: "lines",
        name: beside.name,
        x: others.map((level) => level.x),
        y: others.map((level) => level.mean),
        line: { color: colour("warn"), width: 2.5, dash: "dash" },
        hoverinfo: "skip",
      });
    return {
      data,
      layout: {
        xaxis: { title: { text: channelTitle(channel) } },
        yaxis: { title: { text: "residual of<br>the fitted model, deg/s" } },
        shapes: parts.map((at) => ({
          type: "line",
          yref: "paper",
          y0: 0,
          y1: 1,
          x0: at,
          x1: at,
          line: { color: faded(colour("warn"), 0.45), width: 3 },
        })),
        margin: { l: 76, r: 8, t: 34, b: 44 },
        showlegend: true,
      },
    };
  };
  return figure(
    "What the effect would explain",
    band === null
      ? "The lines are means over each level. Several coefficients change together; their band is not drawn."
      : "The lines are means over each level; shaded: the fitted size within its uncertainty, k = 2.",
    draw,
    { height: "17rem" },
  );
}

/**
 * What is left with the effect.
 * @param {{ x: Values, channel: string, state: ExploreState, left: () => Values }} given
 * @returns {Figure}
 */
function leftFigure({ x, channel, state, left }) {
  const reach = 1.08 * Math.max(...selectedRows(state).residual.map((value) => Math.abs(value ?? 0)), 1e-12);
  return figure(
    "What would be left",
    null,
    () => ({
      data: [
        {
          type: "scatter",
          mode: "markers",
          name: "left with it",
          x,
          y: [...left()],
          marker: { size: 6, color: axisColour(state.axis), opacity: 0.75 },
          hovertemplate: "%{x:.5g}: %{y:.3g} deg/s<extra></extra>",
        },
      ],
      layout: {
        xaxis: { title: { text: channelTitle(channel) } },
        yaxis: { title: { text: "left with this size,<br>deg/s" }, range: [-reach, reach] },
        margin: { l: 76, r: 8, t: 34, b: 44 },
      },
    }),
    { height: "17rem" },
  );
}

/**
 * The map of what is left, where there is a map.
 * @param {ExploreState} state
 * @param {() => Values} left
 */
function leftMap(state, left) {
  if (!hasMap(state)) return null;
  const maps = mapsOf(state.criticism, state.axis);
  const rows = selectedRows(state);
  return residualMap(
    "What would be left over floor",
    null,
    () => {
      const values = left();
      const of = new Map(rows.dataset.map((set, k) => [set, values[k]]));
      return {
        maps: maps.map((map) => ({
          ...map,
          over_floor: map.dataset.map((set, k) => {
            const value = of.get(set) ?? map.residual_dps[k];
            return map.residual_dps[k] ? (value * map.over_floor[k]) / map.residual_dps[k] : 0;
          }),
        })),
      };
    },
    { height: "17rem" },
  );
}

/**
 * The levels of the channel where two effects, each of its fitted size, part.
 * @param {ExploreState} state
 * @param {Values} x
 * @param {Values} one
 * @param {Values} other
 */
function partingOf(state, x, one, other) {
  const floor = state.criticism.error.noise_floor_dps;
  return floor ? partingLevels(levelMeans(x, one, levelOf), levelMeans(x, other, levelOf), floor) : [];
}

/**
 * Where the two part, in words, and the plan that measures there.
 * @param {ExploreState} state
 * @param {Suspect} suspect
 * @param {string} other
 * @param {string} channel
 * @param {readonly number[]} parts
 */
function partingNotice(state, suspect, other, channel, parts) {
  const name = idText(suspect.effect);
  if (!parts.length)
    return notice(
      "warn",
      `In these data ${name} and ${other} explain the same within three times the noise of each mean: they cannot be distinguished here.`,
    );
  const rows = selectedRows(state);
  const listed = parts.map((value) => number(value, 2)).join(", ");
  const temperatures = levelMeans(rows.channels.temperature_c, rows.channels.temperature_c, Math.round);
  const at = [0, Math.floor(temperatures.length / 2), temperatures.length - 1].map((k) => temperatures[k]?.x);
  const temperatures_c = [...new Set(at)].filter(isNumber); // the ends and the middle: what models of temperature need
  const plan =
    channel === "table_rate_dps" && temperatures_c.length
      ? partingRecipe({
          name: `${suspect.effect}-or-${other}`,
          rates_dps: parts,
          temperatures_c,
          positions: [...new Set(rows.position)].filter(Boolean),
        })
      : null;
  return notice(
    "",
    h("p", {}, `${name} and ${other} part at ${channelTitle(channel)}: ${listed} (marked in the figure).`),
    plan
      ? h("a", { class: "button tiny", href: planAddress(plan, state.serial, state.version) }, "Plan these rates")
      : null,
  );
}
