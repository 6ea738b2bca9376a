// Event stream of a campaign: reconnects after a break and reports when the stream is silent.

import { eventStream, get, Problem } from "../core/api.js";

export const FINAL_STATES = new Set(["done", "aborted", "failed"]);
/** The service sends a keep-alive every 10 s. */
const SILENCE_LIMIT_MS = 25_000;
const RETRY_DELAYS_MS = [1000, 2000, 4000, 8000, 15_000];
const CHECK_MS = 1000;

/**
 * Follow until the campaign ends or `signal` aborts. `handlers`: {progress(status), event(event), link({stale, since, why})};
 * `link` is called when the stream falls silent (since when, and why) and when it is live again.
 */
export async function followCampaign(campaign, handlers, signal) {
  let [heard, stale, after, tries] = [Date.now(), false, 0, 0];
  const report = (now, why = "") => {
    if (now !== stale || now) handlers.link({ stale: now, since: heard, why });
    stale = now;
  };
  let [connection, asked] = [new AbortController(), Date.now()];
  const watch = setInterval(() => {
    if (Date.now() - heard <= SILENCE_LIMIT_MS || connection.signal.aborted) return;
    report(true, "the service says nothing");
    if (Date.now() - asked > SILENCE_LIMIT_MS) connection.abort(); // a connection of a suspended computer never ends by itself
  }, CHECK_MS);
  signal.addEventListener("abort", () => clearInterval(watch));
  while (!signal.aborted) {
    [connection, asked] = [new AbortController(), Date.now()];
    try {
      for await (const message of eventStream(`/api/campaigns/${campaign}/events`, {
        after,
        signal: AbortSignal.any([signal, connection.signal]),
      })) {
        [heard, tries] = [Date.now(), 0];
        report(false);
        if (message.event === "progress") handlers.progress(message.data);
        else if (message.id !== null) {
          after = message.id;
          handlers.event(message.data);
        }
      }
      const status = await get(`/api/campaigns/${campaign}`, { signal });
      handlers.progress(status);
      if (FINAL_STATES.has(status.state)) break;
    } catch (error) {
      if (signal.aborted) break;
      report(
        true,
        error instanceof Problem
          ? error.message
          : error.name === "AbortError"
            ? "the service says nothing"
            : "the connection broke",
      );
      if (error instanceof Problem && error.status < 500) break;
    }
    await new Promise((resolve) => setTimeout(resolve, RETRY_DELAYS_MS[Math.min(tries, RETRY_DELAYS_MS.length - 1)]));
    tries += 1;
  }
  clearInterval(watch);
}
