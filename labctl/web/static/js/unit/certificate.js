// The certificate of a version: the form that asks for the facts of the order, and the files that were issued.

import { download, get, post } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { actButton, button, notice } from "../core/components.js";
import { dialog, WHO } from "../core/dialog.js";
import { show, visitSignal } from "../core/router.js";
import { stateChip } from "./certificate_state.js";

/** @import { Certificate, MissingFact } from "../../../types/api.js" */
/** @import { Answers, Field } from "../../../types/pages.js" */

/** @type {readonly ["pdf" | "xml" | "json", string][]} */
const FORMATS = [
  ["pdf", "PDF/A-3"],
  ["xml", "DCC (XML)"],
  ["json", "JSON"],
];

/** @type {readonly Field[]} */
const FIELDS = [
  { ...WHO, label: "Issued by" },
  { name: "name", label: "Customer" },
  { name: "street", label: "Street and number" },
  { name: "post_code", label: "Post code" },
  { name: "city", label: "City" },
  { name: "country", label: "Country", hint: "Two letters, such as DE (ISO 3166-1)." },
  { name: "email", label: "E-mail", type: "email" },
  { name: "contact", label: "Contact person", required: false },
  { name: "order", label: "Number of the order", required: false },
  { name: "manufacturer", label: "Manufacturer of the item" },
  { name: "condition", label: "Condition of the item on receipt" },
  { name: "received", label: "Received on", type: "date", required: false },
  { name: "deviations", label: "Deviations from the method", hint: "Empty: none.", required: false },
  { name: "specification", label: "Conformity to the specification", hint: "Empty: no statement.", required: false },
  {
    name: "limit_dps",
    label: "Limit of the error in the specification, deg/s",
    hint: "Needed where a specification is stated.",
    required: false,
  },
  {
    name: "own_axis",
    label: "The item turns about the axis of one output at a time",
    type: "checkbox",
    hint: "Needed where U is known about the axis of each output alone (“own axis”).",
    required: false,
  },
  {
    name: "guard_band",
    label: "With a guard band as wide as the uncertainty",
    type: "checkbox",
    required: false,
  },
];

/** The laboratory, asked for where the measurement does not name it. @type {readonly Field[]} */
const LABORATORY_FIELDS = [
  { name: "laboratory_name", label: "Laboratory" },
  { name: "laboratory_street", label: "Street and number of the laboratory" },
  { name: "laboratory_post_code", label: "Post code of the laboratory" },
  { name: "laboratory_city", label: "City of the laboratory" },
  {
    name: "laboratory_country",
    label: "Country of the laboratory",
    hint: "Two letters, such as DE (ISO 3166-1).",
  },
  { name: "laboratory_email", label: "E-mail of the laboratory", type: "email" },
];

/**
 * The files of the newest certificate of a version with its state, or the button that issues one.
 * @param {string} serial
 * @param {number} version
 * @param {readonly Certificate[]} issued newest first
 */
export function certificateFiles(serial, version, issued) {
  const newest = issued.find((each) => each.version === version);
  if (!newest) return actButton("Issue certificate", () => askCertificate(serial, version), { kind: "tiny" });
  return h(
    "div",
    { class: "stack", role: "group", "aria-label": `Certificate ${newest.number}` },
    h(
      "span",
      { class: "row tight" },
      h("span", { class: "muted small" }, `Certificate ${newest.number}`),
      newest.state === "valid" ? null : stateChip(newest.state),
    ),
    h(
      "div",
      { class: "row tight" },
      FORMATS.map(([format, title]) =>
        button(
          title,
          async () => {
            const path = "/api/units/{serial}/calibrations/{version}/certificate";
            await download(path, `${newest.number}.${format}`, { path: { serial, version }, query: { format } });
          },
          { kind: "tiny" },
        ),
      ),
    ),
    actButton("Amend", () => askCertificate(serial, version, newest), { kind: "tiny quiet" }),
  );
}

/**
 * Ask for the facts of the order, until a certificate is issued.
 * @param {string} serial
 * @param {number} version
 * @param {Certificate} [replaced]
 */
