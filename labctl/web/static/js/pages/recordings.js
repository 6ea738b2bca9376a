// The page of all recordings, with the import form.

import { getPart } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { count, day } from "../core/format.js";
import { chip, emptyState, pageHeader, cardWithHeader, table } from "../core/components.js";
import { longList } from "../core/long_list.js";
import { importForm } from "../recordings/import_form.js";
import { SIMULATED } from "../campaigns/campaign_time.js";

/** @import { RecordingRow } from "../../../types/api.js" */

/** @import { PageContext } from "../../../types/pages.js" */

/** @param {PageContext} context */
export async function page({ query, signal }) {
  const { unit } = query;
  const list = await longList({
    what: "recordings",
    hint: "Serial number or notes.",
    search: query.search,
    read: (part) => getPart("/api/recordings", { query: unit ? { ...part, unit } : part, signal }),
    draw: recordingTable,
    empty: noRecordings(),
  });
  return h(
    "div",
    { class: "page" },
    pageHeader(
      "Recordings",
      "All data sets of one unit in one campaign, or imported as files.",
      h("a", { class: "button", href: "/noise" }, "Compare noise at rest"),
    ),
    importForm(list.refresh),
    cardWithHeader(
      unit ? `Recordings of ${unit}` : "All recordings",
      unit ? h("a", { class: "button tiny", href: "/recordings" }, "Show all units") : null,
      list.element,
    ),
  );
}

/** @type {Record<string, string>} */
const KINDS = { samples: "every reading", points: "means", coefficients: "a published table" };

/** @param {readonly RecordingRow[]} rows */
function recordingTable(rows) {
  return table(
    [
      {
        title: "Recording",
        cell: (row) => [
          h("a", { href: `/recordings/${row.id}` }, `Recording ${row.id}`),
          row.notes ? h("span", { class: "muted small secondary two-lines", title: row.notes }, row.notes) : null,
        ],
      },
      {
        title: "Unit",
        cell: (row) => h("a", { href: `/units/${encodeURIComponent(row.serial)}`, class: "nowrap" }, row.serial),
      },
      { title: "Holds", cell: (row) => chip(KINDS[row.kind] ?? row.kind) },
      { title: "Data sets", number: true, cell: (row) => count(row.datasets) },
      { title: "Readings", number: true, cell: (row) => (row.kind === "samples" ? count(row.readings) : "–") },
      {
        title: "From",
        cell: (row) =>
          row.campaign
            ? h("a", { href: `/campaigns/${row.campaign}`, class: "nowrap" }, `campaign ${row.campaign}`)
            : h("span", { class: "muted" }, row.origin),
      },
      {
        title: "Stored",
        cell: (row) => [
          h("span", { class: "nowrap" }, day(row.created_at)),
          row.simulated_time ? h("span", { class: "muted small secondary nowrap" }, SIMULATED) : null,
        ],
      },
      {
        title: h("span", { class: "visually-hidden" }, "Explore"),
        acts: true,
        cell: (row) =>
          h(
            "a",
            { class: "button tiny", href: `/explore?unit=${encodeURIComponent(row.serial)}&recording=${row.id}` },
            "Explore",
          ),
      },
    ],
    rows,
    { label: "Recordings", first: "13rem" },
  );
}

const noRecordings = () =>
  emptyState(
    h("p", {}, "There is no recording yet. Import a file, or run a campaign."),
    h(
      "p",
      {},
      "Drop a folder above, ",
      h("a", { href: "/campaigns/new" }, "run a campaign"),
      ", or ",
      h("a", { href: "/start" }, "begin with an example"),
      ".",
    ),
  );
