// A plan as what its chart draws: steps in time, the course of the set point, bands of positions.

import { isNumber } from "../core/format.js";

/** @import { Timeline } from "../../../types/api.js" */
/** @typedef {ReturnType<typeof planSteps>[number]} PlanStep */

/**
 * Steps in order of time, with begin and end in units of `unit_s`: actual times where a step has run, else planned.
 * @param {Timeline} timeline
 * @param {number} unit_s
 */
export function planSteps(timeline, unit_s) {
  return timeline.number.map((number, k) => {
    const from = timeline.forecast_s?.[k] ?? timeline.start_s[k];
    const over = timeline.ended_s?.[k];
    const until =
      isNumber(over) && over >= from ? over : from + (timeline.state?.[k] === "skipped" ? 0 : timeline.expected_s[k]);
    return {
      number,
      kind: timeline.kind[k],
      from: from / unit_s,
      until: until / unit_s,
      warm: timeline.temperature_c[k],
      rate: timeline.rate_dps[k],
      turn: timeline.turn_deg[k],
      position: timeline.position[k],
      dataset: timeline.dataset[k],
      state: timeline.state?.[k] ?? "to come",
    };
  });
}

/**
 * The chamber set point over time: constant, or a ramp while the chamber moves.
 * @param {readonly Pick<PlanStep, "warm" | "kind" | "from" | "until">[]} steps
 */
export function setPointCourse(steps) {
  /** @type {number[]} */
  const x = [];
  /** @type {number[]} */
  const y = [];
  /** @type {number | null} */
  let held = null;
  for (const step of steps) {
    if (step.warm === null) continue;
    if (step.kind === "move_chamber") {
      x.push(step.from, step.until);
      y.push(held ?? step.warm, step.warm);
    } else {
      x.push(step.from, step.until);
      y.push(step.warm, step.warm);
    }
    held = step.warm;
  }
  return { x, y };
}

/** @param {readonly Pick<PlanStep, "position" | "from" | "until">[]} steps */
export function positionBands(steps) {
  /** @type {{ position: string, from: number, until: number }[]} */
  const found = [];
  for (const step of steps) {
    if (!step.position) continue;
    const last = found.at(-1);
    if (last?.position === step.position) last.until = step.until;
    else found.push({ position: step.position, from: step.from, until: step.until });
  }
  return found;
}
