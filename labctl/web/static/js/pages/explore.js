// The explore page: compare a version with a recording, diagnose residuals, find the missing effect, extend the model.

import { get, getFollowed, post } from "../core/http/api.js";
import { isAbort } from "../core/http/errors.js";
import { setChildren, h } from "../core/elements.js";
import { count } from "../core/format.js";
import { busyIndicator, button, card, emptyState, pageHeader, notice, errorPage } from "../core/components.js";
import { option, selectField, toggleGroup } from "../core/fields.js";
import { navigate, query } from "../core/router.js";
import { changedQuery } from "../core/routes.js";
import { postFit } from "../explore/accept_warnings.js";
import { extendModel } from "../explore/extend_model.js";
import { errorComparison } from "../explore/compare/error_comparison.js";
import { residualDiagnostics } from "../explore/residual_diagnostics.js";
import { suspectList, verdictCard } from "../explore/suspects.js";
import { selectedRows } from "../explore/residual_map.js";
import { axisNames, inDatasetOrder } from "../explore/dataset_rows.js";
import { ExploreState } from "../explore/state.js";
import { errorLadder } from "../explore/error_ladder.js";

/** @import { RecordingRow, Unit } from "../../../types/api.js" */
/** @import { PageContext, Query } from "../../../types/pages.js" */

/** @type {[id: string, text: string][]} */
const MODELS = [
  ["bias_scale", "bias and scale factor"],
  ["ojeda2000", "Ojeda 2000: polynomial in rate and temperature"],
  ["yang2018", "Yang 2018: matrices over temperature"],
  ["single_temperature", "one temperature"],
];

/** Sections of the page in order: anchor, name. */
const SECTIONS = [
  ["compare", "Compare"],
  ["fails", "Fails"],
  ["learn", "Learn"],
  ["add", "Add"],
  ["watch", "Watch"],
];

