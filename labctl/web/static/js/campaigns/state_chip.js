// The state of a campaign as a chip.

import { chip } from "../core/components.js";
import { stateKind, stateText } from "./states.js";

/** @import { Placed } from "./states.js" */

/** @param {Placed} campaign */
export const stateChip = (campaign) => chip(stateText(campaign), stateKind(campaign));
