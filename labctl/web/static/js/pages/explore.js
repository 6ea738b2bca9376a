// The explore page: compare a version with a recording, diagnose residuals, find the missing effect, extend the model.

import { get, getFollowed, post } from "../core/api.js";
import { setChildren, h } from "../core/elements.js";
import { count } from "../core/format.js";
import {
  busyIndicator,
  button,
  card,
  selectField,
  emptyState,
  pageHeader,
  notice,
  toggleGroup,
  errorPage,
} from "../core/components.js";
import { navigate, query } from "../core/router.js";
import { postFit } from "../explore/accept_warnings.js";
import { extendModel, inDatasetOrder } from "../explore/extend_model.js";
import { errorComparison } from "../explore/compare/error_comparison.js";
import { residualDiagnostics } from "../explore/residual_diagnostics.js";
import { suspectList, verdictCard } from "../explore/suspects.js";
import { selectedRows } from "../explore/residual_map.js";
import { axisNames } from "../explore/dataset_rows.js";
import { ExploreState } from "../explore/state.js";
import { errorLadder } from "../explore/error_ladder.js";

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

export async function page({ query: asked, signal }) {
  const [units, recordings] = await Promise.all(["/api/units", "/api/recordings"].map((path) => get(path, { signal })));
  if (!units.length) {
    return h(
      "div",
      { class: "page" },
      pageHeader("Explore"),
      emptyState(
        h("p", {}, "There is nothing to explore yet."),
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
      "Hold the model against the measurements.",
      ...selectors(units, unit, own, versions, version, recording),
    ),
  );
  if (!unit.recordings.length) element.append(notice("", "This unit has no recording."));
  else if (version === undefined) element.append(firstFitCard(unit, recording));
  else element.append(versionView({ unit, version, versions, recording, asked, signal }));
  return element;
}

/** Sticky bar: the axis that all figures show, and links to the sections. */
function pageNavigation(state, axes) {
  return h(
    "div",
    { class: "page-nav" },
    axes.length > 1
      ? toggleGroup(
          "Axis of the gyro",
          axes.map((axis) => [axis, `axis ${axis}`]),
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

/** The newest recording with at least half as many data sets as the largest: a running campaign has few so far. */
function defaultRecording(own) {
  const most = Math.max(...own.map((each) => each.datasets));
  return Math.max(...own.filter((each) => 2 * each.datasets >= most).map((each) => each.id));
}

function selectors(units, unit, own, versions, version, recording) {
  const to = (changed) => {
    const next = { unit: unit.serial, version, recording, axis: query().axis, view: query().view, ...changed };
    if (changed.unit) Object.assign(next, { version: null, recording: null, axis: null });
    navigate(`/explore?${new URLSearchParams(Object.entries(next).filter(([, value]) => value))}`);
  };
  return [
    selectField(
      "Unit",
      units.map((each) => [each.serial, each.serial]),
      unit.serial,
      (value) => to({ unit: value }),
    ),
    versions.length
      ? selectField(
          "Version",
          versions.map((each) => [each, `${each}${each === unit.certified_version ? " (in force)" : ""}`]),
          version,
          (value) => to({ version: value }),
        )
      : null,
    selectField(
      "Recording",
      own.map((each) => [each.id, `${each.id}: ${count(each.datasets)} data sets`]),
      recording,
      (value) => to({ recording: value }),
    ),
  ].filter(Boolean);
}

/** A unit that has no calibration yet: fit one. */
function firstFitCard(unit, recording) {
  let model = MODELS[0][0];
  return card(
    "Fit a first model",
    h(
      "p",
      { class: "muted" },
      `Recording ${recording} of ${unit.serial} has not been fitted. Start simple: what the model leaves will say what is missing.`,
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
          const made = await postFit(
            `/api/units/${encodeURIComponent(unit.serial)}/calibrations`,
            { recording, model },
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

/** A version compared with a recording; shown when the criticism is computed. */
function versionView({ unit, version, versions, recording, asked, signal }) {
  const stage = h("p", { class: "muted", "aria-live": "polite" });
  const place = h(
    "div",
    { class: "page" },
    h(
      "div",
      { class: "card" },
      busyIndicator("Holding the model against every reading; the first time takes some seconds."),
      stage,
    ),
  );
  const path = `/api/units/${encodeURIComponent(unit.serial)}/calibrations/${version}`;
  const asking = Promise.all([
    getFollowed(`${path}/criticism/events`, {
      query: { recording },
      signal,
      onstage: (name) => setChildren(stage, `${name} …`),
    }),
    get(path, { signal }),
    get("/api/effects", { signal }),
  ]);
  asking
    .then(([criticism, calibration, catalogue]) => {
      const axes = axisNames(criticism);
      const state = new ExploreState({
        serial: unit.serial,
        unit,
        version,
        versions,
        recording,
        criticism,
        calibration,
        axis: axes.includes(asked.axis) ? asked.axis : axes[0],
        pick: asked.pick,
      });
      if (!axes.length) return setChildren(place, verdictCard(state), errorLadder(state, signal));
      const adding = extendModel(state, path, catalogue.effects);
      const explain = async (effect) => {
        const found = await post(`${path}/preview`, { add: [effect], recording }, { signal });
        const after = inDatasetOrder(state, found.residuals, "residual_dps");
        return selectedRows(state).residual.map((before, k) => (after[k] === null ? null : before - after[k]));
      };
      const parts = [
        errorComparison(state, path, signal),
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
        error.name !== "AbortError" &&
        setChildren(
          place,
          errorPage(error, () => navigate(location.pathname + location.search)),
        ),
    );
  return place;
}
