// Which figures a logarithmic axis of errors names; no DOM here.

/** Over less than the first factor there may be no figure with one digit, over less than the second not two of 1, 2, 5. */
const [FEW_DIGITS, DECADE] = [2, 5];

/**
 * Plotly's choice of ticks: 1, 2 and 5 of each decade (D2), every digit (D1), or as it divides the range evenly.
 * @param {readonly (number | null)[]} sizes the values on the axis; unknown ones, zeros and less are not on it
 * @returns {{ dtick: "D1" | "D2" } | { nticks: number }}
 */
export function ticksOf(sizes) {
  const drawn = sizes.filter((size) => size !== null).filter((size) => size > 0);
  const ratio = drawn.length ? Math.max(...drawn) / Math.min(...drawn) : 1;
  if (ratio < FEW_DIGITS) return { nticks: 5 };
  return { dtick: ratio < DECADE ? "D1" : "D2" };
}
