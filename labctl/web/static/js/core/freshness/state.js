// How fresh a page is, from when the service and the bench were last heard; and the words for it.

/** Nothing was heard for this long: what is shown may no longer be so. */
export const STALE_MS = 4000;
/** A bench process that was not heard for longer is not known to be what the page shows. */
export const BENCH_STALE_S = 3.5;

/**
 * What is known at a moment.
 * @typedef {object} Heard
 * @property {number | null} service_s seconds since the service was heard, null before the first time
 * @property {number} open_s seconds since the page was opened
 * @property {number | null} bench_s seconds since the bench process was heard, null where the service does not say
 * @property {boolean} paused whether the tab was hidden and has not been heard since
 * @property {string} trouble why the service does not answer with what the page shows, or ""
 * @property {string | null} clock the time of day at which the service was last heard
 */

/** @typedef {"first" | "paused" | "yes" | "trouble" | "bench" | "no"} Staleness */

/**
 * @param {Heard} heard
 * @returns {Staleness}
 */
export function stalenessOf({ service_s, open_s, bench_s, paused, trouble }) {
  if (paused) return "paused";
  if (service_s === null) return 1000 * open_s > STALE_MS ? "yes" : "first";
  if (1000 * service_s > STALE_MS) return "yes";
  if (trouble) return "trouble";
  return (bench_s ?? 0) > BENCH_STALE_S ? "bench" : "no";
}

/** @param {number} seconds */
export const ago = (seconds) =>
  seconds < 120 ? `${Math.floor(seconds)} s ago` : `${Math.floor(seconds / 60)} min ago`;

/**
 * The line at the head of a page: {stale, text}; `stale` puts an emphasised "Stale." before it.
 * @param {Staleness} found
 * @param {Heard} heard
 */
export function freshnessWords(found, { service_s, bench_s, trouble, clock }) {
  if (found === "first") return { stale: false, text: "Asking the service …" };
  if (found === "paused") {
    const when = clock === null ? "never" : `at ${clock}`;
    return { stale: false, text: `Paused while this tab is hidden: last answer of the service ${when}.` };
  }
  const service =
    service_s === null ? "The service has not answered." : `Last answer of the service ${ago(service_s)}.`;
  if (found === "yes") {
    const of = clock === null ? "" : `; they date from ${clock}`;
    return { stale: true, text: `${service} The values on this page may be out of date${of}.` };
  }
  if (found === "trouble")
    return {
      stale: true,
      text: `The service answers, but it did not send the data for this page; reload it: ${trouble}`,
    };
  const bench = bench_s === null ? "" : ago(bench_s);
  if (found === "bench") {
    const what =
      "The values of the bench on this page may be out of date; they are updated as soon as the bench answers.";
    return { stale: true, text: `Last answer of the bench ${bench}; the service answers. ${what}` };
  }
  if (service_s === null || bench_s === null) return { stale: false, text: service };
  return { stale: false, text: `Last answer of the service ${ago(service_s)}, bench ${bench}.` };
}

/**
 * What a service that only reads says of itself, "" for any other. A replica that is not connected has old data.
 * @param {{ read_only?: boolean, replica?: { age_s?: number | null, is_connected: boolean } | null }} answer
 */
export function readOnlyWords({ read_only, replica }) {
  if (!read_only) return "";
  if (!replica) return "This service only reads.";
  const age_s = replica.age_s ?? null;
  const age = age_s === null ? "of unknown age" : `not older than ${span(age_s)}`;
  const cut = replica.is_connected ? "" : ", which is not connected to its server now";
  return `This service only reads: the data are those of a replica${cut}, ${age}.`;
}

/** @param {number} seconds */
const span = (seconds) =>
  seconds < 120
    ? `${Math.ceil(seconds)} s`
    : seconds < 7200
      ? `${Math.ceil(seconds / 60)} min`
      : `${Math.ceil(seconds / 3600)} h`;
