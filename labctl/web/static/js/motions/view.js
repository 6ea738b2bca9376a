// The pictures of a recording by what moved the unit, for one axis where they are of one.

import { poseFigures } from "./poses.js";
import { profileFigures } from "./profile.js";
import { restFigures } from "./rest.js";
import { turnFigures } from "./turns.js";

/** @import { Motion } from "../../../types/api.js" */

/** Motions whose pictures show one axis at a time. */
export const BY_AXIS = new Set(["rest", "profile"]);

/**
 * @param {Motion} found
 * @param {string} axis
 */
export function motionView(found, axis) {
  if (found.motion === "rest") return restFigures(found, axis);
  if (found.motion === "turns") return turnFigures(found);
  return found.motion === "profile" ? profileFigures(found, axis) : poseFigures(found);
}
