// Which figures a logarithmic axis of errors names; no DOM here.

/** Figures of a decade, the fewer where the axis has many of them, and how many there is room for on a narrow page. */
const OF_DECADE = [[1, 2, 3, 4, 5, 6, 7, 8, 9], [1, 2, 5], [1]];
const MOST_FIGURES = 7;

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

/**
 * The round sizes within a range, for an axis that is drawn without Plotly.
 * @param {number} least above 0
 * @param {number} largest
 * @returns {number[]}
 */
export function roundSizes(least, largest) {
  const [first, last] = [Math.floor(Math.log10(least)), Math.ceil(Math.log10(largest))];
  const decades = Array.from({ length: last - first + 1 }, (_, k) => first + k);
  const choices = OF_DECADE.map((digits) =>
    decades
      .flatMap((decade) => digits.map((digit) => Number(`${digit}e${decade}`)))
      .filter((size) => size >= least && size <= largest),
  );
  return choices.find((sizes) => sizes.length <= MOST_FIGURES) ?? choices[choices.length - 1];
}
