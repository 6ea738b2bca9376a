// The certificate of a version: the form that asks for the facts of the order, and the files that were issued.

import { download, get, post } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { actButton, button, loadInto, notice, toast, withCommands } from "../core/components.js";
import { dialog } from "../core/dialog.js";
import { capitalised } from "../core/format.js";
import { messageOf, Problem } from "../core/http/errors.js";
import { show, visitSignal } from "../core/router.js";
import { stateChip } from "./certificate_state.js";
import { fieldAt, fieldsFor, orderOf, problemsOf, unstatable } from "./order_fields.js";

/** @import { Certificate, Certification, MissingFact } from "../../../types/api.js" */
/** @import { Answers } from "../../../types/pages.js" */
/** @import { OrderField } from "./order_fields.js" */

/** @type {readonly ["pdf" | "xml" | "json", string][]} */
const FORMATS = [
  ["pdf", "PDF/A-3"],
  ["xml", "DCC (XML)"],
  ["json", "JSON"],
];

/** Entries of forms that were cancelled or left, until the page is loaded anew. @type {Map<string, Answers>} */
const kept = new Map();

/**
 * The files of the newest certificate of a version with its state, or the button that issues one; neither that nor
 * an amended one can be issued of a version that is not certified, or was revoked.
 * @param {string} serial
 * @param {number} version
 * @param {readonly Certificate[]} issued newest first
 * @param {readonly Certification[]} history newest first
 */
export function certificateFiles(serial, version, issued, history) {
  const certified = history.find((act) => act.version === version)?.act === "certify";
  const newest = issued.find((each) => each.version === version);
  if (!newest && !certified)
    return [h("span", { class: "muted small" }, "Certificate: only once it is certified"), needs(serial, version)];
  if (!newest) return issuing(serial, version);
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
    certified ? actButton("Amend", () => askCertificate(serial, version, newest), { kind: "tiny quiet" }) : null,
  );
}

/**
 * What the certificate of a version needs beside its certification, read when it is opened.
 * @param {string} serial
 * @param {number} version
 */
function needs(serial, version) {
  const place = h("div");
  const ontoggle = () =>
    loadInto(place, "Reading what a certificate needs", async () => {
      const never = await notStatable(serial, version, visitSignal());
      return never.length ? neverList(never) : h("p", { class: "small" }, ORDER_STATES);
    });
  return h("details", { ontoggle }, h("summary", {}, "What it needs"), place);
}

/**
 * The button that issues a certificate of a certified version. Where a fact is missing that no order can state, this
 * is said in its place, before anything is pressed; a list that cannot be read leaves the button, which says why.
 * @param {string} serial
 * @param {number} version
 */
function issuing(serial, version) {
  const place = h("div", { class: "stack", role: "group", "aria-label": `Certificate of version ${version}` });
  const issue = actButton("Issue certificate", () => askCertificate(serial, version), { kind: "tiny" });
  loadInto(place, "Reading what a certificate needs", async () => {
    const never = await notStatable(serial, version, visitSignal()).catch(() => []);
    return never.length
      ? h(
          "details",
          {},
          h("summary", {}, `No certificate can be issued. ${missingNames(never)}`),
          h("p", { class: "small" }, NO_ORDER),
          neverList(never),
        )
      : issue;
  });
  return place;
}

/**
 * The facts that a certificate of a version lacks, that no order can state, and that its certification does not supply.
 * @param {string} serial
 * @param {number} version
 * @param {AbortSignal} signal
 */
export const notStatable = async (serial, version, signal) =>
  unstatable(await missingOf(serial, version, signal)).filter(({ fact }) => fact !== AUTHORISATION);

/** @param {readonly MissingFact[]} missing */
export const missingNames = (missing) => `Missing: ${missing.map(({ fact }) => fact).join("; ")}.`;

/**
 * @param {string} serial
 * @param {number} version
 * @param {AbortSignal} signal
 */
const missingOf = (serial, version, signal) =>
  get("/api/units/{serial}/calibrations/{version}/certificate/missing", { path: { serial, version }, signal });

/** @param {readonly MissingFact[]} missing that no order can state */
const neverList = (missing) =>
  h(
    "ul",
    { class: "plain small" },
    missing.map(({ fact, where, remedy }) =>
      h("li", {}, h("strong", {}, `Missing: ${fact}. `), withCommands(remedy || `State it: ${where}.`)),
    ),
  );

