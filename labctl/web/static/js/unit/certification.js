// Certification of a version: what is known of it, the questions that are asked, and the acts that were kept.

import { get, post } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { dated, instant, number } from "../core/format.js";
import { actButton, chip, factList, notice, table, toast } from "../core/components.js";
import { dialog } from "../core/dialog.js";
import { show } from "../core/router.js";
import { withoutPart } from "./uncertainty_parts.js";

/** @import { AnyAxisUncertainty, Assessment, Certification, Fetch, ReleaseRequest } from "../../../types/api.js" */
/** @import { Fact, Field } from "../../../types/pages.js" */

/** @type {Record<string, [text: string, kind: string]>} */
export const VERDICTS = {
  adequate: ["adequate", "good"],
  missing: ["missing", "warn"],
  ambiguous: ["ambiguous", "warn"],
  unexplained: ["unexplained", "warn"],
  insufficient_data: ["too little data", "warn"],
};

/**
 * The verdict of an assessment, or the one that was kept with an act.
 * @param {{ verdict: string | null }} known
 */
export function verdictChip(known) {
  const [text, kind] = VERDICTS[known.verdict ?? ""] ?? ["none", ""];
  return chip(text, kind);
}

/**
 * What was overridden by an act.
 * @param {Certification} act
 */
export const overridden = (act) =>
  notice(
    "warn",
    h("p", {}, h("strong", {}, "Certified despite objections. "), `${act.by}: ${act.reason}`),
    act.objections.map((each) => h("p", { class: "small" }, each.text)),
  );

/**
 * Ask who certifies a version and why; the verdict on it is shown, and what would have to be overridden.
 * @param {string} serial
 * @param {number} version
 */
export async function askCertification(serial, version) {
  const known = await get("/api/units/{serial}/calibrations/{version}/assessment", {
    path: { serial, version },
  });
  const needed = known.override_needed;
  const words = `A sentence: at least ${known.least_reason_characters} characters and ${known.least_reason_words} words.`;
  /** @type {Field[]} */
  const fields = [
    { name: "by", label: "Who" },
    {
      name: "reason",
      label: "Why",
      hint: needed ? words : null,
      minlength: needed ? known.least_reason_characters : null,
    },
    {
      name: "due_days",
      label: "Due again in days",
      hint: known.due_from ? `This number of days comes from the ${known.due_from}.` : "Empty: no date.",
      type: "number",
      value: known.due_days === null ? "" : String(known.due_days),
      required: false,
    },
  ];
  if (needed) fields.push({ name: "override", label: "Certify this version despite the objections", type: "checkbox" });
  const answers = await dialog(`Certify version ${version}: put it in force`, fields, {
    text: "After this, every request for the calibration of this unit gets this version. The certification is written to the audit trail. It makes no document: a certificate for a customer is issued afterwards.",
    body: assessed(known),
    confirm: "Certify: put in force",
    kind: needed ? "danger" : "primary",
  });
  if (!answers) return;
  const body = {
    by: answers.by,
    reason: answers.reason,
    due_days: answers.due_days ? Number(answers.due_days) : 0,
    ...(answers.override ? { override: true } : {}),
  };
  await post("/api/units/{serial}/calibrations/{version}/certify", { path: { serial, version }, body });
  await show();
}

/**
 * @param {string} serial
 * @param {number} version
 */
export async function askRevocation(serial, version) {
  const answers = await dialog(
    `Revoke version ${version}`,
    [
      { name: "by", label: "Who" },
      { name: "reason", label: "Why" },
    ],
    {
      text: "The unit then has no calibration in force, and every certificate of the version is withdrawn for good. The revocation is written to the audit trail.",
      confirm: "Revoke",
      kind: "danger",
    },
  );
  if (!answers) return;
  const body = { by: answers.by, reason: answers.reason };
  const done = await post("/api/units/{serial}/calibrations/{version}/revoke", { path: { serial, version }, body });
  await show();
  const said = consequences(done);
  if (said) toast("warn", `Version ${version} is revoked. ${said}`, { stays: true });
}

/**
 * What a revocation withdrew, and who has to be notified; empty for nothing.
 * @param {Certification} done
 */
const consequences = ({ withdrawn_certificates: certificates, fetched_by: fetches }) =>
  [
    certificates.length ? `Withdrawn: ${certificates.join(", ")}.` : "",
    fetches.length ? `Notify those who fetched it: ${fetches.map((each) => each.who).join(", ")}.` : "",
  ]
    .filter(Boolean)
    .join(" ");

