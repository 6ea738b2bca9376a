// A version compared with recordings: verdict, comparison, diagnostics, suspects, change, ladder; shown when computed.

import { get, getFollowed, post } from "../core/http/api.js";
import { isAbort } from "../core/http/errors.js";
import { whenItMayPass } from "../core/http/recovery.js";
import { setChildren, h } from "../core/elements.js";
import { busyIndicator, errorPage } from "../core/components.js";
import { option, toggleGroup } from "../core/fields.js";
import { duration } from "../core/format.js";
import { show } from "../core/router.js";
import { jointCard } from "../joint/card.js";
import { asked as askedFor } from "./chosen_recordings.js";
import { askComparison, errorComparison, isByRates } from "./compare/error_comparison.js";
import { axisNames, inDatasetOrder } from "./dataset_rows.js";
import { errorLadder } from "./error_ladder.js";
import { extendModel } from "./extend_model.js";
import { takeKept } from "./finish_line.js";
import { nextStep, nextSteps } from "./next_steps.js";
import { residualDiagnostics } from "./residual_diagnostics.js";
import { selectedRows } from "./residual_map.js";
import { ExploreState } from "./state.js";
import { suspectList, verdictCard } from "./verdict_card.js";

/** @import { Comparison, Criticism, Effect, RecordingRow, Unit, Version } from "../../../types/api.js" */
/** @import { Query } from "../../../types/pages.js" */
/** @import { Chosen } from "./chosen_recordings.js" */

/** Sections of the page in order: anchor, name, which is a part of the section's heading. */
const SECTIONS = [
  ["compare", "Compare"],
  ["fails", "Fails"],
  ["learn", "Missing"],
  ["add", "Add"],
  ["watch", "Versions"],
];

const COUNT_MS = 1000;

/**
 * @typedef {object} Given
 * @property {Unit} unit
 * @property {Version} calibration
 * @property {number[]} versions
 * @property {Chosen} chosen
 * @property {RecordingRow["motion"]} motion
 * @property {boolean} hasBench whether the service drives one
 * @property {Query} query
 * @property {AbortSignal} signal
 */

/** @param {Given} given */
export function versionView(given) {
  const { unit, calibration, chosen, motion, query, signal } = given;
  const stage = h("p", { class: "muted", "aria-live": "polite" });
  const since = h("p", { class: "muted small" });
  const finish = takeKept(unit.serial, calibration.version);
  const place = h(
    "div",
    { class: "page" },
    finish?.element ?? null,
    h("div", { class: "card" }, busyIndicator(comparingText(calibration)), stage, since),
  );
  const endWait = countWait(since, signal);
  let steps = 0;
  const path = { serial: unit.serial, version: calibration.version };
  // the first figure needs it: it does not wait for the criticism
  const comparing = isByRates({ ...chosen, motion })
    ? askComparison(
        { serial: unit.serial, version: calibration.version, ...chosen, recordings: [...chosen.recordings] },
        signal,
      )
    : null;
  const asking = Promise.all([
    getFollowed("/api/units/{serial}/calibrations/{version}/criticism/events", {
      path,
      query: askedFor(chosen),
      signal,
      onstage: (name) => setChildren(stage, `Step ${(steps += 1)}: ${name} …`),
    }),
    get("/api/effects", { signal }),
  ]);
  asking
    .then(([criticism, catalogue]) => {
      endWait();
      const end = finish ? null : nextStep(given, criticism);
      setChildren(place, finish?.element ?? null, sections(given, criticism, comparing, catalogue.effects, end));
      finish?.settle(nextSteps(given, criticism));
      if (query.tour) import("../tour/tour.js").then(({ showTour }) => showTour(place, signal));
      else if (location.hash) document.getElementById(location.hash.slice(1))?.scrollIntoView();
    })
    .catch((error) => {
      endWait();
      if (isAbort(error)) return;
      setChildren(
        place,
        errorPage(error, () => show()),
      );
      whenItMayPass(error, signal, () => show({ quiet: true }));
    });
  return place;
}

