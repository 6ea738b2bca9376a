// States of a campaign: what each is called, how it is shown, and what it permits. The only place that names them all.

/** @import { Campaign, CampaignState } from "../../../types/api.js" */

/**
 * `active`: a process works on it or waits for a person. `ended`: nothing more happens by itself. `resumable`: it ended or
 * was left before its plan did. `kind`: the colour of its chip. `text`: where the name alone does not say it.
 * @typedef {{ active: boolean, ended: boolean, resumable: boolean, kind: string, text?: string }} StateFacts
 */

/** @type {Record<CampaignState, StateFacts>} */
const STATES = {
  planned: { active: true, ended: false, resumable: false, kind: "", text: "about to begin" },
  running: { active: true, ended: false, resumable: false, kind: "accent" },
  paused: { active: true, ended: false, resumable: false, kind: "warn" },
  waiting: { active: true, ended: false, resumable: false, kind: "warn", text: "waits for a person" },
  interrupted: { active: false, ended: false, resumable: true, kind: "warn" },
  done: { active: false, ended: true, resumable: false, kind: "good" },
  aborted: { active: false, ended: true, resumable: true, kind: "bad" },
  failed: { active: false, ended: true, resumable: true, kind: "bad" },
};

/** A tab may be older than the service: of a state that it does not know it says the name. */
const UNKNOWN = { active: false, ended: false, resumable: false, kind: "warn", text: undefined };
/** @param {CampaignState} state */
const factsOf = (state) => STATES[state] ?? UNKNOWN;

/** @typedef {Pick<Campaign, "state"> & { abandoned?: boolean }} Placed */

/** @param {Pick<Campaign, "state">} campaign */
export const hasEnded = ({ state }) => factsOf(state).ended;
/**
 * Whether a process works on a campaign. `abandoned`: none does any more, and it has not ended.
 * @param {Placed} campaign
 */
export const isRunning = ({ state, abandoned }) => factsOf(state).active && !abandoned;
/**
 * Whether a campaign ended before its plan did, or was abandoned.
 * @param {Placed} campaign
 */
export const canResume = ({ state, abandoned }) => Boolean(abandoned) || factsOf(state).resumable;
/**
 * A state in words.
 * @param {Placed} campaign
 */
export const stateText = ({ state, abandoned }) =>
  abandoned ? `${state}, left alone` : (factsOf(state).text ?? state);
/**
 * The kind of the chip of a state: its colour.
 * @param {Placed} campaign
 */
export const stateKind = ({ state, abandoned }) => (abandoned ? "warn" : factsOf(state).kind);
