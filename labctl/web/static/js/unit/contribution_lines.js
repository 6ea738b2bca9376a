// Contributions to an uncertainty as lines of a figure; no DOM.

import { idText, isNumber } from "../core/format.js";

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
/** So many sources have lines of their own: a legend of twelve names is not read. */
const MAX_NAMED = 4;
/** A source below this share of the combined uncertainty everywhere is one of the others. */
const MIN_SHARE = 0.1;

/** @typedef {readonly (number | null)[]} Values */

/**
 * The largest share that a source has of a whole.
 * @param {Values} values
 * @param {Values} whole the combined uncertainty, place by place; where it is not known, that of the known sources
 */
const shareOf = (values, whole) => Math.max(0, ...values.map((value, k) => Math.abs(value ?? 0) / (whole[k] || 1)));

/**
 * The root of the sum of squares of some sources, place by place; null where none of them is known.
 * @param {readonly Values[]} several
 * @returns {(number | null)[]}
 */
function together(several) {
  const places = several[0] ?? [];
  return places.map((_, k) => {
    const known = several.map((values) => values[k]).filter(isNumber);
    return known.length ? Math.hypot(...known) : null;
  });
}

/**
 * The sources of a figure: the largest each by itself, the others as one; what is not stated is none of them.
 * @param {ContributionLines} lines
 * @returns {{ name: string, y: Values, nr: number | null }[]}
 */
function sourcesOf(lines) {
  const ofKnown = together(Object.values(lines.contributions));
  const whole = ofKnown.map((value, k) => lines.combined[k] ?? value);
  const known = Object.entries(lines.contributions)
    .map(([name, y], nr) => ({ name: idText(name), y, nr, share: shareOf(y, whole) }))
    .filter(({ y }) => y.some((value) => value !== null));
  const bySize = [...known].sort((a, b) => b.share - a.share);
  const named = bySize.filter(({ share }, k) => k < MAX_NAMED && share >= MIN_SHARE);
  const others = bySize.slice(named.length);
  if (others.length < 2) return [...named, ...others];
  return [...named, { name: `${others.length} others`, y: together(others.map(({ y }) => y)), nr: null }];
}

/**
 * A line for each of the largest sources whose contribution is known, one for the others together, and one for each sum.
 * What is not stated has no line. A source has the same colour in every figure.
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
    name,
    x: [...lines.at],
    y: [...y],
    line,
    hovertemplate: `%{x:.5g}: %{y:.3g} deg/s<extra>${name}</extra>`,
  });
  const sources = sourcesOf(lines).map(({ name, y, nr }) =>
    trace(
      name,
      y,
      nr === null ? { color: ink, width: 1.5, dash: "dot" } : { color: COLOURS[nr % COLOURS.length], width: 3 },
    ),
  );
  const sums = [
    trace(SUMS.combined, lines.combined, { color: ink, width: 1.5 }),
    trace(SUMS.expanded, lines.expanded, { color: ink, width: 1.5, dash: "dash" }),
  ];
  return [...sources, ...sums].filter(({ y }) => Array.from(y ?? []).some((value) => value !== null));
}

/**
 * Every source with its contributions, as rows of a file: also those that a figure draws together.
 * @param {ContributionLines} lines
 * @param {string} along heading of the places
 * @returns {(string | number | null)[][]}
 */
export function contributionRows(lines, along) {
  const columns = [
    ...Object.entries(lines.contributions),
    ...Object.entries({ [SUMS.combined]: lines.combined, [SUMS.expanded]: lines.expanded }),
  ];
  return [
    [along, ...columns.map(([name]) => `${name}, deg/s`)],
    ...lines.at.map((place, k) => [place, ...columns.map(([, values]) => values[k])]),
  ];
}
