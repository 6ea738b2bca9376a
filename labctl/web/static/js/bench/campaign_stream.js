// Follows a campaign: what the service tells, again after a break, and since when it is silent.

import { eventStream, get, Problem } from "../core/api.js";

export const FINAL_STATES = new Set(["done", "aborted", "failed"]);
/** The service says every 10 s that it lives. */
const SILENCE_LIMIT_MS = 25_000;
const RETRY_DELAYS_MS = [1000, 2000, 4000, 8000, 15_000];
const CHECK_MS = 1000;

/**
 * Follow until the campaign ends or `signal` aborts. `told`: {progress(status), event(event), link({stale, since, why})};
 * `link` is called when that changes: silent since when and why, or heard again.
 */
export async function followCampaign(campaign, told, signal) {
  let [heard, stale, after, tries] = [Date.now(), false, 0, 0];
  const say = (now, why = "") => {
    if (now !== stale || now) told.link({ stale: now, since: heard, why });
    stale = now;
  };
  let [listening, asked] = [new AbortController(), Date.now()];
  const watch = setInterval(() => {
    if (Date.now() - heard <= SILENCE_LIMIT_MS || listening.signal.aborted) return;
    say(true, "the service says nothing");
    if (Date.now() - asked > SILENCE_LIMIT_MS) listening.abort(); // a connection that went to sleep never ends by itself
  }, CHECK_MS);
  signal.addEventListener("abort", () => clearInterval(watch));
  while (!signal.aborted) {
    [listening, asked] = [new AbortController(), Date.now()];
    try {
      for await (const message of eventStream(`/api/campaigns/${campaign}/events`, { after, signal: AbortSignal.any([signal, listening.signal]) })) {
        [heard, tries] = [Date.now(), 0];
        say(false);
        if (message.event === "progress") told.progress(message.data);
        else if (message.id !== null) {
          after = message.id;
          told.event(message.data);
        }
      }
      const status = await get(`/api/campaigns/${campaign}`, { signal });
      told.progress(status);
      if (FINAL_STATES.has(status.state)) break;
    } catch (error) {
      if (signal.aborted) break;
      say(true, error instanceof Problem ? error.message : error.name === "AbortError" ? "the service says nothing" : "the connection broke");
      if (error instanceof Problem && error.status < 500) break;
    }
    await new Promise((resolve) => setTimeout(resolve, RETRY_DELAYS_MS[Math.min(tries, RETRY_DELAYS_MS.length - 1)]));
    tries += 1;
  }
  clearInterval(watch);
}
