// Columns of a trace as lines and outlines that stop at gaps.

/** @typedef {[first: number, last: number]} Piece */

/**
 * Continuous pieces of the bins: [first, last] of each; a gap is longer than three columns.
 * @param {readonly number[]} t
 * @param {number} column
 */
export function continuousPieces(t, column) {
  const steps = t
    .slice(1)
    .map((value, k) => value - t[k])
    .sort((a, b) => a - b);
  const gap = 3 * Math.max(column, steps[Math.floor(steps.length / 2)] ?? 0);
  /** @type {Piece[]} */
  const pieces = [];
  t.forEach((value, k) => {
    const last = pieces.at(-1);
    if (last && value - t[last[1]] <= gap) last[1] = k;
    else pieces.push([k, k]);
  });
  return pieces;
}

/**
 * @param {readonly number[]} t
 * @param {readonly number[]} values
 * @param {readonly string[]} texts
 * @param {readonly Piece[]} pieces
 */
export function meanLine(t, values, texts, pieces) {
  /** @type {{ x: (number | null)[], y: (number | null)[], text: (string | null)[] }} */
  const { x, y, text } = { x: [], y: [], text: [] };
  for (const [from, to] of pieces) {
    x.push(...t.slice(from, to + 1), null);
    y.push(...values.slice(from, to + 1), null);
    text.push(...texts.slice(from, to + 1), null);
  }
  return { x, y, text };
}

/**
 * Outline of each piece: forward along the maximum, back along the minimum.
 * @param {readonly number[]} t
 * @param {{ min: readonly number[], max: readonly number[] }} found
 * @param {readonly Piece[]} pieces
 */
export function envelopeOutline(t, found, pieces) {
  /** @type {{ x: (number | null)[], y: (number | null)[] }} */
  const { x, y } = { x: [], y: [] };
  for (const [from, to] of pieces) {
    x.push(...t.slice(from, to + 1), ...t.slice(from, to + 1).reverse(), t[from], null);
    y.push(...found.max.slice(from, to + 1), ...found.min.slice(from, to + 1).reverse(), found.max[from], null);
  }
  return { x, y };
}
