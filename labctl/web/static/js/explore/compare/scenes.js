// Two 3-D scenes on the same axes, side by side, or one above the other on a narrow screen.

import { colour } from "../../core/figure.js";
import { drawnBy } from "../../core/plotly.js";

/** @import { Plot } from "../../../../types/pages.js" */

/** @typedef {[title: string, range: [low: number, high: number]]} SceneAxis */
/** @typedef {Record<"x" | "y" | "z", SceneAxis>} Axes */

const isNarrow = () => window.innerWidth < 760;
/** Where the two scenes stand, in words. */
export const sides = () => (isNarrow() ? ["above", "below"] : ["left", "right"]);
export const twoScenes = () => (isNarrow() ? "46rem" : "30rem");

/** Where the colour bar is: at the right, or below on a narrow screen, so that the scenes have its width. */
export const barPlace = () => (isNarrow() ? { orientation: "h", y: -0.01, yanchor: "top", len: 0.9 } : {});

/**
 * Layout of scenes `scene` and `scene2`; `axes` are {x: [title, [low, high]], y, z}, the same for both.
 * @param {readonly string[]} titles
 * @param {Axes} axes
 */
export function sceneLayout(titles, axes) {
  const below = isNarrow();
  /** @param {SceneAxis} axis */
  const axis = ([title, [low, high]]) => {
    const margin = 0.04 * (high - low || 1);
    return {
      title: { text: title },
      range: [low - margin, high + margin],
      gridcolor: colour("border"),
      color: colour("text-muted"),
    };
  };
  /** @param {number} k */
  const scene = (k) => ({
    domain: below ? { x: [0, 1], y: k ? [0, 0.46] : [0.52, 0.98] } : { x: k ? [0.51, 1] : [0, 0.49], y: [0, 0.95] },
    xaxis: axis(axes.x),
    yaxis: axis(axes.y),
    zaxis: axis(axes.z),
    camera: {
      eye: below ? { x: 1.95, y: -2.05, z: 1 } : { x: 1.7, y: -1.8, z: 0.9 },
      center: { x: 0, y: 0, z: -0.14 },
    },
    aspectmode: "cube",
  });
  /**
   * @param {string} text
   * @param {number} k
   */
  const title = (text, k) => ({
    text,
    showarrow: false,
    xref: "paper",
    yref: "paper",
    x: below ? 0 : k * 0.51,
    y: below && k ? 0.48 : 1,
    xanchor: "left",
    yanchor: "bottom",
    font: { size: 12 },
  });
  return {
    margin: { l: 0, r: 0, t: 22, b: below ? 60 : 0 },
    scene: scene(0),
    scene2: scene(1),
    annotations: titles.map(title),
  };
}

/** @type {readonly (readonly [from: `scene${string}.camera`, to: `scene${string}.camera`])[]} */
const CAMERAS = [
  ["scene.camera", "scene2.camera"],
  ["scene2.camera", "scene.camera"],
];

/**
 * One camera for both scenes: turning one turns the other.
 * @param {Plot} plot
 */
export function linkCameras(plot) {
  plot.on("plotly_relayout", (changed) => {
    if (CAMERAS.every(([from]) => from in changed)) return; // both were set by this function
    for (const [from, to] of CAMERAS)
      if (from in changed) drawnBy(plot).relayout(plot, { [from]: changed[from], [to]: changed[from] });
  });
}
