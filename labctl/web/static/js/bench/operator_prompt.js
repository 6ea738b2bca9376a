// Operator prompt: the open question of a campaign, with a drawing of the position to mount.

import { h, svg } from "../core/elements.js";
import { duration } from "../core/format.js";
import { axisOf, endOf, isTilted, signOf, turnedDeg } from "../core/positions.js";
import { answerButtons } from "./actions.js";
import { AXES, bodyAxes } from "./mounting_axes.js";

/** @import { Prompt } from "../../../types/api.js" */
/** @import { Axis } from "../core/positions.js" */
/** @import { Point } from "./mounting_axes.js" */

/**
 * Projection of the directions front left, front right and up to 2D, per unit of length; right-handed.
 * @type {[number, number][]}
 */
const VIEW = [
  [-0.8, 0.42],
  [0.8, 0.42],
  [0, -1],
];

/**
 * @param {Point} point
 * @param {number} factor
 * @returns {Point}
 */
const scaled = ([a, b, c], factor) => [factor * a, factor * b, factor * c];
const CENTRE = [150, 128];
const SCALE = 52;
/**
 * @param {Point} point
 * @param {number} [size]
 * @returns {[number, number]}
 */
const project = ([a, b, c], size = SCALE) => {
  const [x, y] = [0, 1].map((k) => a * VIEW[0][k] + b * VIEW[1][k] + c * VIEW[2][k]);
  return [CENTRE[0] + x * size, CENTRE[1] + y * size];
};
/** @param {readonly Point[]} corners */
const polygonPoints = (corners) =>
  corners
    .map((corner) =>
      project(corner)
        .map((v) => v.toFixed(1))
        .join(","),
    )
    .join(" ");

/**
 * A cube on the table with its axes; the one that points up is emphasised.
 * @param {string} position
 */
export function mountingDrawing(position) {
  const axes = bodyAxes(position);
  /**
   * @param {readonly Point[]} corners
   * @param {string} kind
   */
  const face = (corners, kind) => svg("polygon", { points: polygonPoints(corners), class: `cube ${kind}` });
  /**
   * @param {Axis} name
   * @param {number} [large]
   */
  const arrow = (name, large = 11) => {
    const to = axes[name];
    const [from, tip] = [project(to), project(scaled(to, 1.75))];
    const along = Math.atan2(tip[1] - from[1], tip[0] - from[0]);
    const head = [0.45, -0.45].map((turn) => [
      tip[0] - large * Math.cos(along + turn),
      tip[1] - large * Math.sin(along + turn),
    ]);
    const neck = [tip[0] - 0.8 * large * Math.cos(along), tip[1] - 0.8 * large * Math.sin(along)];
    const word = project(scaled(to, 2.05));
    const hidden = to[2] < 0;
    return svg(
      "g",
      { class: `axis axis-${name} ${hidden ? "hidden" : ""}` },
      svg("line", { x1: from[0], y1: from[1], x2: neck[0], y2: neck[1] }),
      svg("polygon", { points: [tip, ...head].map((p) => p.join(",")).join(" ") }),
      svg("text", { x: word[0], y: word[1] + 5, "text-anchor": "middle" }, large > 11 ? `${name} up` : name),
    );
  };
  const tops = tableTops();
  const axis = axisOf(position);
  if (axis === null)
    return tiltedDrawing(
      position,
      tops,
      AXES.map((name) => arrow(name)),
    );
  const [low, high] = [-1, 1];
  const down = signOf(position) < 0;
  return svg(
    "svg",
    {
      viewBox: "0 0 300 265",
      class: "mounting",
      role: "img",
      "aria-label": `The unit with its ${endOf(position)} axis pointing up along the table axis${turnedText(position)}`,
    },
    tops,
    AXES.filter((name) => axes[name][2] < 0).map((name) => arrow(name)),
    face(
      [
        [high, low, low],
        [high, high, low],
        [high, high, high],
        [high, low, high],
      ],
      "left",
    ),
    face(
      [
        [low, high, low],
        [high, high, low],
        [high, high, high],
        [low, high, high],
      ],
      "right",
    ),
    face(
      [
        [low, low, high],
        [high, low, high],
        [high, high, high],
        [low, high, high],
      ],
      "top",
    ),
    AXES.filter((name) => axes[name][2] === 0).map((name) => arrow(name)),
    down ? upwards(position, 1) : svg("g", { class: "up" }, arrow(axis, 20)),
  );
}

