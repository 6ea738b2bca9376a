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
 * How long an ended campaign took, null for others.
 * @param {OnItsClock & Pick<Campaign, "started_at" | "ended_at">} campaign
 */
export const durationTaken = (campaign) =>
  campaign.started_at && campaign.ended_at
    ? `took ${campaignDuration(campaign, (Date.parse(campaign.ended_at) - Date.parse(campaign.started_at)) / 1000)}`
    : null;
