// Times of a campaign. Those of a simulated bench are its own clock's, not the wall's, and every one of them says so.

import { duration, instant } from "../core/format.js";

/** @import { Campaign } from "../../../types/api.js" */
/** @import { Numeric } from "../core/format.js" */
/** @typedef {{ simulated_time?: boolean }} OnItsClock */

export const SIMULATED = "simulated time";
/**
 * @param {OnItsClock} campaign
 * @param {string} text
 */
const marked = (campaign, text) => (campaign.simulated_time && text !== "–" ? `${text} (${SIMULATED})` : text);

/**
 * A time in a list of facts: the instant, and in smaller letters beside it that it is simulated.
 * @param {OnItsClock} campaign
 * @param {string | null | undefined} text
 * @returns {[string, string]}
 */
export const instantFact = (campaign, text) => [instant(text), campaign.simulated_time && text ? `(${SIMULATED})` : ""];

/**
 * @param {OnItsClock} campaign
 * @param {string | null | undefined} text
 */
export const campaignInstant = (campaign, text) => marked(campaign, instant(text));
/**
 * @param {OnItsClock} campaign
 * @param {Numeric} seconds
 */
export const campaignDuration = (campaign, seconds) => marked(campaign, duration(seconds));

/**
 * A duration in a list of facts, as `instantFact`.
 * @param {OnItsClock} campaign
 * @param {Numeric} seconds
 * @returns {[string, string]}
 */
export const durationFact = (campaign, seconds) => [duration(seconds), campaign.simulated_time ? `(${SIMULATED})` : ""];

/**
 * How long an ended campaign took, null for others.
 * @param {OnItsClock & Pick<Campaign, "started_at" | "ended_at">} campaign
 */
export const durationTaken = (campaign) =>
  campaign.started_at && campaign.ended_at
    ? `took ${campaignDuration(campaign, (Date.parse(campaign.ended_at) - Date.parse(campaign.started_at)) / 1000)}`
    : null;

/**
 * What held a campaign up that is no fault of an instrument; empty where nothing did.
 * @param {Pick<Campaign, "repeated" | "stalled_s">} campaign
 */
export const hindrances = ({ repeated = 0, stalled_s = 0 }) =>
  [
    repeated ? `${repeated} data set${repeated > 1 ? "s were" : " was"} taken again.` : "",
    stalled_s ? `The computer of the bench did not run labctl for ${stalled_s.toFixed(1)} s.` : "",
  ].filter(Boolean);

/**
 * What the plan says of the duration, for a campaign that runs and for one that has ended.
 * @param {Pick<Campaign, "ended_at">} campaign
 */
export const planNote = ({ ended_at }) =>
  ended_at ? "computed before the start; pauses, repeats and a faster chamber change it" : "without interruptions";
