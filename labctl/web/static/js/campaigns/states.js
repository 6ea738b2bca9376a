// The states of a campaign, as a chip and as words.

import { chip } from "../core/components.js";

export const CHIP_KINDS = { done: "good", running: "accent", planned: "", paused: "warn", waiting: "warn", interrupted: "warn", aborted: "bad", failed: "bad" };
const STATE_TEXTS = { waiting: "waits for a person", planned: "about to begin" };

/** `abandoned`: no process runs it any more, and it has no end. */
export const stateChip = (campaign) => chip(campaign.abandoned ? `${campaign.state}, left alone` : STATE_TEXTS[campaign.state] ?? campaign.state, campaign.abandoned ? "warn" : CHIP_KINDS[campaign.state] ?? "");

export const RUNNING_STATES = new Set(["planned", "running", "paused", "waiting"]);
export const isRunning = (campaign) => RUNNING_STATES.has(campaign.state) && !campaign.abandoned;
/** What ended before its plan did, or was left, can be taken up. */
export const canResume = (campaign) => campaign.abandoned || ["aborted", "failed", "interrupted"].includes(campaign.state);