/** @param {PageContext} context */
export async function page({ query: asked, signal }) {
  const [units, recordings] = await Promise.all([get("/api/units", { signal }), get("/api/recordings", { signal })]);
  if (!units.length) {
    return h(
      "div",
      { class: "page" },
      pageHeader("Explore"),
      emptyState(
        h("p", {}, "There is nothing to explore yet: import or measure a recording first."),
        h("p", {}, h("a", { class: "button primary", href: "/start" }, "Begin")),
      ),
    );
  }
  const unit =
    units.find((each) => each.serial === asked.unit) ?? units.find((each) => each.calibrations.length) ?? units[0];
  const own = recordings.filter((each) => each.serial === unit.serial);
  const recording = Number(asked.recording) || defaultRecording(own);
  const versions = [...unit.calibrations].sort((a, b) => a - b);
  const version = versions.includes(Number(asked.version)) ? Number(asked.version) : versions.at(-1);
  const element = h(
    "div",
    { class: "page explore" },
    pageHeader(
      "Explore",
      "Compare the model with the measurements.",
      ...selectors(units, unit, own, versions, version, recording),
    ),
  );
  if (!unit.recordings.length) element.append(notice("", "This unit has no recording."));
  else if (version === undefined) element.append(firstFitCard(unit, recording));
  else element.append(versionView({ unit, version, versions, recording, asked, signal }));
  return element;
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

/**
 * The newest recording with at least half as many data sets as the largest: a running campaign has few so far.
 * @param {readonly RecordingRow[]} own
 */
function defaultRecording(own) {
  const most = Math.max(...own.map((each) => each.datasets));
  return Math.max(...own.filter((each) => 2 * each.datasets >= most).map((each) => each.id));
}

/**
 * @param {readonly Unit[]} units
 * @param {Unit} unit
 * @param {readonly RecordingRow[]} own
 * @param {readonly number[]} versions
 * @param {number | undefined} version
 * @param {number} recording
 */
function selectors(units, unit, own, versions, version, recording) {
  /** @param {Partial<Record<"unit" | "version" | "recording", string>>} changed */
  const to = (changed) => {
    const kept = changed.unit ? {} : { version, recording, axis: query().axis };
    const next = { unit: unit.serial, ...kept, view: query().view, ...changed };
    navigate(`/explore?${changedQuery("", next)}`);
  };
  return [
    selectField(
      "Unit",
      units.map((each) => option(each.serial, each.serial)),
      unit.serial,
      (value) => to({ unit: value }),
    ),
    versions.length
      ? selectField(
          "Version",
          versions.map((each) => option(each, `${each}${each === unit.certified_version ? " (in force)" : ""}`)),
          version,
          (value) => to({ version: value }),
        )
      : null,
    selectField(
      "Recording",
      own.map((each) => option(each.id, `${each.id}: ${count(each.datasets)} data sets`)),
      recording,
      (value) => to({ recording: value }),
    ),
  ].filter(Boolean);
}

/**
 * A unit that has no calibration yet: fit one.
 * @param {Unit} unit
 * @param {number} recording
 */
function firstFitCard(unit, recording) {
  let model = MODELS[0][0];
  return card(
    "Fit a first model",
    h(
      "p",
      { class: "muted" },
      `Recording ${recording} of ${unit.serial} has not been fitted. Begin with a simple model: its residual shows which effects are missing.`,
    ),
    h(
      "div",
      { class: "row" },
      selectField("Model", MODELS, model, (value) => {
        model = value;
      }),
    ),
    h(
      "div",
      { class: "row" },
      button(
        "Fit",
        async () => {
          const path = { serial: unit.serial };
          const made = await postFit(
            (accepted) => post("/api/units/{serial}/calibrations", { path, body: { recording, model, ...accepted } }),
            "Fit anyway",
          );
          if (!made) return;
          await navigate(
            `/explore?unit=${encodeURIComponent(unit.serial)}&version=${made.version}&recording=${recording}`,
          );
        },
        { kind: "primary" },
      ),
    ),
  );
}

/**
 * A version compared with a recording; shown when the criticism is computed.
 * @param {{ unit: Unit, version: number, versions: number[], recording: number, asked: Query, signal: AbortSignal }} given
 */
function versionView({ unit, version, versions, recording, asked, signal }) {
  const stage = h("p", { class: "muted", "aria-live": "polite" });
  const place = h(
    "div",
    { class: "page" },
    h(
      "div",
      { class: "card" },
      busyIndicator("Comparing the model with every reading; the first time takes some seconds."),
      stage,
    ),
  );
  const path = { serial: unit.serial, version };
  const asking = Promise.all([
    getFollowed("/api/units/{serial}/calibrations/{version}/criticism/events", {
      path,
      query: { recording },
      signal,
      onstage: (name) => setChildren(stage, `${name} …`),
    }),
    get("/api/units/{serial}/calibrations/{version}", { path, signal }),
    get("/api/effects", { signal }),
  ]);
  asking
    .then(([criticism, calibration, catalogue]) => {
      const axes = axisNames(criticism);
      const state = new ExploreState({
        serial: unit.serial,
        version,
        versions,
        recording,
        criticism,
        calibration,
        axis: axes.find((axis) => axis === asked.axis) ?? axes[0],
        pick: asked.pick,
      });
      if (!axes.length) return setChildren(place, verdictCard(state), errorLadder(state, signal));
      const adding = extendModel(state, catalogue.effects);
      /** @param {string} effect */
      const explain = async (effect) => {
        const body = { add: [effect], recording };
        const found = await post("/api/units/{serial}/calibrations/{version}/preview", { path, body, signal });
        const after = inDatasetOrder(state, found.residuals, "residual_dps");
        return selectedRows(state).residual.map((before, k) => {
          const left = after[k];
          return left === null || before === null ? null : before - left;
        });
      };
      const parts = [
        errorComparison(state, signal),
        residualDiagnostics(state),
        suspectList(state, { onadd: adding.put, explain }),
        adding.element,
        errorLadder(state, signal),
      ];
      parts.forEach((part, k) => {
        part.id = SECTIONS[k][0];
      });
      setChildren(place, verdictCard(state), pageNavigation(state, axes), parts);
      if (location.hash) document.getElementById(location.hash.slice(1))?.scrollIntoView();
      return place;
    })
    .catch(
      (error) =>
        !isAbort(error) &&
        setChildren(
          place,
          errorPage(error, () => navigate(location.pathname + location.search)),
        ),
    );
  return place;
}
