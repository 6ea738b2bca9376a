// The page of one unit: its calibrations, certifications, error ladder, coefficients and uncertainty in use.

import { get } from "../core/http/api.js";
import { h, setChildren } from "../core/elements.js";
import { card, emptyState, isMissing, pageHeader, cardWithHeader, loadInto } from "../core/components.js";
import { draftsCard } from "../campaigns/drafts.js";
import { query, updateQuery } from "../core/router.js";
import { ladderFigure } from "../explore/error_ladder.js";
import { batchButton, unitLine } from "../unit/batch.js";
import { certificationTable, waitingNotice } from "../unit/certification.js";
import { coefficients, comparison } from "../unit/coefficients.js";
import { certificateTable } from "../unit/certificate_state.js";
import { datasheetCard } from "../unit/datasheet.js";
import { diagnosisCard } from "../unit/diagnosis.js";
import { inForce } from "../unit/in_force.js";
import { sensorsCard } from "../unit/sensors.js";
import { trendCard } from "../trend/card.js";
import { uncertaintyInUse } from "../unit/uncertainty.js";
import { versionFacts } from "../unit/version_facts.js";
import { versionsCard } from "../unit/versions.js";

/** @import { CalibrationRow, Ladder, Unit } from "../../../types/api.js" */

/** @import { PageContext } from "../../../types/pages.js" */

/**
 * The page of a unit that a bench carries, and that no campaign has measured yet.
 * @param {string} serial
 * @param {string} bench
 */
const notMeasured = (serial, bench) =>
  h(
    "div",
    { class: "page" },
    pageHeader(serial, `On bench ${bench}; not measured yet.`),
    emptyState(
      h("p", {}, "A campaign measures it and makes its first recording."),
      h("p", {}, h("a", { class: "button primary", href: "/campaigns/new" }, "Plan a campaign")),
    ),
  );

/** @param {PageContext} context */
export async function page({ params, signal }) {
  const path = { serial: params.serial };
  /** @type {Unit} */
  let unit;
  try {
    unit = await get("/api/units/{serial}", { path, signal });
  } catch (error) {
    const [bench] = isMissing(error) ? await get("/api/benches", { signal }) : [];
    if (bench?.units.some(({ serial }) => serial === params.serial)) return notMeasured(params.serial, bench.name);
    throw error;
  }
  const calibrations = get("/api/units/{serial}/calibrations", { path, signal });
  // the first figure needs it: it does not wait for the other answers
  const asking = calibrations.then((each) =>
    each.length ? get("/api/units/{serial}/ladder", { path, signal }) : null,
  );
  asking.catch(() => {}); // shown where it is awaited
  const [rows, history, issued, waiting, sensors, diagnoses, benches] = await Promise.all([
    calibrations,
    get("/api/units/{serial}/certifications", { path, signal }),
    get("/api/units/{serial}/certificates", { path, signal }),
    get("/api/units/{serial}/release-requests", { path, signal }),
    get("/api/units/{serial}/sensors", { path, signal }),
    get("/api/units/{serial}/diagnoses", { path, signal }),
    get("/api/benches", { signal }),
  ]);
  const force = history.find((act) => act.version === unit.certified_version && act.act === "certify");
  const explore = `/explore?unit=${encodeURIComponent(unit.serial)}`;
  return h(
    "div",
    { class: "page", "data-source": `unit ${unit.serial}` },
    pageHeader(
      unit.serial,
      unitLine(unit),
      h("a", { class: "button primary", href: explore }, "Explore"),
      liveLink(unit),
      batchButton(unit),
    ),
    h("section", { class: "card", "aria-label": "In force" }, inForce(unit, rows, force)),
    waitingNotice(waiting),
    unit.draft && !unit.draft.certified ? draftsCard([unit.draft]) : null,
    rows.length
      ? [
          versionsCard(unit, rows, issued, history, explore),
          ladder(asking),
          diagnosisCard(unit.serial, diagnoses, benches, signal),
          unit.recordings.length > 1 ? trendCard(unit.serial, rows, signal) : null,
          ...versionCards(unit.serial, rows, unit.certified_version, signal),
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

/** Outputs that a live calibration needs: it compares turns about all three body axes with gravity. */
const LIVE_AXES = 3;

/**
 * The link to a live calibration; null for a unit whose newest recording shows that it has fewer outputs.
 * @param {Unit} unit
 */
const liveLink = ({ serial, axes }) =>
  axes.length && axes.length < LIVE_AXES
    ? null
    : h("a", { class: "button act", href: `/live?unit=${encodeURIComponent(serial)}` }, "Calibrate live");

/** @param {Promise<Ladder | null>} asking */
function ladder(asking) {
  const place = h("div", { style: "min-height: 20rem" });
  loadInto(place, "RMS error by version", async () => {
    const answer = await asking;
    return answer && ladderFigure(answer);
  });
  return cardWithHeader("Error of the versions", null, place);
}

/**
 * Coefficients of one version, or of two side by side, and the uncertainty in use of the first: of the version in force
 * unless another one is chosen, or of the newest where none is.
 * @param {string} serial
 * @param {readonly CalibrationRow[]} rows
 * @param {number | null} inForce
 * @param {AbortSignal} signal
 */
function versionCards(serial, rows, inForce, signal) {
  const usual = inForce ?? rows[0].version;
  /** @type {number} */
  let one = Number(query().version) || usual;
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
    updateQuery({ version: one === usual ? null : one, beside: other });
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
