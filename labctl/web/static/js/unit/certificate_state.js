// The state of a certificate: as a chip, in words, and as the list of a unit with the act that withdraws one.

import { post } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { instant, personText } from "../core/format.js";
import { actButton, chip, table } from "../core/components.js";
import { dialog, WHO } from "../core/dialog.js";
import { show } from "../core/router.js";

/** @import { Certificate } from "../../../types/api.js" */

/** @type {Record<Certificate["state"], string>} */
const KINDS = { valid: "good", amended: "warn", superseded: "warn", withdrawn: "bad" };

/** @param {Certificate["state"]} state */
export const stateChip = (state) => chip(state, KINDS[state]);

/**
 * @param {Pick<Certificate, "number" | "state" | "state_since" | "state_by">} known
 */
export const stateText = (known) =>
  known.state === "valid"
    ? `Certificate ${known.number} is valid.`
    : `Certificate ${known.number} is ${known.state}: since ${instant(known.state_since)}, by ${personText(known.state_by)}.`;

/**
 * Every certificate of a unit, newest first.
 * @param {readonly Certificate[]} issued
 */
export function certificateTable(issued) {
  return table(
    [
      { title: "Number", cell: (row) => row.number },
      { title: "Version", cell: (row) => `${row.version}` },
      { title: "Issued", cell: (row) => instant(row.issued_at) },
      {
        title: "State",
        cell: (row) =>
          h(
            "span",
            { class: "row tight" },
            stateChip(row.state),
            row.state === "valid" ? null : h("span", { class: "muted small" }, instant(row.state_since)),
          ),
      },
      { title: "Why", prose: true, cell: (row) => row.state_reason || "–" },
      { title: "Valid instead", cell: (row) => row.valid_instead ?? "–" },
      {
        title: "Action",
        cell: (row) =>
          row.state === "withdrawn" ? null : actButton("Withdraw", () => askWithdrawal(row), { kind: "tiny" }),
      },
    ],
    issued,
    { label: "Certificates" },
  );
}

/** @param {Certificate} certificate */
async function askWithdrawal({ number, serial, version }) {
  const title = `Withdraw certificate ${number} of version ${version} of ${serial}`;
  const answers = await dialog(title, [WHO, { name: "reason", label: "Why" }], {
    text: "It stays withdrawn. The list, the page behind its QR code and every copy that is served say so; the version stays in force.",
    confirm: "Withdraw",
    kind: "danger",
    send: ({ by, reason }, signal) => post("/api/certificates/withdraw", { body: { number, by, reason }, signal }),
  });
  if (answers) await show();
}
