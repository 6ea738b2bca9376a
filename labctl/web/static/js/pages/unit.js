// The page of one unit: its calibrations, certifications, error ladder, coefficients and uncertainty in use.

import { get } from "../core/http/api.js";
import { h, setChildren } from "../core/elements.js";
import { instant, number } from "../core/format.js";
import {
  button,
  card,
  chip,
  emptyState,
  pageHeader,
  cardWithHeader,
  loadInto,
  modelName,
  table,
} from "../core/components.js";
import { draftsCard } from "../campaigns/drafts.js";
import { query, updateQuery } from "../core/router.js";
import { ladderFigure } from "../explore/error_ladder.js";
import {
  askCertification,
  askRevocation,
  certificationTable,
  fetchTable,
  waitingNotice,
} from "../unit/certification.js";
import { coefficients, comparison } from "../unit/coefficients.js";
import { certificateFiles } from "../unit/certificate.js";
import { certificateTable } from "../unit/certificate_state.js";
import { datasheetCard } from "../unit/datasheet.js";
import { exportFiles } from "../unit/export_files.js";
import { inForce } from "../unit/in_force.js";
import { sensorsCard } from "../unit/sensors.js";
import { trendCard } from "../trend/card.js";
import { uncertaintyInUse } from "../unit/uncertainty.js";
import { versionFacts } from "../unit/version_facts.js";

/** @import { CalibrationRow, Certificate, Unit } from "../../../types/api.js" */

/** @import { PageContext } from "../../../types/pages.js" */

/** @param {PageContext} context */
export async function page({ params, signal }) {
  const path = { serial: params.serial };
  const [unit, rows, history, issued, waiting, sensors] = await Promise.all([
    get("/api/units/{serial}", { path, signal }),
    get("/api/units/{serial}/calibrations", { path, signal }),
    get("/api/units/{serial}/certifications", { path, signal }),
    get("/api/units/{serial}/certificates", { path, signal }),
    get("/api/units/{serial}/release-requests", { path, signal }),
    get("/api/units/{serial}/sensors", { path, signal }),
  ]);
  const force = history.find((act) => act.version === unit.certified_version && act.act === "certify");
  const explore = `/explore?unit=${encodeURIComponent(unit.serial)}`;
  return h(
    "div",
    { class: "page", "data-source": `unit ${unit.serial}` },
    pageHeader(
      unit.serial,
      [unit.model, unit.technology?.toUpperCase()].filter(Boolean).join(" · "),
      h("a", { class: "button primary", href: explore }, "Explore"),
      h("a", { class: "button", href: `/live?unit=${encodeURIComponent(unit.serial)}` }, "Calibrate live"),
    ),
    h("section", { class: "card", "aria-label": "In force" }, inForce(unit, rows, force)),
    waitingNotice(waiting),
    unit.draft && !unit.draft.certified ? draftsCard([unit.draft]) : null,
    rows.length
      ? [
          versions(unit, rows, issued, explore),
          ladder(unit.serial, signal),
          unit.recordings.length > 1 ? trendCard(unit.serial, rows, signal) : null,
          ...versionCards(unit.serial, rows, signal),
        ]
      : emptyState(
          h("p", {}, "No calibration yet."),
          h("p", {}, h("a", { class: "button primary", href: explore }, "Fit a model")),
        ),
    sensorsCard(sensors),
    issued.length ? card("Certificates", certificateTable(issued)) : null,
    unit.recordings.length ? datasheetCard(unit.serial, signal) : null,
    h(
      "div",
      { class: "columns" },
      card(
        "Recordings",
        h(
          "ul",
          { class: "plain" },
          unit.recordings.map((id) => h("li", {}, h("a", { href: `/recordings/${id}` }, `Recording ${id}`))),
        ),
      ),
      card(
        "Certifications",
        history.length ? certificationTable(history) : h("p", { class: "muted" }, "Nothing has been certified yet."),
      ),
    ),
  );
}

/**
 * @param {Unit} unit
 * @param {readonly CalibrationRow[]} rows
 * @param {readonly Certificate[]} issued
 * @param {string} explore
 */
