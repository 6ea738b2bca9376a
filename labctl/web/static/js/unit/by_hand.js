// What a calibration by hand says beside the gyro's coefficients: the accelerometer, rests and turns.

import { h } from "../core/elements.js";
import { number, withUncertainty } from "../core/format.js";
import { table } from "../core/components.js";

/** @import { Version } from "../../../types/api.js" */

/** Coverage factor: expanded uncertainty. */
const K = 2;

/**
 * The accelerometer's coefficients and a sentence on rests and turns; null for a version that no hand turned.
 * @param {Version} version
 */
export function byHand({ poses }) {
  if (!poses) return null;
  const { rests, moves, held_out, accelerometer } = poses;
  const rows = Object.entries(accelerometer.axes).flatMap(([axis, found]) =>
    Object.entries(found).map(([name, coefficient]) => ({ axis, name, ...coefficient })),
  );
  return h(
    "div",
    { class: "stack" },
    h("h3", {}, "Accelerometer, by gravity in the rests"),
    table(
      [
        { title: "Axis", cell: (row) => row.axis },
        { title: "Coefficient", cell: (row) => h("code", {}, row.name) },
        {
          title: "Value, k = 2",
          number: true,
          cell: (row) => withUncertainty(row.value, K * row.u, row.unit, row.name),
        },
      ],
      rows,
      { dense: true, label: "Coefficients of the accelerometer" },
    ),
    h(
      "p",
      {},
      `${rests.count} rests in ${rests.poses} poses; ${moves.used} of ${moves.count} turns used. Gravity after a turn is off by ` +
        `${number(moves.residual_deg, 2)} deg, by a fit without that turn ${number(held_out.rms_deg, 2)} deg. ` +
        `Not determined: ${poses.not_determined}.`,
    ),
  );
}
