// Numbers of the plan whose points are moved; no DOM.

/** A step of the keyboard and of the mouse is a part of the range, rounded down to a power of ten. */
const STEPS = 100;

/**
 * The step in which a level is moved.
 * @param {readonly [number, number]} range lowest and highest
 */
export const stepOf = ([low, high]) => 10 ** Math.floor(Math.log10((high - low) / STEPS));

/**
 * A level where it is put: on the step, within the range, and on no other level.
 * @param {readonly number[]} levels
 * @param {number} k which of them is moved
 * @param {number} value
 * @param {readonly [number, number]} range
 */
export function movedLevel(levels, k, value, range) {
  const step = stepOf(range);
  const decimals = Math.max(0, -Math.round(Math.log10(step)));
  const inside = Math.min(Math.max(value, range[0]), range[1]);
  const put = Number((Math.round(inside / step) * step).toFixed(decimals));
  return levels.some((other, j) => j !== k && other === put) ? levels[k] : put;
}

/**
 * A range that shows all levels, with a margin, and no more than is allowed.
 * @param {readonly number[]} levels
 * @param {readonly [number, number]} use
 * @param {readonly [number, number]} allowed
 * @returns {[number, number]}
 */
export function shownRange(levels, use, allowed) {
  const [low, high] = [Math.min(use[0], ...levels), Math.max(use[1], ...levels)];
  const margin = 0.25 * (high - low || 1);
  return [Math.max(low - margin, allowed[0]), Math.min(high + margin, allowed[1])];
}
