// States of a campaign: what each is called and how it is shown. The only place that names them all.

/** @import { Campaign, CampaignState } from "../../../types/api.js" */

/**
 * `kind`: the colour of its chip. `text`: where the name alone does not say it. What a state permits the service says, in
 * `active` and `ended` of each campaign; tsc says when a state lacks here.
 * @typedef {{ kind: string, text?: string }} StateFacts
 */

/** @type {Record<CampaignState, StateFacts>} */
const STATES = {
  planned: { kind: "", text: "about to begin" },
  running: { kind: "accent" },
  paused: { kind: "warn" },
  waiting: { kind: "warn", text: "waits for a person" },
  interrupted: { kind: "warn" },
  done: { kind: "good" },
  aborted: { kind: "bad" },
  failed: { kind: "bad" },
};

/** A tab may be older than the service: of a state that it does not know it says the name. */
const UNKNOWN = { kind: "warn", text: undefined };
/** @param {CampaignState} state */
const factsOf = (state) => STATES[state] ?? UNKNOWN;

/** @param {Pick<Campaign, "ended">} campaign */
export const hasEnded = ({ ended }) => ended;
/**
 * Whether a process works on a campaign.
 * @param {Pick<Campaign, "active">} campaign
 */
export const isRunning = ({ active }) => active;
/**
 * Whether a campaign ended before its plan did, or was abandoned.
 * @param {Pick<Campaign, "active" | "state">} campaign
 */
export const canResume = ({ active, state }) => !active && state !== "done";
/**
 * A state in words. `abandoned`: no process works on the campaign any more, and it has not ended.
 * @param {Placed} campaign
 */
export const stateText = ({ state, abandoned }) =>
  abandoned ? `${state}, no process runs it` : (factsOf(state).text ?? state);
/**
 * The kind of the chip of a state: its colour.
 * @param {Placed} campaign
 */
export const stateKind = ({ state, abandoned }) => (abandoned ? "warn" : factsOf(state).kind);

/** @typedef {Pick<Campaign, "state"> & { abandoned?: boolean }} Placed */
