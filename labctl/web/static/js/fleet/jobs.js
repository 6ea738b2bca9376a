// Fleet jobs: how far each is, what it has cost, why units failed, and the button that cancels one.

import { actButton, button, card, chip, notice, table } from "../core/components.js";
import { dialog, WHO } from "../core/dialog.js";
import { h, setChildren } from "../core/elements.js";
import { count, duration, instant, number, personText } from "../core/format.js";
import { get, post } from "../core/http/api.js";
import { isAbort, messageOf } from "../core/http/errors.js";
import { untilVisible } from "../core/visible.js";

/** @import { FleetJob, FleetUnit } from "../../../types/api.js" */

/** Jobs that are shown, the newest, and failed units of one of them. */
const SHOWN = 10;
const FAILED_SHOWN = 20;
/** In the place of the jobs, until a request for them is answered; the rest of the page does not need them. */
const UNREAD = "The fleet jobs could not be read; they are asked for again every 2 s.";
/** How often jobs that go on are read again, ms. */
const POLL_MS = 2000;

/** @type {Record<FleetJob["state"], string>} */
const KINDS = { waiting: "warn", running: "accent", done: "good", cancelled: "warn", failed: "bad" };

/**
 * What a job does, and with which units.
 * @param {Pick<FleetJob, "kind" | "request">} job
 * @returns {[what: string, units: string]}
 */
export function jobText({ kind, request }) {
  const { type, batch, supplier, search, model = "", effects = [] } = request;
  const what = [model, ...effects].filter(Boolean).join(" + ");
  const of = [type, batch && `batch ${batch}`, supplier && `from ${supplier}`, search && `“${search}”`];
  return [kind === "fit" ? `Fit ${what}` : `Criticise ${what}`.trim(), of.filter(Boolean).join(", ") || "all units"];
}

/**
 * How many units a job has finished, and how many of these have no result of it.
 * @param {Pick<FleetJob, "units" | "waiting" | "failed" | "skipped">} job
 */
export const progressText = ({ units, waiting, failed, skipped }) =>
  [
    `${count(units - waiting)} of ${count(units)}`,
    skipped ? `${count(skipped)} skipped` : "",
    failed ? `${count(failed)} failed` : "",
  ]
    .filter(Boolean)
    .join(", ");

/**
 * A card of the newest fleet jobs, read again as long as one goes on; without a child where there was never one. A
 * request that fails is said there, and made again.
 * @param {AbortSignal} signal
 */
export async function jobsCard(signal) {
  const place = h("div");
  const reasons = h("div");
  let waiting = 0;
  const again = async () => {
    clearTimeout(waiting);
    const jobs = await get("/api/fleet/jobs", { query: { limit: SHOWN }, signal });
    setChildren(place, jobs.length ? card("Jobs", jobTable(jobs, reasons, signal, again), reasons) : null);
    if (jobs.some(({ ended }) => !ended)) later();
  };
  // a request that fails is made again: the header says meanwhile that the service does not answer
  const later = () => {
    waiting = window.setTimeout(() => next().catch((error) => isAbort(error) || later()), POLL_MS);
  };
  const next = async () => {
    await untilVisible(signal);
    if (!signal.aborted) await again();
  };
  try {
    await again();
  } catch (error) {
    if (isAbort(error)) throw error;
    setChildren(place, card("Jobs", notice("bad", h("p", {}, `${UNREAD} ${messageOf(error)}`))));
    later();
  }
  return place;
}

/**
 * @param {readonly FleetJob[]} jobs
 * @param {HTMLElement} reasons
 * @param {AbortSignal} signal
 * @param {() => Promise<void>} again
 */
function jobTable(jobs, reasons, signal, again) {
  return table(
    [
      { title: "Job", number: true, cell: (job) => job.id },
      {
        title: "What",
        cell: (job) => {
          const [what, of] = jobText(job);
          return [what, h("div", { class: "muted small" }, of)];
        },
      },
      { title: "State", prose: true, cell: stateOf },
      { title: "Units finished", cell: (job) => progressText(job) },
      {
        title: "Processor time of a unit",
        number: true,
        cell: (job) => (job.processor_s_per_unit === null ? "–" : `${number(job.processor_s_per_unit, 2)} s`),
      },
      { title: "Time left", number: true, cell: (job) => (job.ended ? "" : duration(job.left_s)) },
      { title: "Requested", cell: (job) => [instant(job.created_at), job.by ? ` by ${personText(job.by)}` : ""] },
      {
        title: "",
        cell: (job) => [
          job.failed ? button("Reasons", () => showReasons(reasons, job, signal), { kind: "tiny" }) : null,
          job.ended ? null : actButton("Cancel job", () => askCancel(job, again), { kind: "tiny" }),
        ],
      },
    ],
    jobs,
    { label: "Fleet jobs" },
  );
}

/**
 * The state of a job, and why where it did not end as it should.
 * @param {FleetJob} job
 */
const stateOf = ({ state, why }) => [
  chip(state, KINDS[state] ?? "warn"),
  why ? h("div", { class: "muted small" }, why) : null,
];

/**
 * @param {HTMLElement} place
 * @param {FleetJob} job
 * @param {AbortSignal} signal
 */
async function showReasons(place, job, signal) {
  const query = /** @type {const} */ ({ state: "failed", limit: FAILED_SHOWN });
  const rows = await get("/api/fleet/jobs/{job}/units", { path: { job: job.id }, query, signal });
  const shown = rows.length < job.failed ? `${count(rows.length)} of ${count(job.failed)}` : count(job.failed);
  setChildren(
    place,
    h("h3", {}, `Job ${job.id}: ${shown} failed ${job.failed === 1 ? "unit" : "units"}`),
    table(
      [
        {
          title: "Unit",
          cell: (/** @type {FleetUnit} */ row) =>
            h("a", { href: `/units/${encodeURIComponent(row.serial)}` }, row.serial),
        },
        { title: "Why", prose: true, cell: (row) => row.reason },
      ],
      rows,
      { label: `Failed units of job ${job.id}` },
    ),
  );
}

/**
 * @param {FleetJob} job
 * @param {() => Promise<void>} again
 */
async function askCancel(job, again) {
  const answers = await dialog(`Cancel job ${job.id}`, [WHO, { name: "reason", label: "Why" }], {
    text: "Results already written are kept. The same request, made again, continues after them.",
    confirm: "Cancel job",
    kind: "danger",
    send: ({ by, reason }, signal) =>
      post("/api/fleet/jobs/{job}/cancel", { path: { job: job.id }, body: { by, reason }, signal }),
  });
  if (answers) await again();
}
