// Signatures: the error of each effect against the variable that shows it best, as functions. Schematic, without sizes.

/** @typedef {(x: number) => number} Curve */
/**
 * @typedef {object} Signature
 * @property {string} over the variable, a key of VARIABLES
 * @property {[name: string, curve: Curve][]} lines
 * @property {Curve} [course] the temperature in the background
 * @property {[at: number, text: string][]} [marks]
 */

/** @param {number} degrees */
const cosine = (degrees) => Math.cos((degrees * Math.PI) / 180);
/**
 * @param {number} x
 * @param {number} knee
 */
const excess = (x, knee) => Math.sign(x) * Math.max(0, Math.abs(x) - knee);
/**
 * Temperature over a campaign: three plateaus with ramps between, 0 to 1.
 * @param {number} t
 */
const temperatureCourse = (t) =>
  [
    [0.15, 0.3],
    [0.6, 0.75],
  ].reduce((sum, [from, to]) => sum + 0.5 * Math.min(Math.max((t - from) / (to - from), 0), 1), 0);
/** @param {number} t */
const temperatureSlope = (t) => ((t > 0.15 && t < 0.3) || (t > 0.6 && t < 0.75) ? 1 : 0);
/**
 * Lag behind the temperature: grows on each of two ramps, decays after it.
 * @param {number} t
 */
const laggedTemperature = (t) =>
  [
    [0.15, 0.3],
    [0.6, 0.75],
  ].reduce(
    (sum, [from, to]) =>
      sum +
      (t < from
        ? 0
        : t < to
          ? 1 - Math.exp(-(t - from) / 0.08)
          : (1 - Math.exp(-(to - from) / 0.08)) * Math.exp(-(t - to) / 0.08)),
    0,
  );
/**
 * @param {readonly number[]} at
 * @param {readonly number[]} levels
 * @returns {Curve}
 */
const stepFunction = (at, levels) => (t) => levels[at.filter((edge) => t >= edge).length];

/**
 * Variables: axis title, from, to.
 * @type {Record<string, [title: string, from: number, to: number]>}
 */
export const VARIABLES = {
  rate: ["table rate", -1, 1],
  other: ["rate about another axis", -1, 1],
  temperature: ["temperature", -1, 1],
  time: ["time through the campaign", 0, 1],
  power: ["time since power-on", 0, 1],
  inside: ["time within a data set", 0, 1],
  angle: ["table angle, deg", 0, 360],
  previous: ["rate before this one", -1, 1],
  supply: ["supply voltage", -1, 1],
  position: ["which axis of the unit points up", 0, 5],
};
export const POSITIONS = ["x", "-x", "y", "-y", "z", "-z"];

/**
 * @param {string} over
 * @param {Curve} f
 * @param {Partial<Signature>} [more]
 * @returns {Signature}
 */
const single = (over, f, more = {}) => ({ over, lines: [["error", f]], ...more });
/**
 * @param {string} over
 * @param {readonly string[]} names
 * @param {(x: number, level: number) => number} f
 * @returns {Signature}
 */
