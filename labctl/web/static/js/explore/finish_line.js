// From one version to the next: every residual moves from what was left to what is left now, the error runs down to the
// noise floor. The numbers at rest are those of the service; what is shown in between is drawn between them.

import { setChildren, h, wantsLessMotion } from "../core/elements.js";
import { axisColour, colour, figure } from "../core/figure.js";
import { drawnBy, loadPlotly } from "../core/plotly.js";
import { isNumber, number, percent, plainNumber } from "../core/format.js";
import { button, card } from "../core/components.js";
import { roundSizes } from "../core/log_ticks.js";
import { channelTitle, inDatasetOrder, scaled, setText, shownText } from "./dataset_rows.js";
import { channelOf } from "./preview_result.js";
import { hasMap, mapsOf, SCALE_TEXT } from "./residual_cells.js";
import { residualMap, selectedRows } from "./residual_map.js";

/** @import { Criticism, Preview, ResidualMap } from "../../../types/api.js" */
/** @import { Child, Figure } from "../../../types/pages.js" */
/** @import { ExploreState } from "./state.js" */

/**
 * What a version leaves: of each data set in the order of the criticism, on the map, and as RMS over all axes.
 * @typedef {{ title: string, rms_dps: number | null, residual_dps: readonly (number | null)[], maps: ResidualMap[] }} Step
 */

/** From one version to the next, and how long each is shown, ms. */
const MOVE_MS = 1400;
const REST_MS = 500;
/** The map is drawn again so many times on the way; it has hundreds of cells. */
const MAP_STEPS = 8;

/**
 * What the version of the page leaves.
 * @param {ExploreState} state
 * @param {Criticism} [criticism] of another version, on the same data
 * @param {number} [version]
 * @returns {Step}
 */
export function stepOf(state, criticism = state.criticism, version = state.version) {
  return {
    title: `Version ${version}`,
    rms_dps: criticism.error.rms_dps,
    residual_dps: selectedRows({ criticism, axis: state.axis }).residual,
    maps: hasMap(state) ? mapsOf(criticism, state.axis) : [],
  };
}

/**
 * What a changed model leaves, before it is criticised: each data set keeps its noise floor.
 * @param {ExploreState} state
 * @param {Preview} preview
 * @param {number} version
 * @returns {Step}
 */
export function stepOfPreview(state, preview, version) {
  const residual_dps = inDatasetOrder(state, preview.residuals, "residual_dps");
  const rows = selectedRows(state);
  const after = new Map(rows.dataset.map((set, k) => [set, residual_dps[k]]));
  const maps = stepOf(state).maps.map((map) => {
    const left = map.dataset.map((set, k) => after.get(set) ?? map.residual_dps[k]);
    const over_floor = left.map((value, k) =>
      map.residual_dps[k] ? (value * map.over_floor[k]) / map.residual_dps[k] : 0,
    );
    return { ...map, residual_dps: left, over_floor };
  });
  return { title: `Version ${version}`, rms_dps: preview.error.rms_dps, residual_dps, maps };
}

/**
 * Between two steps; `share` 0 is the first, 1 the second. Errors move as their logarithm: each tenth is as far.
 * @param {Step} from
 * @param {Step} to
 * @param {number} share
 * @returns {Step}
 */
export function between(from, to, share) {
  if (share <= 0) return from;
  if (share >= 1) return to;
  /**
   * @param {number | null} a
   * @param {number | null} b
   */
  const mixed = (a, b) => (a === null || b === null ? null : a + share * (b - a));
  return {
    title: to.title,
    rms_dps: from.rms_dps && to.rms_dps ? from.rms_dps * (to.rms_dps / from.rms_dps) ** share : to.rms_dps,
    residual_dps: from.residual_dps.map((value, k) => mixed(value, to.residual_dps[k])),
    maps: from.maps.map((map, k) => ({
      ...map,
      over_floor: map.over_floor.map((value, j) => value + share * (to.maps[k].over_floor[j] - value)),
    })),
  };
}

/**
 * A card that plays `steps`, the first of which is the version before. Its figures end as the last step. `settle` is
 * called with what is to be said at the end.
 * @param {ExploreState} state
 * @param {readonly Step[]} steps
 * @param {string} title
 */
export function finishLine(state, steps, title) {
  const floor = state.criticism.error.noise_floor_dps;
  const last = steps[steps.length - 1];
  let shown = steps[0];
  const counter = h("span", { class: "finish-counter number" });
  const name = h("span", { class: "muted" });
  const bar = errorBar(steps, floor);
  const dots = residualDots(state, () => shown, steps[0]);
  const map = !shown.maps.length
    ? null
    : residualMap("Residual over floor from version to version", SCALE_TEXT, () => ({ maps: shown.maps }), {
        height: "16rem",
      });
  /**
   * @param {Step} step
   * @param {boolean} withMap
   */
  const show = (step, withMap) => {
    shown = step;
    setChildren(counter, number(step.rms_dps));
    setChildren(name, step.title);
    bar.show(step.rms_dps);
    dots.move(step.residual_dps);
    if (withMap) map?.redraw();
  };
  let playing = 0;
  async function play() {
    const turn = (playing += 1);
    await loadPlotly();
    for (let k = 1; k < steps.length && turn === playing; k += 1) {
      show(steps[k - 1], true);
      if (!wantsLessMotion()) await moved(steps[k - 1], steps[k], show, () => turn === playing);
    }
    if (turn === playing) show(last, true);
  }
  show(wantsLessMotion() ? last : steps[0], false);
  const end = h("div", { class: "stack", role: "status" });
  const element = card(
    title,
    h("p", { class: "finish-error" }, counter, " deg/s ", h("span", { class: "muted" }, "RMS error, "), name),
    bar.element,
    h("p", { class: "muted small" }, gainText(steps[0], last)),
    h("div", { class: "columns" }, dots.element, map),
    h("div", { class: "row" }, button("Play again", play, { kind: "tiny" })),
    end,
  );
  element.id = "finish";
  return {
    element,
    play,
    /** @param {...Child} children */
    settle: (...children) => setChildren(end, ...children),
  };
}

