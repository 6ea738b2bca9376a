// Drawing of a unit in a pose: a cube on a table with its three axes; what points up is at the top.

import { svg } from "../core/elements.js";
import { axesInPicture, depthBelow, seenFaces } from "./pose_axes.js";

/** @import { Point } from "./pose_axes.js" */

const NAMES = /** @type {const} */ (["x", "y", "z"]);
const [CENTRE_X, CENTRE_Y, SCALE] = [150, 128, 42];
const TABLE = 2.1;
/** Cosine of the angle to the vertical, from which on an axis is said to point up. */
const AT_TOP = 0.95;

/**
 * @param {readonly number[]} point
 * @returns {[number, number]}
 */
const project = ([a, b, c]) => [CENTRE_X + SCALE * 0.8 * (b - a), CENTRE_Y + SCALE * (0.42 * (a + b) - c)];
/** @param {readonly (readonly number[])[]} corners */
const outline = (corners) =>
  corners
    .map(project)
    .map((at) => at.map((v) => v.toFixed(1)).join(","))
    .join(" ");

/**
 * @param {string} name
 * @param {Point} to
 */
function arrow(name, to) {
  const [from, tip, word] = [1, 1.9, 2.25].map((factor) => project(to.map((v) => factor * v)));
  const along = Math.atan2(tip[1] - from[1], tip[0] - from[0]);
  const head = [0.45, -0.45].map((turn) => [
    tip[0] - 11 * Math.cos(along + turn),
    tip[1] - 11 * Math.sin(along + turn),
  ]);
  return svg(
    "g",
    { class: `axis axis-${name}` },
    svg("line", { x1: from[0], y1: from[1], x2: tip[0], y2: tip[1] }),
    svg("polygon", { points: [tip, ...head].map((at) => at.map((v) => v.toFixed(1)).join(",")).join(" ") }),
    svg("text", { x: word[0], y: word[1], "text-anchor": "middle", "dominant-baseline": "central" }, name),
  );
}

/**
 * What is up: an arrow above the cube, and the axes that point there.
 * @param {number} high
 * @param {string} name
 */
function upwards(high, name) {
  const [from, tip] = [project([0, 0, high + 0.15]), project([0, 0, high + 0.75])];
  const head = [-7, 7].map((x) => `${(tip[0] + x).toFixed(1)},${(tip[1] + 9).toFixed(1)}`);
  return svg(
    "g",
    { class: "up" },
    svg("line", { x1: from[0], y1: from[1], x2: tip[0], y2: tip[1] + 6 }),
    svg("polygon", { points: [tip.map((v) => v.toFixed(1)).join(","), ...head].join(" ") }),
    svg("text", { x: tip[0], y: tip[1] - 11, "text-anchor": "middle" }, name ? `${name} up` : "up"),
  );
}

/**
 * The unit with the direction `up` of its body pointing up; `label` says the pose in words, `name` the axes that do.
 * @param {readonly number[]} up
 * @param {string} label
 * @param {string} [name]
 */
export function poseDrawing(up, label, name = "") {
  const axes = axesInPicture(up);
  const low = -depthBelow(axes);
  const table = [
    [TABLE, TABLE, low],
    [-TABLE, TABLE, low],
    [-TABLE, -TABLE, low],
    [TABLE, -TABLE, low],
  ];
  // an axis that points away from the eye is behind the cube
  const behind = NAMES.filter((_, k) => axes[k][0] + axes[k][1] + 0.84 * axes[k][2] < 0);
  // the arrow and the name of an axis that points up would lie under "y up"
  const atTop = NAMES.filter((_, k) => axes[k][2] > AT_TOP);
  const arrows = NAMES.filter((each) => !atTop.includes(each)).map((each) => ({
    name: each,
    drawing: arrow(each, axes[NAMES.indexOf(each)]),
  }));
  return svg(
    "svg",
    { viewBox: "0 -40 300 310", class: "mounting pose", role: "img", "aria-label": label },
    svg("polygon", { points: outline(table), class: "table top" }),
    arrows.filter((each) => behind.includes(each.name)).map(({ drawing }) => drawing),
    seenFaces(axes).map(({ corners, side }) => svg("polygon", { points: outline(corners), class: `cube ${side}` })),
    arrows.filter((each) => !behind.includes(each.name)).map(({ drawing }) => drawing),
    upwards(depthBelow(axes), name || atTop.join("")),
  );
}