const family = (over, names, f) => ({
  over,
  lines: names.map((name, k) => [name, (x) => f(x, names.length > 1 ? (2 * k) / (names.length - 1) - 1 : 0)]),
});
const LEVELS = ["cold", "room", "hot"];
/** @type {Record<string, Signature>} */
const ALL = {
  bias: single("rate", () => 0.6),
  bias_temperature: single("temperature", (x) => 0.6 * x + 0.5 * x * x),
  scale_factor: single("rate", (x) => x),
  scale_factor_temperature: family("rate", LEVELS, (x, warm) => warm * x),
  scale_factor_asymmetry: single("rate", (x) => Math.abs(x)),
  scale_factor_even: single("rate", (x) => x * x),
  scale_factor_odd: single("rate", (x) => x ** 3),
  sine_response: single("rate", (x) => 2.2 * (Math.sin(1.6 * x) / 1.6 - x)),
  saturation: single("rate", (x) => -2 * excess(x, 0.6)),
  rate_temperature_surface: family(
    "rate",
    LEVELS,
    (x, warm) => 0.5 * x ** 3 + 0.45 * warm * x + 0.35 * warm * warm - 0.2,
  ),
  misalignment: single("other", (x) => x),
  non_orthogonality: single("other", (x) => x),
  cross_axis_nonlinearity: single("other", (x) => x * x),
  vibration_rectification: single("rate", (x) => (x === 0 ? 0 : Math.exp(-((Math.log(Math.abs(x) / 0.5) / 0.2) ** 2)))),
  dead_band: single("rate", (x) =>
    Math.abs(x) < 0.2 ? -x * 3.5 : -0.7 * Math.sign(x) * Math.exp(-(Math.abs(x) - 0.2) / 0.12),
  ),
  quantization: single("rate", (x) => 3 * (Math.round(x * 4) / 4 - x) * 2),
  g_sensitivity: single("position", (k) => [0, 0, 0, 0, 1, -1][k]),
  cross_g_sensitivity: single("position", (k) => [0.8, -0.8, -0.5, 0.5, 0, 0][k]),
  g_squared_sensitivity: single("position", (k) => [0, 0, 0, 0, 1, 1][k]),
  centripetal_acceleration: single("rate", (x) => 0.9 * x * x),
  earth_rate: single("position", (k) => [0, 0, 0, 0, 0.7, -0.7][k]),
  earth_rate_tilt: single("angle", (x) => cosine(x - 60)),
  magnetic_sensitivity: single("angle", (x) => cosine(x + 110)),
  table_tilt: single("angle", (x) => 0.7 * cosine(x - 20) + 0.35 * cosine(2 * x + 40)),
  table_rate_ratio: single("rate", (x) => 0.8 * x),
  table_rate_ripple: {
    over: "angle",
    lines: [
      ["slow", (x) => 0.3 * cosine(4 * x)],
      ["fast", (x) => cosine(4 * x)],
    ],
  },
  missed_steps: single("rate", (x) => (Math.abs(x) > 0.75 ? -Math.sign(x) * (0.5 + 2 * (Math.abs(x) - 0.75)) : 0)),
  temperature_rate: single("time", (t) => 0.9 * temperatureSlope(t), { course: temperatureCourse }),
  thermal_lag: single("time", laggedTemperature, { course: temperatureCourse }),
  scale_factor_lag: {
    over: "time",
    lines: [
      ["rate forwards", laggedTemperature],
      ["rate backwards", (t) => -laggedTemperature(t)],
    ],
    course: temperatureCourse,
  },
  thermal_hysteresis: {
    over: "temperature",
    lines: [
      ["from below", (x) => 0.6 * (1 - x * x)],
      ["from above", (x) => -0.6 * (1 - x * x)],
    ],
  },
  warm_up: single("power", (t) => Math.exp(-t / 0.2)),
  self_heating: { over: "power", lines: [["error", (t) => 1 - Math.exp(-t / 0.25)]] },
  thermometer_error: single("temperature", (x) => 0.7 * x),
  bias_drift: single("time", (t) => 1.6 * t - 0.8),
  run_shift: single("time", stepFunction([0.3, 0.65], [-0.2, 0.7, -0.6]), {
    marks: [
      [0.3, "power-on"],
      [0.65, "power-on"],
    ],
  }),
  mounting_shift: single("time", stepFunction([0.33, 0.67], [0.1, -0.7, 0.6]), {
    marks: [
      [0.33, "mounted"],
      [0.67, "mounted"],
    ],
  }),
  rate_hysteresis: single("previous", (x) => 0.8 * x),
  start_transient: single("inside", (t) => -Math.exp(-t / 0.15)),
  time_delay: single("inside", (t) => 0.5 * (Math.sin(6 * (t - 0.12)) - Math.sin(6 * t))),
  bandwidth: single("inside", (t) => 0.4 * (0.8 * Math.sin(6 * t - 0.6) - Math.sin(6 * t))),
  supply_sensitivity: single("supply", (x) => 0.8 * x),
};

const POINTS = 181;

/**
 * The signature of an effect as numbers: {over, title, lines: [{name, x, y}], course, marks}; null where the effect has none.
 * @param {string} id
 */
export function signature(id) {
  const found = ALL[id];
  if (!found) return null;
  const [title, from, to] = VARIABLES[found.over];
  const x =
    found.over === "position"
      ? POSITIONS.map((_, k) => k)
      : Array.from({ length: POINTS }, (_, k) => from + ((to - from) * k) / (POINTS - 1));
  return {
    over: found.over,
    title,
    from,
    to,
    marks: found.marks ?? [],
    lines: found.lines.map(([name, f]) => ({ name, x, y: x.map(f) })),
    course: found.course ? { x, y: x.map(found.course) } : null,
  };
}
