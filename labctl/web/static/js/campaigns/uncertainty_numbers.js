// U of a running campaign against its number of data sets, as it is drawn.

/** @import { UncertaintyCourse } from "../../../types/api.js" */

/** @typedef {UncertaintyCourse["units"][string]} UnitCourse */

/**
 * The points of one kind: U of the fit, or its lower bound. What is unknown has no point.
 * @param {UnitCourse} course
 * @param {"of the fit" | "at least"} known
 */
export function pointsOf(course, known) {
  const rows = course.known.flatMap((each, k) => (each === known && course.u_dps[k] !== null ? [k] : []));
  return {
    x: rows.map((k) => course.datasets[k]),
    y: rows.map((k) => /** @type {number} */ (course.u_dps[k])),
  };
}

/**
 * The range of data sets that is drawn: from none to all of the plan.
 * @param {UncertaintyCourse} answer
 * @returns {[number, number]}
 */
export const axisOf = ({ planned, units }) => [
  0,
  Math.max(planned, 1, ...Object.values(units).flatMap((each) => each.datasets)),
];
