// Times of a campaign. Those of a simulated bench are its own clock's, not the wall's, and every one of them says so.

import { duration, instant } from "../core/format.js";

export const SIMULATED = "simulated time";
const marked = (campaign, text) => (campaign.simulated_time && text !== "–" ? `${text} (${SIMULATED})` : text);

export const campaignInstant = (campaign, text) => marked(campaign, instant(text));
export const campaignDuration = (campaign, seconds) => marked(campaign, duration(seconds));

/** How long an ended campaign took, null for others. */
export const durationTaken = (campaign) =>
  campaign.started_at && campaign.ended_at
    ? `took ${campaignDuration(campaign, (Date.parse(campaign.ended_at) - Date.parse(campaign.started_at)) / 1000)}`
    : null;