/** @param {readonly Fetch[]} rows */
export const fetchTable = (rows) =>
  table(
    [
      { title: "Key", cell: (row) => row.who },
      { title: "First fetched", cell: (row) => instant(row.first_at) },
      { title: "Last fetched", cell: (row) => instant(row.last_at) },
    ],
    rows,
    { label: "Who fetched it" },
  );

/**
 * Versions that wait for a second person, null without any.
 * @param {readonly ReleaseRequest[]} waiting
 */
export const waitingNotice = (waiting) =>
  waiting.length
    ? notice(
        "warn",
        waiting.map((each) =>
          h(
            "div",
            { class: "row" },
            h(
              "p",
              {},
              h("strong", {}, `Version ${each.version} waits for a second person. `),
              `${each.by} (key ${each.by_key}): ${each.reason}`,
            ),
            actButton("Release", () => askRelease(each), { kind: "tiny" }),
          ),
        ),
      )
    : null;

/** @param {ReleaseRequest} waiting */
async function askRelease({ serial, version, by_key }) {
  const fields = [
    { name: "by", label: "Who" },
    { name: "reason", label: "Why" },
  ];
  const answers = await dialog(`Release version ${version}`, fields, {
    text: `You release it as the second person, with another key than ${by_key}. It is in force then.`,
    confirm: "Release",
  });
  if (!answers) return;
  const body = { by: answers.by, reason: answers.reason };
  await post("/api/units/{serial}/calibrations/{version}/release", { path: { serial, version }, body });
  await show();
}

/**
 * Who acted: the name, and the key of each person; without a key the name is as typed.
 * @param {Certification} act
 */
export const persons = (act) =>
  [
    act.by_key ? `${act.by} (key ${act.by_key})` : act.by,
    act.released_by ? `released by ${act.released_by} (key ${act.released_key})` : "",
  ]
    .filter(Boolean)
    .join(", ");

/**
 * What is known of a version: verdict, errors, objections.
 * @param {Assessment} known
 */
function assessed(known) {
  return h(
    "div",
    { class: "stack" },
    factList([
      ["Verdict", verdictChip(known), null, known.verdict_recording ? `recording ${known.verdict_recording}` : null],
      [
        "RMS error",
        number(known.error.rms_dps),
        "deg/s",
        known.error.raw_rms_dps === null ? null : `${number(known.error.raw_rms_dps)} without correction`,
      ],
      ["RMS error at temperatures left out of the fit", number(known.error.heldout_rms_dps), "deg/s"],
      ...Object.entries(known.any_axis).map(largestUncertainty),
    ]),
    known.objections.some((each) => each.what === "verdict")
      ? null
      : h("p", {}, known.verdict_text || `No verdict: ${known.verdict_reason}.`),
    known.objections.length
      ? notice(
          "bad",
          h("p", {}, h("strong", {}, "Objections:")),
          h(
            "ul",
            { class: "plain" },
            known.objections.map((each) => h("li", {}, `${each.text}. To do: ${each.do}.`)),
          ),
        )
      : null,
  );
}

/**
 * The largest uncertainty of one output in use, or why it is unknown.
 * @param {[axis: string, found: AnyAxisUncertainty]} of
 * @returns {Fact}
 */
const largestUncertainty = ([axis, found]) => [
  `Largest U of ${axis} in use, k = 2`,
  found.bound_dps === null ? chip("unknown", "warn") : number(found.bound_dps),
  found.bound_dps === null ? null : "deg/s",
  found.bound_dps === null ? `any axis: ${withoutPart(found.why)}` : `any axis, up to ${number(found.reach_dps)} deg/s`,
];

/** @param {readonly Certification[]} history */
export function certificationTable(history) {
  return table(
    [
      { title: "When", cell: (act) => h("span", { class: "nowrap" }, dated(act.at)) },
      { title: "What", cell: (act) => h("span", { class: "nowrap" }, `${act.act} version ${act.version}`) },
      {
        title: "Verdict",
        cell: (act) =>
          act.override === null
            ? "–"
            : h(
                "span",
                { class: "row tight", title: act.verdict_text || act.verdict_reason },
                verdictChip(act),
                act.override ? chip("overridden", "bad") : null,
              ),
      },
      { title: "Who", cell: persons },
      { title: "Why", prose: true, cell: (act) => act.reason },
    ],
    history,
    { label: "Certifications" },
  );
}