/**
 * What is done, and how long it may take: each axis is compared for itself and with the others.
 * @param {Version} calibration
 */
function comparingText({ axes }) {
  const axis = Object.keys(axes).length > 1 ? "minutes for several axes" : "about a minute for one axis";
  return `labctl is comparing the model with every reading. A first comparison takes ${axis}; one that was made before is shown at once.`;
}

/**
 * Show how long the comparison has taken so far; return a function that ends it.
 * @param {HTMLElement} place
 * @param {AbortSignal} signal
 */
function countWait(place, signal) {
  const began = performance.now();
  const counting = setInterval(() => {
    setChildren(place, `${duration((performance.now() - began) / 1000)} so far. Leaving the page cancels it.`);
  }, COUNT_MS);
  const end = () => clearInterval(counting);
  signal.addEventListener("abort", end, { once: true });
  return end;
}

/**
 * @param {Given} given
 * @param {Criticism} criticism
 * @param {Promise<Comparison> | null} comparing
 * @param {readonly Effect[]} effects
 * @param {HTMLElement | null} end the step after this version
 */
function sections({ unit, calibration, versions, chosen, motion, query, signal }, criticism, comparing, effects, end) {
  const axes = axisNames(criticism);
  const state = new ExploreState({
    serial: unit.serial,
    version: calibration.version,
    versions,
    ...chosen,
    recordings: [...chosen.recordings],
    motion,
    criticism,
    calibration,
    axis: axes.find((axis) => axis === query.axis) ?? axes[0] ?? Object.keys(calibration.axes)[0],
    pick: query.pick,
  });
  const joint = criticism.joint ? jointCard(criticism.joint) : null;
  if (!axes.length) {
    const alone = chosen.recordings.length < 2 && motion !== "rates";
    return [
      verdictCard(state, effects),
      end,
      joint,
      alone ? errorComparison(state, null, signal) : null,
      errorLadder(state, signal),
    ];
  }
  const adding = extendModel(state, effects);
  const parts = [
    errorComparison(state, comparing, signal),
    residualDiagnostics(state),
    suspectList(state, effects, {
      onadd: adding.put,
      onlaw: adding.putLaw,
      explain: (effect) => explained(state, effect, signal),
    }),
    adding.element,
    errorLadder(state, signal),
  ];
  parts.forEach((part, k) => {
    part.id = SECTIONS[k][0];
  });
  return [verdictCard(state, effects), end, joint, pageNavigation(state, axes), ...parts];
}

/**
 * What an effect would explain of the residual, data set by data set.
 * @param {ExploreState} state
 * @param {string} effect
 * @param {AbortSignal} signal
 */
async function explained(state, effect, signal) {
  const found = await post("/api/units/{serial}/calibrations/{version}/preview", {
    path: { serial: state.serial, version: state.version },
    body: { add: [effect], ...askedFor(state) },
    signal,
  });
  const after = inDatasetOrder(state, found.residuals, "residual_dps");
  return selectedRows(state).residual.map((before, k) => {
    const left = after[k];
    return left === null || before === null ? null : before - left;
  });
}

/**
 * Sticky bar: the axis that all figures show, and links to the sections.
 * @param {ExploreState} state
 * @param {readonly string[]} axes
 */
function pageNavigation(state, axes) {
  return h(
    "div",
    { class: "page-nav" },
    axes.length > 1
      ? toggleGroup(
          "Axis of the gyro",
          axes.map((axis) => option(axis, `axis ${axis}`)),
          state.axis,
          (axis) => state.selectAxis(axis),
        )
      : null,
    h(
      "nav",
      { class: "row tight", "aria-label": "On this page" },
      SECTIONS.map(([id, name]) => h("a", { class: "button quiet tiny", href: `#${id}` }, name)),
    ),
  );
}
