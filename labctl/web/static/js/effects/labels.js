// Labels of origins, views, channels and technologies in the catalogue.

/** @type {Record<string, [name: string, about: string]>} */
export const ORIGINS = {
  sensor: ["Sensor", "Errors of the sensing element and its electronics."],
  package: ["Package", "Orientation of the sensing axes in the unit's case."],
  fixture: [
    "Fixture",
    "Orientation and position of the unit on the table. labctl fits these errors so that they do not distort the gyro's coefficients; not part of a calibration.",
  ],
  bench: [
    "Bench",
    "Errors of the table and the thermometer. labctl reports them as errors of the bench; they are not part of a calibration.",
  ],
  environment: [
    "Environment",
    "The Earth's rate and field, and what changes from one power-on to the next. Not part of a calibration.",
  ],
};

/** @type {Record<string, string>} */
export const VIEWS = {
  map: "the map over rate and temperature",
  time: "the course in time",
  angle: "the periodic errors over the table angle",
  frequency: "the periodic errors over time",
  time_in_set: "the mean course of a data set",
  legs: "heating compared with cooling",
  previous_rate: "the residual against the rate before",
  repeats: "points measured again",
  worst: "the worst data sets",
  table_rate_dps: "the residual against the table rate",
  temperature_c: "the residual against the gyro's temperature",
  power_s: "the residual against the time since power-on",
  supply_v: "the residual against the supply voltage",
};

/** @type {Record<string, string>} */
export const CHANNELS = {
  t_s: "time of each reading",
  power_s: "time since power-on",
  table_angle_deg: "table angle",
  supply_v: "supply voltage",
  raw_code: "the raw code of the converter",
  run: "number of the powered session",
  mounting: "number of the mounting",
};

/** @type {Record<string, string>} */
export const TECHNOLOGIES = { fog: "Fibre-optic (FOG)", mems: "MEMS", piezo: "Piezoelectric vibrating" };