/**
 * Show what lies between two steps until the second is reached.
 * @param {Step} from
 * @param {Step} to
 * @param {(step: Step, withMap: boolean) => unknown} show
 * @param {() => boolean} goesOn
 */
async function moved(from, to, show, goesOn) {
  const pause = () => new Promise((resolve) => setTimeout(resolve, REST_MS));
  await pause();
  const begin = performance.now();
  let drawn = 0;
  for (;;) {
    const share = Math.min((performance.now() - begin) / MOVE_MS, 1);
    const eased = share * share * (3 - 2 * share);
    const part = Math.floor(share * MAP_STEPS);
    if (!goesOn()) return;
    show(between(from, to, eased), part > drawn);
    drawn = part;
    if (share >= 1) break;
    await new Promise(requestAnimationFrame);
  }
  await pause();
}

/**
 * @param {Step} before
 * @param {Step} after
 */
function gainText(before, after) {
  if (!before.rms_dps || !after.rms_dps) return null;
  const share = 1 - after.rms_dps / before.rms_dps;
  const change = share >= 0 ? `${percent(share)} less` : `${percent(-share)} more`;
  return `${before.title}: ${number(before.rms_dps)} deg/s. ${after.title}: ${number(after.rms_dps)} deg/s, ${change}.`;
}

/** What the length of the bar is. */
const SCALE_OF_BAR = "RMS error, deg/s, on a logarithmic scale";

/**
 * The error on a logarithmic line with its figures, and with the mark of the noise floor.
 * @param {readonly Step[]} steps
 * @param {number | null} floor
 */
function errorBar(steps, floor) {
  const sizes = [...steps.map((step) => step.rms_dps), floor].filter(isNumber).filter((size) => size > 0);
  const [low, high] = [Math.log(Math.min(...sizes) / 1.6), Math.log(Math.max(...sizes) * 1.05)];
  /** @param {number | null} size */
  const place = (size) => (size ? Math.max(0, Math.min((Math.log(size) - low) / (high - low), 1)) : 0);
  const ticks = roundSizes(Math.exp(low), Math.exp(high)).map((size) =>
    h("span", { class: "finish-tick small", style: `left: ${100 * place(size)}%` }, plainNumber(size)),
  );
  const fill = h("i", {});
  const mark = h(
    "span",
    { class: "finish-floor", style: `left: ${100 * place(floor)}%` },
    h("span", { class: "small" }, `noise floor ${number(floor)}`),
  );
  return {
    element: h(
      "div",
      { class: "finish-bar", role: "group", "aria-label": SCALE_OF_BAR },
      floor ? mark : null,
      h("div", { class: "meter thick" }, fill),
      h("div", { class: "finish-ticks muted", "aria-hidden": "true" }, ticks),
      h("p", { class: "muted small" }, SCALE_OF_BAR),
    ),
    /** @param {number | null} size */
    show: (size) => {
      fill.style.width = `${100 * place(size)}%`;
    },
  };
}

/**
 * The residual of each data set, in the scale of the first step, so that one sees it fall.
 * @param {ExploreState} state
 * @param {() => Step} shown
 * @param {Step} first
 * @returns {{ element: Figure, move: (residual: readonly (number | null)[]) => unknown }}
 */
function residualDots(state, shown, first) {
  const rows = selectedRows(state);
  const channel = channelOf(rows.channels);
  const reach = 1.08 * Math.max(...first.residual_dps.map((value) => Math.abs(value ?? 0)), 1e-12);
  const element = figure(
    "Residual from version to version",
    shownText(state.criticism),
    () => ({
      data: [
        {
          type: "scatter",
          mode: "markers",
          name: shown().title,
          x: scaled(channel, rows.channels[channel]),
          y: [...shown().residual_dps],
          text: rows.dataset.map((_, k) => setText(rows, k)),
          hovertemplate: "%{text}<br>%{x:.5g}: %{y:.3g} deg/s<extra></extra>",
          marker: { size: 6, color: axisColour(state.axis), opacity: 0.75 },
        },
      ],
      layout: {
        xaxis: { title: { text: channelTitle(channel) } },
        yaxis: { title: { text: "residual of<br>the fitted model, deg/s" }, range: [-reach, reach] },
        shapes: [
          { type: "line", xref: "paper", x0: 0, x1: 1, y0: 0, y1: 0, line: { color: colour("good"), width: 1 } },
        ],
        margin: { l: 76, r: 8, t: 8, b: 44 },
      },
    }),
    { height: "16rem" },
  );
  return {
    element,
    move: (residual) => element.plot.data && drawnBy(element.plot).restyle(element.plot, { y: [[...residual]] }, [0]),
  };
}

/** @type {{ serial: string, version: number, card: ReturnType<typeof finishLine> } | null} */
let kept = null;
/**
 * Keep a card for the page of the version that was made.
 * @param {string} serial
 * @param {number} version
 * @param {ReturnType<typeof finishLine>} made
 */
export function keepFor(serial, version, made) {
  kept = { serial, version, card: made };
}

/**
 * The card that was kept for this page, once; null for every other page.
 * @param {string} serial
 * @param {number} version
 */
export function takeKept(serial, version) {
  const found = kept?.serial === serial && kept.version === version ? kept.card : null;
  kept = null;
  return found;
}