function versions(unit, rows, issued, explore) {
  /** @param {CalibrationRow} row */
  const act = (row) =>
    row.certified
      ? button("Revoke", () => askRevocation(unit.serial, row.version), { kind: "tiny" })
      : button("Certify", () => askCertification(unit.serial, row.version), { kind: "tiny" });
  return cardWithHeader(
    "Calibrations",
    null,
    table(
      [
        {
          title: "Version",
          cell: (row) =>
            h(
              "span",
              { class: "row tight" },
              h("a", { href: `${explore}&version=${row.version}` }, `${row.version}`),
              row.certified ? chip("in force", "good") : null,
              row.notices?.length ? h("span", { title: row.notices.join("; ") }, chip("standard bad", "bad")) : null,
            ),
        },
        {
          title: "Model",
          cell: (row) =>
            h(
              "span",
              {},
              modelName(row.model),
              row.parent ? h("span", { class: "muted small" }, ` from ${row.parent}`) : null,
            ),
        },
        {
          title: "Made",
          cell: (row) =>
            h(
              "div",
              { class: "nowrap" },
              instant(row.created_at),
              h("div", { class: "muted small" }, h("code", { title: `hash ${row.hash}` }, row.hash.slice(0, 10))),
            ),
        },
        { title: "RMS, deg/s", number: true, cell: (row) => number(row.rms_dps) },
        { title: "Left-out temperatures, deg/s", number: true, cell: (row) => number(row.heldout_rms_dps) },
        {
          title: "Action",
          cell: (row) =>
            h(
              "div",
              { class: "row tight", style: "gap: .2rem" },
              act(row),
              h("details", {}, h("summary", {}, "Files"), exportFiles(unit, row.version)),
              fetchedBy(unit.serial, row.version),
              certificateFiles(unit.serial, row.version, issued),
            ),
        },
      ],
      rows,
      { label: "Calibrations", selected: (row) => row.certified },
    ),
  );
}

/**
 * Who fetched a version, read when it is opened.
 * @param {string} serial
 * @param {number} version
 */
function fetchedBy(serial, version) {
  const place = h("div");
  const ontoggle = () =>
    loadInto(place, "Reading who fetched it", async () => {
      const rows = await get("/api/units/{serial}/calibrations/{version}/fetches", { path: { serial, version } });
      return rows.length ? fetchTable(rows) : h("p", { class: "muted" }, "No fetch was recorded.");
    });
  return h("details", { ontoggle }, h("summary", {}, "Fetched by"), place);
}

/**
 * @param {string} serial
 * @param {AbortSignal} signal
 */
function ladder(serial, signal) {
  const place = h("div", { style: "min-height: 20rem" });
  loadInto(place, "RMS error by version", async () =>
    ladderFigure(await get("/api/units/{serial}/ladder", { path: { serial }, signal })),
  );
  return cardWithHeader("How the error fell", null, place);
}

/**
 * Coefficients of one version, or of two side by side, and the uncertainty in use of the first.
 * @param {string} serial
 * @param {readonly CalibrationRow[]} rows
 * @param {AbortSignal} signal
 */
function versionCards(serial, rows, signal) {
  const newest = rows[0].version;
  /** @type {number} */
  let one = Number(query().version) || newest;
  /** @type {number | null} */
  let other = Number(query().beside) || null;
  const place = h("div");
  const uncertainty = uncertaintyInUse(serial, signal);
  const options = () => rows.map((row) => h("option", { value: row.version }, `version ${row.version}`));
  const ofOne = ["of", "of"].map((label) => {
    /** @type {HTMLSelectElement} */
    const select = h(
      "select",
      {
        onchange: () => {
          one = Number(select.value);
          draw();
        },
      },
      options(),
    );
    return { select, element: h("label", { class: "row small" }, label, select) };
  });
  /** @type {HTMLSelectElement} */
  const beside = h(
    "select",
    {
      onchange: () => {
        other = Number(beside.value) || null;
        draw();
      },
    },
    h("option", { value: "" }, "none"),
    options(),
  );
  beside.value = String(other ?? "");
  /** @param {number} version */
  const read = (version) => get("/api/units/{serial}/calibrations/{version}", { path: { serial, version }, signal });
  const draw = () => {
    const shown = one;
    updateQuery({ version: one === newest ? null : one, beside: other });
    for (const { select } of ofOne) select.value = String(one);
    const asked = Promise.all([read(one), other ? read(other) : null]);
    loadInto(place, "Reading the coefficients", async () => {
      const [first, second] = await asked;
      return h(
        "div",
        { class: "stack" },
        second ? comparison(first, second) : null,
        coefficients(first, second),
        versionFacts(first),
      );
    });
    asked.then(
      ([first]) => {
        if (shown === one) uncertainty.show(first);
      },
      () => {
        setChildren(uncertainty.element);
      },
    );
  };
  draw();
  return [
    cardWithHeader(
      "Coefficients",
      h("div", { class: "row" }, ofOne[0].element, h("label", { class: "row small" }, "beside", beside)),
      place,
    ),
    cardWithHeader("Uncertainty in use (k = 2)", ofOne[1].element, uncertainty.element),
  ];
}
