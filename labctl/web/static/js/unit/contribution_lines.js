// Contributions to an uncertainty as lines of a figure; no DOM.

/** @import { ContributionLines } from "../../../types/api.js" */
/** @import { PlotTrace } from "../../../types/pages.js" */

/** Colours of the sources, in order; the sums are drawn in the colour of the text. */
const COLOURS = [
  "#4e79a7",
  "#e07b39",
  "#3a9d6e",
  "#b5548f",
  "#8c6d31",
  "#17a2b8",
  "#d4a017",
  "#7a5195",
  "#d1495b",
  "#5c8001",
  "#6c757d",
  "#00798c",
];
const SUMS = { combined: "combined u", expanded: "expanded U" };

/**
 * A line for each source whose contribution is known, and one for each sum. What is not stated has no line.
 * @param {ContributionLines} lines
 * @param {string} ink colour of the sums
 * @returns {PlotTrace[]}
 */
export function contributionTraces(lines, ink) {
  /**
   * @param {string} name
   * @param {readonly (number | null)[]} y
   * @param {object} line
   * @returns {PlotTrace}
   */
  const trace = (name, y, line) => ({
    type: "scatter",
    mode: lines.at.length > 1 ? "lines" : "markers",
    name: `${name}, deg/s`,
    x: [...lines.at],
    y: [...y],
    line,
    hovertemplate: `%{x:.5g}: %{y:.3g} deg/s<extra>${name}</extra>`,
  });
  const sources = Object.entries(lines.contributions).map(([name, values], k) =>
    trace(name, values, { color: COLOURS[k % COLOURS.length], width: 1.5 }),
  );
  const sums = [
    trace(SUMS.combined, lines.combined, { color: ink, width: 2.5 }),
    trace(SUMS.expanded, lines.expanded, { color: ink, width: 2.5, dash: "dash" }),
  ];
  return [...sources, ...sums].filter(({ y }) => Array.from(y ?? []).some((value) => value !== null));
}