async function askCertificate(serial, version, replaced) {
  const why = replaced ? [{ name: "amend", label: `Why certificate ${replaced.number} is replaced` }] : [];
  const left = visitSignal();
  const [imported, missing] = await Promise.all([
    wasImported(serial, version, left),
    missingFacts(serial, version, left),
  ]);
  const fields = [...why, ...(asksLaboratory(missing) ? LABORATORY_FIELDS : []), ...FIELDS];
  const answers = await dialog(`Issue a certificate of version ${version} of ${serial}`, fields, {
    text: "A certificate is a document for a customer; which version is in force does not change. The certificate is written to the audit trail.",
    body: notesOf(imported, missing),
    confirm: "Issue certificate",
    signal: left,
    send: (given, signal) =>
      post("/api/units/{serial}/calibrations/{version}/certificate", {
        path: { serial, version },
        body: { by: given.by, order: orderOf(given), ...(replaced ? { amend: given.amend } : {}) },
        signal,
      }),
  });
  if (answers) await show();
}

/**
 * The mandatory facts that the version does not state, each with the table of the order that can state it.
 * @param {string} serial
 * @param {number} version
 * @param {AbortSignal} signal
 */
const missingFacts = (serial, version, signal) =>
  get("/api/units/{serial}/calibrations/{version}/certificate/missing", { path: { serial, version }, signal });

/** @param {readonly MissingFact[]} missing */
const asksLaboratory = (missing) => missing.some(({ table }) => table === "laboratory");

/**
 * What the form says before anything is filled in: where the laboratory comes from, and what it does not ask for.
 * @param {boolean} imported
 * @param {readonly MissingFact[]} missing
 */
const notesOf = (imported, missing) =>
  h(
    "div",
    { class: "stack" },
    h(
      "p",
      {},
      asksLaboratory(missing) ? NO_LABORATORY : "Laboratory and reference standards come from the bench file.",
    ),
    imported ? notice("warn", h("p", {}, IMPORTED)) : null,
  );

/** Where the campaign of the version states no laboratory. */
const NO_LABORATORY =
  "The measurement states no laboratory, so this form asks for it. A [laboratory] in the bench file states it in every certificate of later campaigns.";

/** What the certificate of a version needs beyond this form where no campaign measured it. */
const IMPORTED =
  "This version was fitted to an imported recording. Its certificate also states the method, the days of the measurement, the reference standards and the repeatability, which this form does not ask for: give them in recording.toml, import it again, and issue the certificate with labctl certificate and a file of the order.";

/**
 * Whether a recording of a version is from another bench than that of a campaign.
 * @param {string} serial
 * @param {number} version
 * @param {AbortSignal} signal
 */
async function wasImported(serial, version, signal) {
  const [rows, { recordings }] = await Promise.all([
    get("/api/recordings", { query: { unit: serial }, signal }),
    get("/api/units/{serial}/calibrations/{version}", { path: { serial, version }, signal }),
  ]);
  return rows.some((row) => recordings.includes(row.id) && row.origin === "import");
}

/** @param {Answers} given */
function orderOf(given) {
  const { name, street, post_code, city, country, email, contact, order } = given;
  return {
    ...(given.laboratory_name
      ? {
          laboratory: {
            name: given.laboratory_name,
            street: given.laboratory_street,
            post_code: given.laboratory_post_code,
            city: given.laboratory_city,
            country: given.laboratory_country,
            email: given.laboratory_email,
          },
        }
      : {}),
    customer: { name, street, post_code, city, country, email, contact, order },
    item: {
      manufacturer: given.manufacturer,
      condition: given.condition,
      ...(given.received ? { received: given.received } : {}),
    },
    method: { deviations: given.deviations },
    ...(given.specification
      ? {
          conformity: {
            specification: given.specification,
            limit_dps: Number(given.limit_dps),
            about: given.own_axis ? /** @type {const} */ ("own axis") : /** @type {const} */ ("any axis"),
            rule: given.guard_band ? /** @type {const} */ ("guard-band") : /** @type {const} */ ("simple"),
          },
        }
      : {}),
  };
}
