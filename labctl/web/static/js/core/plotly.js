// Plotly in two builds: a small one for flat figures, and the whole library, three times as large, for all others.

import { h } from "./elements.js";
import { staticUrl } from "./static_url.js";

/** @import { Plot, Plotly, PlotTrace } from "../../../types/pages.js" */
/** @typedef {"plotly-cartesian.js" | "plotly.js"} Build */

/** @type {Build} */
const NAMED = "plotly-cartesian.js";

/** Types of traces that the small build draws, of those that the pages use. */
const FLAT = new Set(["bar", "heatmap", "scatter"]);

/** The script of the small build, where the document of the page names it, and what it has set before this module ran. */
const [named, set] = globalThis.document
  ? [document.querySelector("script[data-plotly]"), window.Plotly]
  : [null, undefined];

/** @type {Map<Build, Promise<Plotly>>} */
const asked = new Map();
/** @type {Map<Build, Plotly>} */
const loaded = new Map();
/** @type {WeakMap<Plot, Plotly>} */
const builds = new WeakMap();

/**
 * The build that draws some traces.
 * @param {readonly PlotTrace[]} data
 * @returns {Build}
 */
export const buildFor = (data) => (data.every(({ type }) => FLAT.has(type ?? "scatter")) ? NAMED : "plotly.js");

/**
 * The build that draws some traces where it is loaded.
 * @param {readonly PlotTrace[]} data
 */
export const loadedFor = (data) => loaded.get(buildFor(data));

/**
 * Load the build that draws some traces once, on first use.
 * @param {readonly PlotTrace[]} [data]
 * @returns {Promise<Plotly>}
 */
export function loadPlotly(data = []) {
  const build = buildFor(data);
  const found = asked.get(build) ?? (named && build === NAMED ? awaitNamed(named) : load(build));
  asked.set(build, found);
  return found;
}

/**
 * The build that the document loads, or, where that failed, loaded now. The document's own `load` event comes after its
 * scripts have run or failed: whichever of the two comes first tells.
 * @param {Element} script
 * @returns {Promise<Plotly>}
 */
async function awaitNamed(script) {
  if (!set && document.readyState !== "complete")
    await new Promise((resolve) => {
      script.addEventListener("load", resolve);
      window.addEventListener("load", resolve);
    });
  const found = set ?? window.Plotly;
  if (!found) return load(NAMED);
  loaded.set(NAMED, found);
  return found;
}

/**
 * @param {Build} build
 * @returns {Promise<Plotly>}
 */
const load = (build) =>
  new Promise((resolve, reject) => {
    const ready = () => {
      loaded.set(build, window.Plotly); // each script sets it anew
      resolve(window.Plotly);
    };
    const failed = () => {
      asked.delete(build); // the next figure tries again
      reject(new Error("the plotting library could not be loaded; reload the page"));
    };
    document.head.append(h("script", { src: staticUrl(build), onload: ready, onerror: failed }));
  });

/**
 * State which build draws a plot from now on; what another one has drawn in it, and its listeners, are removed.
 * @param {Plot} plot
 * @param {Plotly} Plotly
 */
export function setDrawnBy(plot, Plotly) {
  const before = builds.get(plot);
  if (before && before !== Plotly) before.purge(plot);
  builds.set(plot, Plotly);
}

/**
 * The build that has drawn a plot.
 * @param {Plot} plot
 */
export function drawnBy(plot) {
  const found = builds.get(plot);
  if (!found) throw new Error("the figure is not drawn yet; wait until it is");
  return found;
}
