// Event stream of a campaign: reconnects after a break and reports when the stream is silent.

import { eventStream, get } from "../core/http/api.js";
import { isAbort, Problem } from "../core/http/errors.js";
import { untilVisible, whileVisible } from "../core/visible.js";
import { hasEnded } from "../campaigns/states.js";

/** @import { Campaign, CampaignEvent } from "../../../types/api.js" */

/** The service sends a keep-alive every 10 s. */
const SILENCE_LIMIT_MS = 25_000;
const RETRY_DELAYS_MS = [1000, 2000, 4000, 8000, 15_000];
const CHECK_MS = 1000;

/**
 * @typedef {object} Handlers
 * @property {(status: Campaign) => void} progress
 * @property {(event: CampaignEvent) => void} event
 * @property {(link: { stale: boolean, since: number, why: string }) => void} link called when the stream falls silent
 *   (since when, and why) and when it is live again
 */

/**
 * Follow until the campaign ends or `signal` aborts.
 * @param {number} campaign
 * @param {Handlers} handlers
 * @param {AbortSignal} signal
 */
export async function followCampaign(campaign, handlers, signal) {
  let [heard, stale, after, tries] = [Date.now(), false, 0, 0];
  /**
   * @param {boolean} now
   * @param {string} [why]
   */
  const report = (now, why = "") => {
    if (now !== stale || now) handlers.link({ stale: now, since: heard, why });
    stale = now;
  };
  let [connection, asked] = [new AbortController(), Date.now()];
  const watch = setInterval(() => {
    if (document.hidden || Date.now() - heard <= SILENCE_LIMIT_MS || connection.signal.aborted) return;
    report(true, "the service does not answer");
    if (Date.now() - asked > SILENCE_LIMIT_MS) connection.abort(); // a connection of a suspended computer never ends by itself
  }, CHECK_MS);
  signal.addEventListener("abort", () => clearInterval(watch));
  while (!signal.aborted) {
    await untilVisible(signal);
    const seen = whileVisible(signal);
    [connection, asked] = [new AbortController(), Date.now()];
    if (tries === 0) heard = asked; // what was missed while the tab was hidden is no silence of the service
    try {
      for await (const message of eventStream("/api/campaigns/{campaign}/events", {
        path: { campaign },
        after,
        signal: AbortSignal.any([seen, connection.signal]),
      })) {
        [heard, tries] = [Date.now(), 0];
        report(false);
        if (message.event === "progress") handlers.progress(/** @type {Campaign} */ (message.data));
        else if (message.id !== null) {
          after = message.id;
          handlers.event(/** @type {CampaignEvent} */ (message.data));
        }
      }
      const status = await get("/api/campaigns/{campaign}", { path: { campaign }, signal });
      handlers.progress(status);
      if (hasEnded(status)) break;
    } catch (error) {
      if (signal.aborted) break;
      if (seen.aborted) continue;
      report(
        true,
        error instanceof Problem
          ? error.message
          : isAbort(error)
            ? "the service does not answer"
            : "the connection broke",
      );
      if (error instanceof Problem && error.status < 500) break;
    }
    await new Promise((resolve) => setTimeout(resolve, RETRY_DELAYS_MS[Math.min(tries, RETRY_DELAYS_MS.length - 1)]));
    tries += 1;
  }
  clearInterval(watch);
}
