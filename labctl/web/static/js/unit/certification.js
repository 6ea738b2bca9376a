// Certification of a version: what is known of it, the questions that are asked, and the acts that were kept.

import { get, post } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { dated, instant, inWords, number, personText } from "../core/format.js";
import { actButton, chip, factList, notice, table, toast } from "../core/components.js";
import { dialog, WHO } from "../core/dialog.js";
import { show, visitSignal } from "../core/router.js";
import { missingNames, notStatable } from "./certificate.js";
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
    h("p", {}, h("strong", {}, "Certified despite objections. "), `${personText(act.by)}: ${act.reason}`),
    act.objections.map((each) => h("p", { class: "small" }, each.text)),
  );

/** An id of an effect in a sentence of the service. */
const ID = /[a-z]+(?:_[a-z]+)+/g;

/**
 * What an adequate verdict does not show: which of several effects is the cause; null for nothing.
 * @param {{ cause_not_known: readonly string[] }} known
 */
export const causesNotKnown = ({ cause_not_known: texts }) =>
  texts.length
    ? notice(
        "warn",
        texts.map((text) =>
          h("p", {}, h("strong", {}, "The cause is not known. "), inWords(text, text.match(ID) ?? [])),
        ),
      )
    : null;

/** The longest interval between two calibrations that the service takes, days. */
const MAX_DUE_DAYS = 36_500;
/** What the request says for no due date. */
const NO_DUE_DATE = 0;

/**
 * Ask who certifies a version and why; the verdict on it is shown, and what would have to be overridden.
 * @param {string} serial
 * @param {number} version
 * @param {AbortSignal} [left] aborted when the page is left that this is asked on
 */
export async function askCertification(serial, version, left = visitSignal()) {
  const path = { serial, version };
  const [known, never] = await Promise.all([
    get("/api/units/{serial}/calibrations/{version}/assessment", { path, signal: left }),
    notStatable(serial, version, left).catch(() => []), // then it is said when the certificate is issued
  ]);
  const needed = known.override_needed;
  const words = `A sentence: at least ${known.least_reason_characters} characters and ${known.least_reason_words} words.`;
  /** @type {Field[]} */
  const fields = [
    WHO,
    {
      name: "reason",
      label: "Why",
      hint: needed ? words : null,
      minlength: needed ? known.least_reason_characters : null,
    },
    {
      name: "due_days",
      label: "Due again in days",
      hint: `${known.due_from ? `This number of days comes from the ${known.due_from}. ` : ""}From 1 to ${MAX_DUE_DAYS}; empty: no due date.`,
      type: "number",
      min: 1,
      max: MAX_DUE_DAYS,
      value: known.due_days === null ? "" : String(known.due_days),
      required: false,
    },
  ];
  if (needed) fields.push({ name: "override", label: "Certify this version despite the objections", type: "checkbox" });
  /** @type {keyof typeof AGAIN | null} */
  let already = null;
  const answers = await dialog(`Certify version ${version} of ${serial}: put it in force`, fields, {
    text: `After this, every request for the calibration of this unit gets this version. The certification is written to the audit trail. It makes no document${never.length ? "." : ": a certificate for a customer is issued afterwards."}`,
    body: [
      assessed(known),
      never.length
        ? h("p", { class: "small" }, h("strong", {}, "No certificate can be issued afterwards. "), missingNames(never))
        : null,
    ],
    confirm: "Certify: put in force",
    kind: needed ? "danger" : "primary",
    signal: left,
    send: async ({ by, reason, due_days, override }, signal) => {
      const done = await post("/api/units/{serial}/calibrations/{version}/certify", {
        path,
        body: {
          by,
          reason,
          due_days: due_days ? Number(due_days) : NO_DUE_DATE,
          ...(override ? { override: true } : {}),
        },
        signal,
      });
      already = "already_in_force" in done ? done.already_in_force : null;
    },
  });
  if (!answers) return;
  await show();
  if (already) toast("warn", `Version ${version} was in force already. ${AGAIN[already]}`, { stays: true });
}

/** What a certification of the version in force has done. */
const AGAIN = {
  unchanged: "Person, reason, verdict and due date are the same: nothing was written.",
  renewed: "Your certification is written as another entry.",
};

/**
 * @param {string} serial
 * @param {number} version
 */
export async function askRevocation(serial, version) {
  let said = "";
  const answers = await dialog(`Revoke version ${version} of ${serial}`, [WHO, { name: "reason", label: "Why" }], {
    text: "The unit then has no calibration in force, and every certificate of the version is withdrawn for good. The revocation is written to the audit trail.",
    confirm: "Revoke",
    kind: "danger",
    send: async ({ by, reason }, signal) => {
      const path = { serial, version };
      said = consequences(
        await post("/api/units/{serial}/calibrations/{version}/revoke", { path, body: { by, reason }, signal }),
      );
    },
  });
  if (!answers) return;
  await show();
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
              `${personText(each.by)} (key ${each.by_key}): ${each.reason}`,
            ),
            actButton("Release", () => askRelease(each), { kind: "tiny" }),
          ),
        ),
      )
    : null;

/** @param {ReleaseRequest} waiting */
async function askRelease({ serial, version, by_key }) {
  const fields = [WHO, { name: "reason", label: "Why" }];
  const answers = await dialog(`Release version ${version} of ${serial}`, fields, {
    text: `You release it as the second person, with another key than ${by_key}. It is in force then.`,
    confirm: "Release",
    send: ({ by, reason }, signal) =>
      post("/api/units/{serial}/calibrations/{version}/release", {
        path: { serial, version },
        body: { by, reason },
        signal,
      }),
  });
  if (answers) await show();
}

/**
 * Who acted: the name, and the key of each person; without a key the name is as typed.
 * @param {Certification} act
 */
export const persons = (act) =>
  [
    act.by_key ? `${personText(act.by)} (key ${act.by_key})` : personText(act.by),
    act.released_by ? `released by ${personText(act.released_by)} (key ${act.released_key})` : "",
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
    known.in_force
      ? notice("warn", `Version ${known.version} is in force already; this certification would be another entry.`)
      : null,
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
    causesNotKnown(known),
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
  `Largest expanded uncertainty U of the corrected rate ${axis}, k = 2`,
  found.bound_dps === null ? chip("unknown", "warn") : number(found.bound_dps),
  found.bound_dps === null ? null : "deg/s",
  `while the unit turns about any axis, at up to ${number(found.reach_dps)} deg/s${
    found.bound_dps === null ? `: ${withoutPart(found.why)}` : ""
  }`,
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
                {
                  class: "row tight",
                  title: [act.verdict_text || act.verdict_reason, ...act.cause_not_known].join(" "),
                },
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
