// A version compared with recordings: verdict, comparison, diagnostics, suspects, change, ladder; shown when computed.

import { get, getFollowed, post } from "../core/http/api.js";
import { isAbort } from "../core/http/errors.js";
import { whenItMayPass } from "../core/http/recovery.js";
import { setChildren, h } from "../core/elements.js";
import { actButton, busyIndicator, button, errorPage, notice } from "../core/components.js";
import { option, toggleGroup } from "../core/fields.js";
import { duration, idText } from "../core/format.js";
import { navigate, show } from "../core/router.js";
import { planAddress } from "../core/routes.js";
import { elsewhere } from "../campaigns/elsewhere.js";
import { jointCard } from "../joint/card.js";
import { asked as askedFor } from "./chosen_recordings.js";
import { askComparison, errorComparison, isByRates } from "./compare/error_comparison.js";
import { axisNames, inDatasetOrder } from "./dataset_rows.js";
import { errorLadder } from "./error_ladder.js";
import { extendModel } from "./extend_model.js";
import { takeKept } from "./finish_line.js";
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
 * Put a version in force, on the page of its unit.
 * @param {Given} given
 */
const certify = async ({ unit: { serial }, calibration: { version } }) => {
  const left = await navigate(`/units/${encodeURIComponent(serial)}?version=${version}`);
  const { askCertification } = await import("../unit/certification.js"); // no weight of a first visit
  await askCertification(serial, version, left);
};

/**
 * The step after a version: the experiment where it is not adequate, in force or not, else its certification; null for
 * an adequate version in force.
 * @param {Given} given
 * @param {Criticism} criticism
 */
const nextStep = (given, criticism) =>
  criticism.verdict !== "adequate"
    ? h("div", { class: "row" }, nextExperiment(given, criticism, "")) // the advised effect has the prominent button
    : given.unit.certified_version === given.calibration.version
      ? null
      : h(
          "div",
          { class: "row" },
          actButton("Certify: put in force", () => certify(given), { kind: "primary" }),
          h("span", { class: "muted" }, "Programs that ask for the calibration of this unit then get this version."),
        );

/**
 * What the new version has come to, and what can be done next.
 * @param {Given} given
 * @param {Criticism} criticism
 */
function nextSteps(given, criticism) {
  const isEnd = criticism.verdict === "adequate";
  return [
    notice(
      isEnd ? "good" : "warn",
      h("p", {}, h("strong", {}, criticism.text[0])),
      isEnd
        ? h(
            "p",
            {},
            criticism.why_not_named
              ? "These data say nothing more that can be relied on; see the suspects that are not named."
              : "These data say nothing more: no effect of the catalogue has evidence in them.",
          )
        : null,
      unknownCauses(criticism),
    ),
    h(
      "div",
      { class: "row" },
      actButton("Certify: put in force", () => certify(given), { kind: isEnd ? "primary" : "" }),
      nextExperiment(given, criticism, isEnd ? "" : "primary"),
    ),
  ];
}

/**
 * A link to the plan of the experiment that is advised, or to the recipes where none is. Without a bench a plan here
 * would be of another, simulated unit: what can be done with the recipe is shown instead.
 * @param {Given} given
 * @param {Criticism} criticism
 * @param {string} kind
 */
function nextExperiment({ unit, hasBench }, { experiments, version }, kind) {
  const plan = experiments.find((each) => each.toml)?.toml;
  if (plan && !hasBench) return recipeToKeep(unit.serial, plan, kind);
  const href = planAddress(plan ?? "", unit.serial, plan ? version : undefined);
  return h("a", { class: `button ${kind}`, href }, plan ? "Next experiment" : "Plan a campaign");
}

/**
 * A button that shows once what can be done with the recipe of an experiment where no bench is.
 * @param {string} serial
 * @param {string} toml
 * @param {string} kind
 */
function recipeToKeep(serial, toml, kind) {
  const opening = button("Next experiment", () => setChildren(place, elsewhere(serial, { toml })), { kind });
  const place = h("div", { style: "flex-basis: 100%", "aria-live": "polite" });
  return [opening, place];
}

/**
 * What an adequate model does not show: which of several effects is the cause.
 * @param {Criticism} criticism
 */
const unknownCauses = ({ undistinguished }) =>
  undistinguished.map(({ effect, others }) =>
    h(
      "p",
      {},
      `The error is corrected; the cause is not known: ${[effect, ...others].map(idText).join(" or ")}. These data cannot distinguish them.`,
    ),
  );

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
