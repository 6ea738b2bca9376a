// The heart: hold a version against a recording, see where it fails, learn what is missing, add it, watch the error fall.

import { get, post } from "../core/api.js";
import { fill, h } from "../core/elements.js";
import { count } from "../core/format.js";
import { busy, button, card, choice, empty, head, notice, tabs, trouble } from "../core/components.js";
import { go, query } from "../core/router.js";
import { add, inOrder } from "../explore/extend_model.js";
import { compare } from "../explore/error_comparison.js";
import { fails } from "../explore/residual_diagnostics.js";
import { learn, verdict } from "../explore/suspects.js";
import { rowsFor } from "../explore/residual_map.js";
import { axesOf } from "../explore/dataset_rows.js";
import { State } from "../explore/state.js";
import { watch } from "../explore/error_ladder.js";

const MODELS = [["bias_scale", "bias and scale factor"], ["ojeda2000", "Ojeda 2000: polynomial in rate and temperature"], ["yang2018", "Yang 2018: matrices over temperature"], ["single_temperature", "one temperature"]];

/** The parts of the page in their order: id in an address, name. */
const PARTS = [["compare", "Compare"], ["fails", "Fails"], ["learn", "Learn"], ["add", "Add"], ["watch", "Watch"]];

export async function page({ query: asked, signal }) {
  const [units, recordings] = await Promise.all(["/api/units", "/api/recordings"].map((path) => get(path, { signal })));
  if (!units.length) {
    return h("div", { class: "page" }, head("Explore"), empty(h("p", {}, "There is nothing to explore yet."), h("p", {}, h("a", { class: "button first", href: "/start" }, "Begin"))));
  }
  const unit = units.find((each) => each.serial === asked.unit) ?? units.find((each) => each.calibrations.length) ?? units[0];
  const own = recordings.filter((each) => each.serial === unit.serial);
  const recording = Number(asked.recording) || usual(own);
  const versions = [...unit.calibrations].sort((a, b) => a - b);
  const version = versions.includes(Number(asked.version)) ? Number(asked.version) : versions.at(-1);
  const element = h("div", { class: "page explore" }, head("Explore", "Hold the model against the measurements.", ...choices(units, unit, own, versions, version, recording)));
  if (!unit.recordings.length) element.append(notice("", "This unit has no recording."));
  else if (version === undefined) element.append(unfitted(unit, recording));
  else element.append(held({ unit, version, versions, recording, asked, signal }));
  return element;
}

/** Stays in view: the axis that every picture shows, and the way to each part of a long page. */
function guide(state, axes) {
  return h("div", { class: "guide" },
    axes.length > 1 ? tabs("Axis of the gyro", axes.map((axis) => [axis, `axis ${axis}`]), state.axis, (axis) => state.look(axis)) : null,
    h("nav", { class: "row tight", "aria-label": "On this page" }, PARTS.map(([id, name]) => h("a", { class: "button quiet tiny", href: `#${id}` }, name))));
}

/** The newest recording that is no mere beginning: a campaign that runs now has a few data sets only. */
function usual(own) {
  const most = Math.max(...own.map((each) => each.datasets));
  return Math.max(...own.filter((each) => 2 * each.datasets >= most).map((each) => each.id));
}

function choices(units, unit, own, versions, version, recording) {
  const to = (changed) => {
    const next = { unit: unit.serial, version, recording, axis: query().axis, view: query().view, ...changed };
    if (changed.unit) Object.assign(next, { version: null, recording: null, axis: null });
    go(`/explore?${new URLSearchParams(Object.entries(next).filter(([, value]) => value))}`);
  };
  return [
    choice("Unit", units.map((each) => [each.serial, each.serial]), unit.serial, (value) => to({ unit: value })),
    versions.length ? choice("Version", versions.map((each) => [each, `${each}${each === unit.certified_version ? " (in force)" : ""}`]), version, (value) => to({ version: value })) : null,
    choice("Recording", own.map((each) => [each.id, `${each.id}: ${count(each.datasets)} data sets`]), recording, (value) => to({ recording: value })),
  ].filter(Boolean);
}

/** A unit that has no calibration yet: fit one. */
function unfitted(unit, recording) {
  let model = MODELS[0][0];
  return card("Fit a first model", h("p", { class: "soft" }, `Recording ${recording} of ${unit.serial} has not been fitted. Start simple: what the model leaves will say what is missing.`),
    h("div", { class: "row" }, choice("Model", MODELS, model, (value) => { model = value; })),
    h("div", { class: "row" }, button("Fit", async () => {
      const made = await post(`/api/units/${encodeURIComponent(unit.serial)}/calibrations`, { recording, model });
      await go(`/explore?unit=${encodeURIComponent(unit.serial)}&version=${made.version}&recording=${recording}`);
    }, { kind: "first" })));
}

/** A version held against a recording; shown as soon as it is worked out. */
function held({ unit, version, versions, recording, asked, signal }) {
  const place = h("div", { class: "page" }, h("div", { class: "card" }, busy("Holding the model against every reading; the first time takes some seconds.")));
  const path = `/api/units/${encodeURIComponent(unit.serial)}/calibrations/${version}`;
  const asking = Promise.all([get(`${path}/criticism`, { query: { recording }, signal }), get(path, { signal }), get("/api/effects", { signal })]);
  asking.then(([criticism, calibration, catalogue]) => {
    const axes = axesOf(criticism);
    const state = new State({ serial: unit.serial, unit, version, versions, recording, criticism, calibration, axis: axes.includes(asked.axis) ? asked.axis : axes[0], pick: asked.pick });
    if (!axes.length) return fill(place, verdict(state), watch(state, signal));
    const adding = add(state, path, catalogue.effects);
    const explain = async (effect) => {
      const found = await post(`${path}/preview`, { add: [effect], recording }, { signal });
      const after = inOrder(state, found.residuals, "residual_dps");
      return rowsFor(state).residual.map((before, k) => (after[k] === null ? null : before - after[k]));
    };
    const parts = [compare(state, path, signal), fails(state), learn(state, { onadd: adding.put, explain }), adding.element, watch(state, signal)];
    parts.forEach((part, k) => { part.id = PARTS[k][0]; });
    fill(place, verdict(state), guide(state, axes), parts);
    if (location.hash) document.getElementById(location.hash.slice(1))?.scrollIntoView();
    return place;
  }).catch((error) => error.name !== "AbortError" && fill(place, trouble(error, () => go(location.pathname + location.search))));
  return place;
}

