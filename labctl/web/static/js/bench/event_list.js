// List of events, newest first, filtered by level.

import { setChildren, h } from "../core/elements.js";
import { clock, day, plainNumber } from "../core/format.js";
import { chip } from "../core/components.js";
import { SIMULATED } from "../campaigns/campaign_time.js";

/** @import { CampaignEvent } from "../../../types/api.js" */
/** @import { OnItsClock } from "../campaigns/campaign_time.js" */

/** @type {Record<string, string>} */
const KINDS = { info: "", warning: "warn", error: "bad" };
const LEVELS = ["info", "warning", "error"];
const REDRAW_MS = 250;

/**
 * A list with `add(event)`; shows at most `most` events of `level` or above. `campaign` says whose clock they are of.
 * @param {number} most
 * @param {string} [level]
 * @param {OnItsClock} [campaign]
 */
export function eventList(most, level = "info", campaign = {}) {
  /** @type {CampaignEvent[]} */
  const all = [];
  const element = h("ol", { class: "events", "aria-live": "off" });
  let least = level;
  /** @type {ReturnType<typeof setTimeout> | null} */
  let waiting = null;
  function show() {
    waiting = null;
    const shown = all.filter((event) => LEVELS.indexOf(event.level) >= LEVELS.indexOf(least));
    const from = shown.slice(-most).reverse();
    setChildren(
      element,
      campaign.simulated_time && from.length
        ? h("li", { class: "muted small" }, `All times here are ${SIMULATED}.`)
        : null,
      from.length
        ? from.flatMap((event, k) => [dayItem(from, k), eventItem(event, campaign)])
        : h("li", { class: "empty" }, all.length ? "No event of this kind has occurred." : "No event has arrived yet."),
      shown.length > most ? h("li", { class: "muted small" }, `and ${shown.length - most} before`) : null,
    );
  }
  show();
  return Object.assign(element, {
    /** @param {CampaignEvent} event */
    add: (event) => {
      all.push(event);
      waiting ??= setTimeout(show, REDRAW_MS);
    },
    /** @param {string} value */
    from: (value) => {
      least = value;
      show();
    },
  });
}

/**
 * The day above the first event of it, where the events are of several days.
 * @param {readonly CampaignEvent[]} events
 * @param {number} k
 */
function dayItem(events, k) {
  const days = events.map((event) => day(event.at));
  const isNew = days[0] !== days[days.length - 1] && days[k] !== days[k - 1];
  return isNew ? h("li", { class: "muted small" }, days[k]) : null;
}

/**
 * @param {CampaignEvent} event
 * @param {OnItsClock} campaign
 */
function eventItem(event, campaign) {
  const message = event.message.replace(/ \[question [^\]]+\]$/, "");
  const limit =
    !message.includes("limit") &&
    event.value !== null &&
    event.value !== undefined &&
    event.limit !== null &&
    event.limit !== undefined
      ? ` (${plainNumber(event.value)} ${event.unit ?? ""}, limit ${plainNumber(event.limit)} ${event.unit ?? ""})`
      : "";
  return h(
    "li",
    {},
    h(
      "time",
      {
        datetime: event.at,
        title: `${day(event.at)}, ${event.t_s.toFixed(1)} s of the campaign${campaign.simulated_time ? `, ${SIMULATED}` : ""}`,
      },
      clock(event.at),
    ),
    chip(event.level, KINDS[event.level] ?? ""),
    h(
      "span",
      {},
      event.device && !message.startsWith(event.device) ? h("strong", {}, `${event.device}: `) : null,
      message,
      limit,
    ),
  );
}
