// The drafts that a campaign ends in: verdict, as found and as left, drift and limits.

import { h } from "../core/elements.js";
import { card, chip, notice, table } from "../core/components.js";
import { capitalised, idText, number } from "../core/format.js";
import { withButtonNamed } from "./draft_text.js";

/** @import { Draft } from "../../../types/api.js" */

/** What a limit is of. @type {Record<string, string>} */
const LIMITS = {
  heldout_rms_dps: "Held-out error",
  max_error_dps: "Largest error",
  drift_dps: "Drift from the version in force",
};

/**
 * @param {readonly Draft[]} drafts
 * @returns {HTMLElement | null}
 */
export function draftsCard(drafts) {
  if (!drafts.length) return null;
  return Object.assign(card(drafts.length > 1 ? "Drafts" : "Draft", ...drafts.map(oneDraft)), { id: "drafts" });
}

/** @param {Draft} draft */
function oneDraft(draft) {
  const unit = h("a", { href: `/units/${encodeURIComponent(draft.serial)}` }, draft.serial);
  const report = draft.report;
  if (draft.state === "failed") return notice("bad", h("strong", {}, unit), ` ${draft.reason}`);
  if (!report) return h("p", { class: "muted" }, unit, ": the draft is made when the campaign is done.");
  const explore = `/explore?unit=${encodeURIComponent(draft.serial)}&version=${draft.version}`;
  return h(
    "div",
    { class: "stack" },
    h(
      "p",
      { class: "row" },
      h("strong", {}, unit),
      h("a", { href: explore }, `version ${draft.version}`),
      draft.certified ? chip("in force", "good") : chip("not certified", "warn"),
      report.verdict ? chip(report.verdict, report.verdict === "adequate" ? "good" : "warn") : null,
      report.within_limits === null
        ? null
        : chip(report.within_limits ? "limits kept" : "limits not kept", report.within_limits ? "good" : "bad"),
    ),
    h("p", {}, withButtonNamed(report.text)),
    figures(draft),
    report.limits.length ? limits(draft) : null,
    report.drift?.coefficients.length ? changes(draft) : null,
  );
}

/** @param {Draft} draft */
function figures(draft) {
  const report = draft.report;
  if (!report) return null;
  const rows = [
    ["As found", report.as_found, report.as_found_why],
    ["As left", report.as_left, report.as_left_why],
  ].map(([name, found, why]) => ({ name, found, why }));
  return table(
    [
      { title: "Calibration", cell: (row) => row.name },
      { title: "Version", cell: (row) => (row.found ? `${row.found.version}` : row.why) },
      { title: "RMS, deg/s", number: true, cell: (row) => number(row.found?.rms_dps) },
      { title: "Largest, deg/s", number: true, cell: (row) => number(row.found?.max_dps) },
      { title: "Mean, deg/s", number: true, cell: (row) => number(row.found?.bias_dps) },
    ],
    /** @type {{ name: string, found: NonNullable<typeof report.as_left> | null, why: string }[]} */ (rows),
    { label: `As-found and as-left error of ${draft.serial}`, dense: true },
  );
}

/** @param {Draft} draft */
function limits(draft) {
  return table(
    [
      { title: "Limit", cell: (row) => `${LIMITS[row.limit] ?? row.limit}${row.axis ? `, axis ${row.axis}` : ""}` },
      { title: "Found, deg/s", number: true, cell: (row) => number(row.value_dps) },
      { title: "At most, deg/s", number: true, cell: (row) => number(row.at_most_dps) },
      {
        title: "Result",
        cell: (row) => (row.passed === null ? row.why : row.passed ? chip("passed", "good") : chip("failed", "bad")),
      },
    ],
    draft.report?.limits ?? [],
    { label: `Limits of ${draft.serial}`, dense: true },
  );
}

/** @param {Draft} draft */
function changes(draft) {
  return h(
    "details",
    {},
    h("summary", {}, `Coefficients against version ${draft.report?.drift?.version}`),
    table(
      [
        { title: "Axis", cell: (row) => row.axis },
        { title: "Coefficient", cell: (row) => capitalised(idText(row.coefficient)) },
        { title: "°C", number: true, cell: (row) => number(row.temperature_c) },
        { title: "In force", number: true, cell: (row) => number(row.in_force, 5) },
        { title: "Draft", number: true, cell: (row) => number(row.draft, 5) },
        { title: "Change", number: true, cell: (row) => number(row.change) },
        { title: "u", number: true, cell: (row) => number(row.u) },
        { title: "Unit", cell: (row) => row.unit },
        { title: "Significance", cell: (row) => (row.significant ? chip("significant", "warn") : "") },
      ],
      draft.report?.drift?.coefficients ?? [],
      { label: `Changes of ${draft.serial}`, dense: true },
    ),
  );
}
