// The error of each version down to the noise floor, and the residual maps of this version and its parent.

import { get } from "../core/http/api.js";
import { setChildren, h } from "../core/elements.js";
import { colour, figure } from "../core/figure.js";
import { capitalised, isNumber, number, idText } from "../core/format.js";
import { button, cardWithHeader, loadInto, modelName, table } from "../core/components.js";
import { asked, recordingsText } from "./chosen_recordings.js";
import { axisNames } from "./dataset_rows.js";
import { finishLine, stepOf } from "./finish_line.js";
import { heldOutName } from "./first_models.js";
import { errorOn } from "./ladder_error.js";
import { ticksOf } from "../core/log_ticks.js";
import { hasMap, mapsOf, SCALE_TEXT } from "./residual_cells.js";
import { residualMap } from "./residual_map.js";

/** @import { Ladder, RecordingRow } from "../../../types/api.js" */
/** @import { ExploreState } from "./state.js" */

/** The raw error is hidden at first where it is more than this factor above the fitted errors and would flatten their lines. */
const RAW_ERROR_RATIO = 10;
/** Room for the words beside the line of the noise floor. */
const FLOOR_PX = 48;

/**
 * @param {Ladder} ladder
 * @param {RecordingRow["motion"]} [motion] what moved the unit
 */
export function ladderFigure(ladder, motion) {
  const steps = ladder.steps;
  const fittedTo = recordingsText({ recording: ladder.recording ?? 0, recordings: ladder.recordings ?? [] });
  const left = heldOutName(motion).replace("at ", "").replace(" left out", "");
  const sizes = steps.flatMap((step) => [step.rms_dps, step.heldout_rms_dps, ladder.noise_floor_dps]).filter(isNumber);
  const x = steps.map((step) => `v${step.version}`);
  const dwarfs =
    Math.max(...steps.map((step) => step.raw_rms_dps ?? 0)) >
    RAW_ERROR_RATIO * Math.max(...steps.map((step) => step.rms_dps ?? 0));
  /**
   * @param {"raw_rms_dps" | "rms_dps" | "heldout_rms_dps"} key
   * @param {string} name
   * @param {object} line
   * @param {string} symbol
   */
  const line = (key, name, line, symbol) => ({
    type: "scatter",
    mode: "lines+markers",
    name,
    x,
    y: steps.map((step) => step[key]),
    line,
    marker: { size: 9, symbol },
    text: steps.map((step) => `${step.model}: ${step.effects.map(idText).join(", ")}`),
    hovertemplate: "%{text}<br>%{y:.4g} deg/s<extra>%{fullData.name}</extra>",
  });
  const draw = () => ({
    data: [
      {
        ...line("raw_rms_dps", "without correction", { color: colour("border-strong"), dash: "dot" }, "diamond-open"),
        visible: dwarfs ? "legendonly" : true,
      },
      line("rms_dps", "after the fit", { color: colour("accent"), width: 2.5 }, "circle"),
      ...(steps.some((step) => step.heldout_rms_dps !== null)
        ? [line("heldout_rms_dps", heldOutName(motion), { color: colour("warn"), width: 2.5 }, "square")]
        : []),
    ],
    layout: {
      yaxis: { type: "log", title: { text: "RMS error, deg/s" }, ...ticksOf(sizes), tickformat: "~g" },
      xaxis: { type: "category" },
      margin: { l: 58, r: FLOOR_PX, t: 12, b: 44 },
      shapes: ladder.noise_floor_dps
        ? [
            {
              type: "line",
              xref: "paper",
              x0: 0,
              x1: 1,
              y0: ladder.noise_floor_dps,
              y1: ladder.noise_floor_dps,
              line: { color: colour("good"), dash: "dash" },
            },
          ]
        : [],
      annotations: ladder.noise_floor_dps
        ? [
            {
              xref: "paper",
              x: 1,
              xshift: 4,
              y: Math.log10(ladder.noise_floor_dps),
              text: "noise<br>floor", // beside the line: on it, it would lie over a version that reaches the floor
              align: "left",
              showarrow: false,
              xanchor: "left",
              yanchor: "middle",
              font: { color: colour("good"), size: 12 },
            },
          ]
        : [],
    },
  });
  return figure(
    "Error ladder",
    `The versions fitted to ${fittedTo}: each one's RMS error on that data and on ${left} left out of its fit, down to the noise floor. An error that falls on the fitted data only is overfitting.`,
    draw,
    { height: "19rem" },
  );
}

/**
 * @param {ExploreState} state
 * @param {AbortSignal} signal
 */
