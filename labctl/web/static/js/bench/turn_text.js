// A turn by hand in words, and how much of it has come out.

import { fixed, plainNumber } from "../core/format.js";

/** @import { Turn } from "../../../types/api.js" */

/**
 * What a person is to do now, with the angle so far; `share` is 0 to 1 of the angle that is asked for.
 * @param {Pick<Turn, "phase" | "position" | "asked_deg" | "attempt" | "came_deg">} turn
 */
export function turnText({ phase, position, asked_deg: asked, attempt, came_deg: came }) {
  const angles = Object.values(came);
  const share = angles.length ? Math.min(Math.max(angles[0] / asked, 0), 1) : 0;
  const which = attempt > 1 ? ` (attempt ${attempt})` : "";
  if (phase === "rest") return { text: `Keep the unit still, axis ${position} pointing up${which}.`, share };
  const sense = asked > 0 ? "counter-clockwise" : "clockwise";
  const whole = `${plainNumber(asked)} deg`;
  const far = angles.length ? `${angles.map((deg) => fixed(deg, 0)).join(", ")} deg of ${whole}` : whole;
  return { text: `${far} about ${position}, ${sense}${which}.`, share };
}