/**
 * Ask for the facts of the order, until a certificate is issued; a refusal is shown beside what was filled in. Where a
 * fact is missing that no order can state, the form is not offered: it is said what to do.
 * @param {string} serial
 * @param {number} version
 * @param {Certificate} [replaced]
 */
async function askCertificate(serial, version, replaced) {
  const path = { serial, version };
  const left = visitSignal();
  const missing = await missingOf(serial, version, left);
  const never = unstatable(missing);
  if (never.length) return void (await sayMissing(serial, version, never, left));
  const fields = [...(replaced ? [reasonField(replaced)] : []), ...fieldsFor(missing)];
  const key = JSON.stringify([serial, version, replaced?.number]);
  const given = kept.get(key) ?? {};
  const done = await dialog(
    `Issue a certificate of ${serial} version ${version}`,
    fields.map((field) => ({ ...field, value: given[field.name] })),
    {
      text: "A certificate is a document for a customer; which version is in force does not change. The certificate is written to the audit trail.",
      body: h("p", {}, ofLaboratory(missing)),
      confirm: "Issue certificate",
      signal: left,
      check: (entries) => problemsOf(fields, entries),
      send: (answers, signal) => {
        const body = { by: answers.by, order: orderOf(answers), ...(replaced ? { amend: answers.amend } : {}) };
        return post("/api/units/{serial}/calibrations/{version}/certificate", { path, body, signal });
      },
      refused: refusalOf,
      onclose: (entries) => kept.set(key, entries),
    },
  );
  if (done) {
    kept.delete(key);
    await show();
  } else if (Object.values(kept.get(key) ?? {}).some(Boolean))
    toast("good", "The entries are kept: the form shows them again until the page is reloaded.");
}

/**
 * @param {Certificate} replaced
 * @returns {OrderField}
 */
const reasonField = ({ number }) => ({ name: "amend", place: "amend", label: `Why certificate ${number} is replaced` });

/**
 * What the service refused, beside the fields where it says which; what has no field is said above them.
 * @param {unknown} error
 */
function refusalOf(error) {
  const { errors = [], missing = [] } = error instanceof Problem ? error : {};
  const stated = [
    ...errors.map(({ place, text }) => ({ field: fieldAt(place.slice(1).join(".")), text })),
    ...missing.map(({ table, key, fact }) => ({ field: fieldAt(`order.${table}.${key}`), text: `${fact} is missing` })),
  ];
  const beside = stated.flatMap(({ field, text }) => (field ? [[field, `${capitalised(text)}.`]] : []));
  const whole = stated.length > 0 && beside.length === stated.length;
  return {
    text: whole ? "Nothing was issued. Correct what is marked." : `${capitalised(messageOf(error))}.`,
    problems: Object.fromEntries(beside),
  };
}

/**
 * Say which facts are missing that no order can state, and what to do about each.
 * @param {string} serial
 * @param {number} version
 * @param {readonly MissingFact[]} missing
 * @param {AbortSignal} signal of the visit of the page
 */
const sayMissing = (serial, version, missing, signal) =>
  dialog(`No certificate of ${serial} version ${version} yet`, [], {
    text: `${NO_ORDER} Nothing else is asked for before it is stated.`,
    body: notice("warn", neverList(missing)),
    confirm: "Close",
    signal,
  });

/**
 * Where the facts of the laboratory come from, and what states them in later certificates.
 * @param {readonly MissingFact[]} missing
 */
function ofLaboratory(missing) {
  const fact = missing.find(({ table }) => table === "laboratory");
  return fact ? [NO_LABORATORY, fact.remedy].filter(Boolean).join(" ") : LABORATORY;
}

const LABORATORY = "Laboratory and reference standards come from the bench file.";

/** The fact that the act of certification itself supplies, by its name in the answer. */
const AUTHORISATION = "authorisation";
const ORDER_STATES = "Once it is certified, the order of the customer states everything else that a certificate needs.";
const NO_ORDER = "What is missing belongs to the measurement: the order of a certificate cannot state it.";

/** Where the measurement states no laboratory. */
const NO_LABORATORY = "The measurement states no laboratory, so this form asks for it.";
