// The explore page: compare a version with recordings, diagnose residuals, find the missing effect, extend the model.

import { get } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { count } from "../core/format.js";
import { card, emptyState, pageHeader, notice } from "../core/components.js";
import { option, selectField } from "../core/fields.js";
import { navigate, query } from "../core/router.js";
import { changedQuery } from "../core/routes.js";
import { inAddress, numbersIn, recordingsText, usualRecording, usualVersion } from "../explore/chosen_recordings.js";
import { fitForm } from "../explore/fit_form.js";
import { posesView } from "../explore/poses_view.js";
import { recordingChoice } from "../explore/recording_choice.js";
import { versionView } from "../explore/version_view.js";

/** @import { RecordingRow, Unit, Version } from "../../../types/api.js" */
/** @import { PageContext, Query } from "../../../types/pages.js" */
/** @import { Chosen } from "../explore/chosen_recordings.js" */

/** Units that can be chosen from the list; every other one has its link on the page of all units. */
const LISTED = 100;

/** @param {PageContext} context */
export async function page({ query: asked, signal }) {
  // with the unit in the address, what is asked for does not wait for the list
  const asking = asked.unit ? readUnit(asked.unit, asked, signal) : null;
  asking?.catch(() => {}); // awaited below
  const [units, benches] = await Promise.all([
    get("/api/units", { query: { limit: LISTED }, signal }),
    get("/api/benches", { signal }),
  ]);
  if (!units.length) {
    return h(
      "div",
      { class: "page" },
      pageHeader("Explore"),
      emptyState(
        h("p", {}, "There is no recording yet; import one, or run a campaign."),
        h("p", {}, h("a", { class: "button primary", href: "/start" }, "Begin")),
      ),
    );
  }
  const { serial } = asked.unit ? { serial: asked.unit } : (units.find((each) => each.calibrations.length) ?? units[0]);
  const { unit, own, versions, version, calibration } = await (asking ?? readUnit(serial, asked, signal));
  const chosen = chosenRecordings(asked, own, calibration);
  const motion = own.find((row) => row.id === chosen.recording)?.motion ?? "rates";
  const element = h(
    "div",
    { class: "page explore", "data-source": sourceOf(serial, calibration, chosen) },
    pageHeader(
      "Explore",
      "Compare the model with the measurements.",
      ...selectors(units, unit, own, versions, version, chosen),
    ),
    recordingChoice(unit.serial, version, own, chosen),
  );
  if (!unit.recordings.length) element.append(notice("", "This unit has no recording; import one, or run a campaign."));
  else if (!calibration) element.append(firstFitCard(unit, chosen, motion));
  else if (motion === "poses") element.append(posesView(unit.serial, calibration, chosen.recording, signal));
  else {
    const hasBench = benches.length > 0;
    element.append(versionView({ unit, calibration, versions, chosen, motion, hasBench, query: asked, signal }));
  }
  return element;
}

/**
 * A unit, its recordings, its versions, and the version that is asked for, or the usual one.
 * @param {string} serial
 * @param {Query} asked
 * @param {AbortSignal} signal
 */
async function readUnit(serial, asked, signal) {
  const recordings = get("/api/recordings", { query: { unit: serial }, signal });
  recordings.catch(() => {}); // awaited below
  const unit = await get("/api/units/{serial}", { path: { serial }, signal });
  const versions = [...unit.calibrations].sort((a, b) => a - b);
  const version = asked.version ? Number(asked.version) : usualVersion(unit);
  const calibration =
    version === undefined
      ? undefined
      : await get("/api/units/{serial}/calibrations/{version}", { path: { serial: unit.serial, version }, signal });
  return { unit, own: await recordings, versions, version, calibration };
}

/**
 * What the figures of the page are of.
 * @param {string} serial
 * @param {Version | undefined} calibration
 * @param {Chosen} chosen
 */
const sourceOf = (serial, calibration, chosen) =>
  [
    `unit ${serial}`,
    calibration ? `version ${calibration.version} (${calibration.hash.slice(0, 12)})` : null,
    recordingsText(chosen),
  ]
    .filter(Boolean)
    .join(", ");

/**
 * The recordings of the address; else those that the version was fitted to together, else the usual one.
 * @param {Query} asked
 * @param {readonly RecordingRow[]} own
 * @param {Version | undefined} calibration
 * @returns {Chosen}
 */
function chosenRecordings(asked, own, calibration) {
  const known = own.map((row) => row.id);
  const several = numbersIn(asked.recordings, known);
  if (several.length) return { recording: several[several.length - 1], recordings: several };
  const fitted = calibration?.recordings ?? [];
  if (!asked.recording && fitted.length > 1) return { recording: fitted[fitted.length - 1], recordings: fitted };
  const recording = Number(asked.recording) || usualRecording(own);
  return { recording, recordings: [recording] };
}

/**
 * @param {readonly Unit[]} units
 * @param {Unit} unit
 * @param {readonly RecordingRow[]} own
 * @param {readonly number[]} versions
 * @param {number | undefined} version
 * @param {Chosen} chosen
 */
function selectors(units, unit, own, versions, version, chosen) {
  /** @param {Record<string, string | null>} changed */
  const to = (changed) => {
    const kept = changed.unit ? {} : { version, ...inAddress(chosen), axis: query().axis };
    const next = { unit: unit.serial, ...kept, view: query().view, ...changed };
    navigate(`/explore?${changedQuery("", next)}`);
  };
  const several = chosen.recordings.length > 1;
  const choices = own.map((each) =>
    option(String(each.id), `${each.id}: ${count(each.datasets)} data ${each.datasets === 1 ? "set" : "sets"}`),
  );
  return [
    selectField(
      "Unit",
      listedSerials(units, unit).map((each) => option(each, each)),
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
      several ? [option("", `${chosen.recordings.join(", ")} together`), ...choices] : choices,
      several ? "" : chosen.recording,
      (value) => value && to({ recording: value, recordings: null }),
    ),
  ].filter(Boolean);
}

/**
 * The serial numbers of the list in the order of the service, which every list has. A unit that is not among the first
 * ones comes after them all.
 * @param {readonly Unit[]} units
 * @param {Unit} unit
 */
const listedSerials = (units, unit) => [...new Set([...units, unit].map((each) => each.serial))];

/**
 * A unit that has no calibration yet: fit one.
 * @param {Unit} unit
 * @param {Chosen} chosen
 * @param {RecordingRow["motion"]} motion
 */
function firstFitCard(unit, chosen, motion) {
  const text = recordingsText(chosen);
  return card(
    "Fit a first model",
    h(
      "p",
      { class: "muted" },
      `${text.charAt(0).toUpperCase()}${text.slice(1)} of ${unit.serial} ${chosen.recordings.length > 1 ? "have" : "has"} not been fitted. Begin with a simple model: its residual shows which effects are missing.`,
    ),
    fitForm(unit.serial, () => chosen, motion, "Fit"),
  );
}
