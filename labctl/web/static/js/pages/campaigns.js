// The page of all campaigns and of the schedule.

import { get, getPart, remove } from "../core/http/api.js";
import { Problem } from "../core/http/errors.js";
import { setChildren, h } from "../core/elements.js";
import { duration, instant, percent, personText } from "../core/format.js";
import { actButton, card, chip, emptyState, pageHeader, table } from "../core/components.js";
import { longList } from "../core/long_list.js";
import { setTrouble } from "../core/freshness/line.js";
import { linkButton } from "../bench/actions.js";
import { attendanceNotice } from "../campaigns/attendance.js";
import { campaignInstant, durationTaken } from "../campaigns/campaign_time.js";
import { isRunning } from "../campaigns/states.js";
import { stateChip } from "../campaigns/state_chip.js";
import { startTime } from "../campaigns/start_time.js";

/** @import { Campaign, Scheduled, StartEvent } from "../../../types/api.js" */

/** @import { PageContext } from "../../../types/pages.js" */

const POLL_MS = 4000;

/** @param {PageContext} context */
export async function page({ query, signal }) {
  const scheduled = h("div", {});
  const list = await longList({
    what: "campaigns",
    hint: "Recipe, bench, state or serial number of a unit.",
    search: query.search,
    read: (part) => getPart("/api/campaigns", { query: part, signal }),
    draw: campaignTable,
    empty: emptyState(
      h("p", {}, "No campaign has been run yet."),
      h("p", {}, linkButton("Plan the first", "/campaigns/new", "primary")),
    ),
  });
  async function showSchedule() {
    const schedule = await get("/api/schedule", { signal });
    setChildren(scheduled, schedule.length ? scheduleCard(schedule, showAll) : null);
  }
  const showAll = () => Promise.all([list.refresh(), showSchedule()]);
  await showSchedule();
  const polling = setInterval(async () => {
    if (!list.rows().some(isRunning)) return;
    try {
      await showAll();
      setTrouble();
    } catch (error) {
      if (error instanceof Problem) setTrouble(error.message);
    }
  }, POLL_MS);
  signal.addEventListener("abort", () => clearInterval(polling));
  window.addEventListener("labctl:fresh", () => showAll().catch(() => {}), { signal });
  return h(
    "div",
    { class: "page" },
    pageHeader(
      "Campaigns",
      "One run of a recipe on a bench.",
      linkButton("Plan a campaign", "/campaigns/new", "primary"),
    ),
    scheduled,
    card("All campaigns", list.element),
  );
}

/** @param {readonly Campaign[]} rows */
function campaignTable(rows) {
  return table(
    [
      {
        title: "Campaign",
        cell: (row) => [
          h("a", { href: `/campaigns/${row.id}`, class: "nowrap" }, `Campaign ${row.id}`),
          h("span", { class: "muted small secondary" }, `${row.recipe} on ${row.bench}`),
        ],
      },
      {
        title: "State",
        cell: (row) => [
          stateChip(row),
          row.state !== "done" && row.state !== "running" && row.reason
            ? h("span", { class: "muted small secondary two-lines", title: row.reason }, row.reason)
            : null,
        ],
      },
      {
        title: "Progress",
        cell: (row) =>
          h(
            "div",
            { class: "progress-cell" },
            h(
              "div",
              { class: "meter", role: "img", "aria-label": percent(row.progress) },
              h("i", { style: `width: ${100 * row.progress}%` }),
            ),
            h("span", { class: "small" }, percent(row.progress)),
          ),
      },
      {
        title: "Begun",
        cell: (row) => [
          h("span", { class: "nowrap" }, campaignInstant(row, row.started_at)),
          h(
            "span",
            { class: "muted small secondary nowrap" },
            isRunning(row) ? `ends ${campaignInstant(row, row.expected_end)}` : durationTaken(row),
          ),
        ],
      },
      {
        title: "Units and recordings",
        cell: (row) =>
          Object.entries(row.recordings).map(([serial, recording]) =>
            h(
              "div",
              {},
              h("a", { href: `/units/${encodeURIComponent(serial)}` }, serial),
              h(
                "span",
                { class: "small secondary" },
                h("a", { href: `/recordings/${recording}` }, `Recording ${recording}`),
              ),
            ),
          ),
      },
    ],
    rows,
    { label: "Every campaign", first: "8rem" },
  );
}

const OUTCOMES = { started: "good", refused: "bad", missed: "warn", claimed: "accent" };

/**
 * @param {readonly Scheduled[]} rows
 * @param {() => unknown} again
 */
function scheduleCard(rows, again) {
  /** @param {StartEvent} event */
  const came = (event) =>
    h(
      "span",
      { class: "small secondary" },
      chip(event.outcome, OUTCOMES[event.outcome] ?? ""),
      ` ${instant(event.at)} `,
      event.campaign ? h("a", { href: `/campaigns/${event.campaign}` }, `campaign ${event.campaign}`) : event.message,
    );
  return card(
    "Schedule",
    table(
      [
        {
          title: "Begins",
          cell: (row) => [
            row.state === "missed" ? chip("missed", "warn") : startTime(row),
            row.confirmed_by
              ? h(
                  "span",
                  { class: "muted small secondary" },
                  `${personText(row.confirmed_by)} confirmed that the bench will be clear`,
                )
              : null,
          ],
        },
        rows.some((row) => row.attendance)
          ? {
              title: "Needs a person",
              prose: true,
              cell: (row) => (row.attendance ? attendanceNotice(row.attendance) : h("span", { class: "muted" }, "no")),
            }
          : null,
        {
          title: "Recipe",
          cell: (row) => [
            row.recipe,
            row.clip
              ? h("span", { class: "muted small secondary" }, "without points beyond the limits of the bench")
              : null,
          ],
        },
        { title: "Again", cell: (row) => (row.cron ? h("code", { class: "nowrap" }, row.cron) : "once") },
        { title: "Priority", number: true, cell: (row) => row.priority },
        {
          title: "May be late by",
          number: true,
          cell: (row) => (typeof row.missed_after_s === "number" ? duration(row.missed_after_s) : "any time"),
        },
        {
          title: "Before",
          cell: (row) => (row.history.length ? row.history.slice(-2).map(came) : h("span", { class: "muted" }, "–")),
        },
        {
          title: h("span", { class: "visually-hidden" }, "Cancel"),
          acts: true,
          cell: (row) =>
            actButton(
              row.state === "missed" ? "Remove" : "Cancel",
              async () => {
                await remove("/api/schedule/{start}", { path: { start: row.id } });
                await again();
              },
              { kind: "tiny", done: "Removed from the schedule." },
            ),
        },
      ],
      rows,
      { label: "Scheduled starts", first: "9rem" },
    ),
  );
}
