// The certificate of a version: the form that asks for the facts of the order, and the files that were issued.

import { download, get, post } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { actButton, button, notice, toast, withCommands } from "../core/components.js";
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
  if (!newest && !certified) return h("span", { class: "muted small" }, "Certificate: only once it is certified");
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
    certified ? actButton("Amend", () => askCertificate(serial, version, newest), { kind: "tiny quiet" }) : null,
  );
}

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
  const missing = await get("/api/units/{serial}/calibrations/{version}/certificate/missing", { path, signal: left });
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
      body: h("p", {}, missing.some(({ table }) => table === "laboratory") ? NO_LABORATORY : LABORATORY),
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
    text: "What is missing belongs to the measurement, so this page cannot add it. Nothing else is asked for before it is stated.",
    body: notice(
      "warn",
      h(
        "ul",
        { class: "plain" },
        missing.map(({ fact, where, remedy }) =>
          h("li", {}, h("strong", {}, `Missing: ${fact}. `), withCommands(remedy || `State it: ${where}.`)),
        ),
      ),
    ),
    confirm: "Close",
    signal,
  });

const LABORATORY = "Laboratory and reference standards come from the bench file.";

/** Where the measurement states no laboratory. */
const NO_LABORATORY =
  "The measurement states no laboratory, so this form asks for it. A [laboratory] in the bench file states it in every certificate of later campaigns.";
