// The page behind the QR code of a certificate: which state it is in, and what to compare with the paper. Needs no key:
// number and hash are those that the paper shows.

import { get } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { capitalised, dated } from "../core/format.js";
import { card, factList, notice, pageHeader } from "../core/components.js";
import { labelledField } from "../core/fields.js";
import { Problem } from "../core/http/errors.js";
import { navigate, query } from "../core/router.js";
import { stateChip, stateText } from "../unit/certificate_state.js";

/** @import { PageContext } from "../../../types/pages.js" */
/** @import { PublicCertificate } from "../../../types/api.js" */

/** @param {PageContext} context */
export async function page({ signal }) {
  const { number = "", calibration = "" } = query();
  const asked = number !== "" && calibration !== "";
  return h(
    "div",
    { class: "page" },
    pageHeader("State of a certificate", number ? `Certificate ${number}` : null),
    asked ? await found(number, calibration, signal) : null,
    card(asked ? "Another certificate" : "Certificate to look up", lookUp(number, calibration)),
  );
}

/**
 * @param {string} number
 * @param {string} calibration
 * @param {AbortSignal} signal
 */
async function found(number, calibration, signal) {
  try {
    return shown(await get("/api/certificates/state", { query: { number, calibration }, signal }));
  } catch (error) {
    if (error instanceof Problem && error.status === 404)
      return notice("bad", h("p", {}, h("strong", {}, "Unknown certificate. "), `${capitalised(error.message)}.`));
    throw error;
  }
}

/** @param {PublicCertificate} known */
function shown(known) {
  const instead = known.valid_instead;
  return h(
    "section",
    { class: "card stack", "aria-label": `Certificate ${known.number}` },
    notice(
      known.state === "valid" ? "good" : "bad",
      h("p", {}, h("strong", {}, stateText(known))),
      known.state_reason ? h("p", {}, `Reason: ${known.state_reason}`) : null,
      known.state === "valid"
        ? null
        : h("p", {}, instead ? `Valid now: certificate ${instead}.` : "None is valid now."),
    ),
    known.notices.length
      ? notice(
          "bad",
          known.notices.map((each) => h("p", {}, each)),
        )
      : null,
    factList([
      ["State", stateChip(known.state)],
      ["Number", known.number],
      ["Laboratory", known.laboratory],
      ["Unit", known.serial, null, `version ${known.version}`],
      ["Issued", dated(known.issued_at)],
      known.replaced_by ? ["Amended by", `certificate ${known.replaced_by}`] : null,
      known.superseded_by ? ["Superseded by", `certificate ${known.superseded_by}`] : null,
    ]),
    h("p", {}, "Compare with the paper: SHA-256 of the calibration"),
    h("p", {}, h("code", { style: "overflow-wrap: anywhere" }, known.calibration_hash)),
    h("p", {}, "SHA-256 of the certificate as JSON file"),
    h("p", {}, h("code", { style: "overflow-wrap: anywhere" }, known.hash)),
  );
}

/**
 * The form for a certificate whose QR code cannot be read.
 * @param {string} number
 * @param {string} calibration
 */
function lookUp(number, calibration) {
  const fields = {
    number: h("input", { name: "number", value: number, required: true }),
    calibration: h("input", { name: "calibration", value: calibration, required: true, minlength: 16 }),
  };
  /** @param {Event} event */
  const onsubmit = (event) => {
    event.preventDefault();
    const asked = { number: fields.number.value.trim(), calibration: fields.calibration.value.trim() };
    return navigate(`/certificates?${new URLSearchParams(asked)}`);
  };
  return h(
    "form",
    { class: "stack", onsubmit },
    labelledField("Number of the certificate", fields.number),
    labelledField("SHA-256 of the calibration on it, at least 16 digits", fields.calibration),
    h("div", { class: "row" }, h("button", { class: "button primary", type: "submit" }, "Look up")),
  );
}