const tableTops = () => [
  svg("ellipse", { cx: 150, cy: 188, rx: 132, ry: 56, class: "table" }),
  svg("ellipse", { cx: 150, cy: 182, rx: 132, ry: 56, class: "table top" }),
];

/**
 * A line upwards with the name of what points up, where that is no arrow of an axis.
 * @param {string} position
 * @param {number} from height
 */
function upwards(position, from) {
  const up = project([0, 0, 2.05]);
  return svg(
    "g",
    { class: "axis up inverted" },
    svg("line", { x1: 150, y1: project([0, 0, from])[1], x2: 150, y2: project([0, 0, 1.75])[1] }),
    svg("text", { x: up[0], y: up[1] + 5, "text-anchor": "middle" }, `${endOf(position)} up`),
  );
}

/**
 * The axes of a tilted unit above the table, without the unit, and the direction that points up.
 * @param {string} position
 * @param {readonly SVGElement[]} tops
 * @param {readonly SVGElement[]} arrows
 */
const tiltedDrawing = (position, tops, arrows) =>
  svg(
    "svg",
    {
      viewBox: "0 0 300 265",
      class: "mounting",
      role: "img",
      "aria-label": `The unit tilted, with ${endOf(position)} pointing up along the table axis${turnedText(position)}`,
    },
    tops,
    arrows,
    upwards(position, 0),
  );

/**
 * What is turned against the first mounting, in words; nothing where nothing is.
 * @param {string} position
 */
function turnedText(position) {
  const [unit, fixture] = turnedDeg(position);
  const words = [
    unit ? `the unit turned by ${unit} deg on its fixture` : "",
    fixture ? `the fixture turned by ${fixture} deg on the table` : "",
  ].filter(Boolean);
  return words.length ? `, ${words.join(", ")} (counter-clockwise seen from above)` : "";
}

/** @param {Prompt} prompt */
function heading({ kind, position, turn_deg: angle }) {
  if (kind === "mount" && position && isTilted(position))
    return `Mount the unit on the tilted fixture with ${endOf(position)} pointing up${turnedText(position)}`;
  if (kind === "mount")
    return `Mount the unit with axis ${position && endOf(position)} pointing up${position ? turnedText(position) : ""}`;
  if (kind === "turn") return `Keep axis ${position} pointing up, and turn the unit by ${angle} deg about this axis`;
  return "The campaign has a question";
}

/**
 * The card of an open question. `hasTable`: whether a table stands still meanwhile.
 * @param {number} campaign
 * @param {Prompt} prompt
 * @param {boolean} hasTable
 */
export function operatorPrompt(campaign, prompt, hasTable) {
  const limit = prompt.within_s
    ? ` Without an answer within ${duration(prompt.within_s)} the campaign ends; it can be resumed.`
    : "";
  return h(
    "section",
    { class: "card prompt", role: "alert", "aria-label": "A question for you" },
    prompt.position ? mountingDrawing(prompt.position) : null,
    h(
      "div",
      { class: "stack" },
      h("h2", {}, heading(prompt)),
      h("p", {}, `${prompt.text[0].toUpperCase()}${prompt.text.slice(1)}.`),
      h("p", { class: "muted" }, `${hasTable ? "The table is at rest until you have answered." : ""}${limit}`.trim()),
      h("div", { class: "row" }, answerButtons(campaign, prompt)),
    ),
  );
}
