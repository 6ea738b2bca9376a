// Marks that tell the recordings of one picture apart: a symbol for each, and its legend.

/** @import { PlotTrace } from "../../../types/pages.js" */

const SYMBOLS = ["circle", "square", "diamond", "triangle-up", "triangle-down", "cross", "x", "star"];

/**
 * The symbol of a recording among others; more than eight have open symbols, and begin again after sixteen.
 * @param {readonly number[]} recordings
 * @param {number} recording
 */
export function symbolOf(recordings, recording) {
  const place = recordings.indexOf(recording);
  const symbol = SYMBOLS[Math.max(place, 0) % SYMBOLS.length];
  return Math.floor(place / SYMBOLS.length) % 2 === 1 ? `${symbol}-open` : symbol;
}

/**
 * The recordings that rows are of, rising.
 * @param {readonly number[] | null | undefined} rows
 */
export const recordingsIn = (rows) => [...new Set(rows ?? [])].sort((a, b) => a - b);

/**
 * The marker option and the legend for rows of several recordings; without a difference where they are of one.
 * @param {readonly number[] | null | undefined} rows the recording of each row
 * @param {string} colour of the symbols in the legend
 * @returns {{ marker: { symbol?: string[] }, legend: PlotTrace[] }}
 */
export function recordingMarks(rows, colour) {
  const recordings = recordingsIn(rows);
  if (!rows || recordings.length < 2) return { marker: {}, legend: [] };
  return {
    marker: { symbol: rows.map((recording) => symbolOf(recordings, recording)) },
    legend: recordings.map((recording) => ({
      type: "scatter",
      mode: "markers",
      name: `recording ${recording}`,
      x: [null],
      y: [null],
      showlegend: true,
      hoverinfo: "skip",
      marker: { symbol: symbolOf(recordings, recording), size: 9, color: colour },
    })),
  };
}