export function errorLadder(state, signal) {
  const place = h("div", { class: "stack" });
  const { serial } = state;
  loadInto(place, "RMS error by version", async () => {
    const ladder = await get("/api/units/{serial}/ladder", { path: { serial }, signal });
    const here = ladder.steps.find((step) => step.version === state.version);
    const parts = [ladderFigure(ladder, state.motion), versionTable(ladder, state), replay(ladder)];
    if (here?.parent && hasMap(state)) parts.push(await faded(here.parent));
    return h("div", { class: "stack" }, parts);
  });

  /**
   * The versions that led to this one, each criticised on the same data, one after the other.
   * @param {Ladder} ladder
   */
  function replay(ladder) {
    const line = versionsTo(ladder, state.version);
    if (line.length < 2 || !axisNames(state.criticism).length) return null;
    const show = h("div", {});
    const play = button(`Replay versions ${line.join(", ")}`, async () => {
      const criticisms = await Promise.all(
        line.map((version) =>
          version === state.version
            ? state.criticism
            : get("/api/units/{serial}/calibrations/{version}/criticism", {
                path: { serial, version },
                query: asked(state),
                signal,
              }),
        ),
      );
      const steps = criticisms.map((each, k) => stepOf(state, each, line[k]));
      const played = finishLine(state, steps, `Versions ${line.join(", ")}`);
      setChildren(show, played.element);
      await played.play();
    });
    return h("div", { class: "stack" }, h("div", { class: "row" }, play), show);
  }

  /** @param {number} parent */
  async function faded(parent) {
    const before = await get("/api/units/{serial}/calibrations/{version}/criticism", {
      path: { serial, version: parent },
      query: asked(state),
      signal,
    });
    const pair = () => [mapsOf(before, state.axis), mapsOf(state.criticism, state.axis)];
    /**
     * @param {number} k
     * @param {string} name
     */
    const one = (k, name) =>
      residualMap(name, SCALE_TEXT, () => ({ maps: pair()[k] }), {
        height: "16rem",
      });
    const both = [one(0, `Version ${parent}`), one(1, `Version ${state.version}`)];
    state.onchange((what) => what === "axis" && both.forEach((each) => each.redraw()));
    return h(
      "div",
      { class: "columns" },
      both.map((each, k) =>
        h(
          "div",
          {},
          h("h3", {}, k ? `Version ${state.version}: residual now` : `Version ${parent}: residual before`),
          each,
        ),
      ),
    );
  }

  return cardWithHeader("Error of the versions", null, place);
}

/**
 * The versions from the first one that led to `version`, up to it.
 * @param {Ladder} ladder
 * @param {number} version
 */
export function versionsTo(ladder, version) {
  const parents = new Map(ladder.steps.map((step) => [step.version, step.parent]));
  /** @type {number[]} */
  const line = [];
  for (let at = /** @type {number | null | undefined} */ (version); at && parents.has(at); at = parents.get(at))
    line.unshift(at);
  return line;
}

/**
 * @param {Ladder} ladder
 * @param {ExploreState} state
 */
function versionTable(ladder, state) {
  return table(
    [
      {
        title: "Version",
        cell: (step) =>
          step.version === state.version
            ? h("strong", {}, `${step.version}`)
            : h(
                "a",
                { href: `/explore?unit=${encodeURIComponent(state.serial)}&version=${step.version}` },
                `${step.version}`,
              ),
      },
      {
        title: "Model",
        cell: (step) =>
          h(
            "span",
            {},
            modelName(step.model),
            h("span", { class: "muted small" }, step.parent ? ` from version ${step.parent}` : ""),
          ),
      },
      { title: "Effects", cell: (step) => step.effects.map(idText).join(", ") },
      {
        title: "Recording",
        number: true,
        cell: (step) => (step.recordings?.length ? step.recordings : [step.recording ?? "–"]).join(", "),
      },
      { title: "RMS, deg/s", number: true, cell: (step) => number(step.rms_dps) },
      {
        title: `${capitalised(heldOutName(state.motion).replace("at ", ""))}, deg/s`,
        number: true,
        cell: (step) => number(step.heldout_rms_dps),
      },
      ladder.others.length
        ? {
            title: `Without refitting, on recording ${ladder.recording}, deg/s`,
            number: true,
            cell: (step) => number(errorOn(ladder.recording, step)),
          }
        : null,
    ],
    [...ladder.steps, ...ladder.others],
    { label: "Versions", selected: (step) => step.version === state.version },
  );
}
