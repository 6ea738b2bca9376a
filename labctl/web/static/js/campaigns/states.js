// States of a campaign: chips, texts, and what each state permits.

import { chip } from "../core/components.js";

export const CHIP_KINDS = {
  done: "good",
  running: "accent",
  planned: "",
  paused: "warn",
  waiting: "warn",
  interrupted: "warn",
  aborted: "bad",
  failed: "bad",
};
const STATE_TEXTS = { waiting: "waits for a person", planned: "about to begin" };

/** `abandoned`: no process runs the campaign any more, and it has not ended. */
export const stateChip = (campaign) =>
  chip(
    campaign.abandoned ? `${campaign.state}, left alone` : (STATE_TEXTS[campaign.state] ?? campaign.state),
    campaign.abandoned ? "warn" : (CHIP_KINDS[campaign.state] ?? ""),
  );

export const RUNNING_STATES = new Set(["planned", "running", "paused", "waiting"]);
export const isRunning = (campaign) => RUNNING_STATES.has(campaign.state) && !campaign.abandoned;
/** A campaign that ended before its plan did, or was abandoned, can be resumed. */
export const canResume = (campaign) =>
  campaign.abandoned || ["aborted", "failed", "interrupted"].includes(campaign.state);
