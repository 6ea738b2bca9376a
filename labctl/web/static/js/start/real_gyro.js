// The picture of the start page: what adding the missing effect does to the error of the real gyro of the examples.

import { h, svg } from "../core/elements.js";
import { number } from "../core/format.js";

/** Residual of each model after a fit to the example `osu-fog`, RMS in deg/s; a test fits it and compares. */
const MODELS = [
  { name: "Bias and scale factor", rms_dps: 0.53 },
  { name: "With the sine response of the interferometer", rms_dps: 0.0481 },
];
/** What means of the same rate and temperature scatter by, deg/s. */
const FLOOR_DPS = 0.0333;

const [WIDTH, ROW, BAR, LEFT] = [560, 56, 18, 4];
const SCALE = (WIDTH - 2 * LEFT - 90) / MODELS[0].rms_dps;

/** @param {number} value */
const dps = (value) => `${number(value, 3)} deg/s`;

export function realGyroPicture() {
  const height = ROW * MODELS.length + 26;
  const floor = LEFT + SCALE * FLOOR_DPS;
  const words = `${MODELS.map(({ name, rms_dps }) => `${name}: ${dps(rms_dps)}`).join("; ")}; noise floor: ${dps(FLOOR_DPS)}`;
  return h(
    "figure",
    { class: "before-after" },
    svg(
      "svg",
      { viewBox: `0 0 ${WIDTH} ${height}`, role: "img", "aria-label": `Error after the fit, RMS. ${words}` },
      MODELS.map(({ name, rms_dps }, k) => [
        svg("text", { x: LEFT, y: ROW * k + 16, class: "name" }, name),
        svg("rect", { x: LEFT, y: ROW * k + 24, width: SCALE * rms_dps, height: BAR, class: k ? "after" : "before" }),
        svg("line", { x1: floor, x2: floor, y1: ROW * k + 21, y2: ROW * k + 27 + BAR, class: "floor" }),
        svg("text", { x: LEFT + SCALE * rms_dps + 8, y: ROW * k + 38 }, dps(rms_dps)),
      ]),
      svg("text", { x: LEFT, y: height - 5, class: "name" }, `Line: noise floor, ${dps(FLOOR_DPS)}`),
    ),
    h(
      "figcaption",
      {},
      "Error that remains after the fit, RMS, of a fibre-optic gyro measured at Ohio State University.",
    ),
  );
}
