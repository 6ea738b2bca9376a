// Uncertainty in use of a version: over what was calibrated, and its parts at one rate and temperature.

import { get } from "../core/http/api.js";
import { isAbort, messageOf } from "../core/http/errors.js";
import { h, setChildren } from "../core/elements.js";
import { fixed, plainNumber } from "../core/format.js";
import { busyIndicator, notice, table } from "../core/components.js";
import { labelledField } from "../core/fields.js";
import { query, updateQuery } from "../core/router.js";
import { budgetLines, contributionFigures } from "./budget.js";
import { atPlace, joined, shown, titleOf, unknown, withoutPart } from "./uncertainty_parts.js";

/** @import { AxisUncertainty, Uncertainty, Validity, Version } from "../../../types/api.js" */

/** Where no thermometer was, any temperature is like another, deg C. */
const ANY_C = 25;
const PATH = "/api/units/{serial}/calibrations/{version}/uncertainty";
/** @param {string} text */
const sentence = (text) => text.charAt(0).toUpperCase() + text.slice(1);
/**
 * Return {element, show(version)}: the uncertainty of a version, which is the answer about it.
 * @param {string} serial
 * @param {AbortSignal} signal
 */
export function uncertaintyInUse(serial, signal) {
  const element = h("div", { class: "stack" });
  let latest = 0;
  return {
    element,
    /** @param {Version} version */
    show: async (version) => {
      const own = ++latest;
      const path = { serial, version: version.version };
      setChildren(element, busyIndicator("Working out the uncertainty"));
      try {
        const place = placeOf(version.validity);
        const answer = await get(PATH, { path, query: { ...place, rate_dps: [place.rate_dps], grid: true }, signal });
        if (own === latest)
          setChildren(
            element,
            over(answer),
            aboutAnyAxis(answer),
            parts(answer, place, path, signal),
            pictures(answer),
          );
      } catch (error) {
        // a model that needs more than a rate and a temperature, or without data to be uncertain by
        if (!isAbort(error) && own === latest)
          setChildren(element, notice("warn", h("strong", {}, "Unknown: "), messageOf(error)));
      }
    },
  };
}

/**
 * The place of the address, or the middle of the temperatures at half of the fastest rate.
 * @param {Validity} validity
 */
function placeOf({ rate_dps, temperature_c }) {
  const asked = query();
  // without a thermometer, and so without limits, one temperature is like any other
  const [cold, warm] = [temperature_c[0] ?? ANY_C, temperature_c[1] ?? ANY_C];
  /**
   * @param {string | undefined} text
   * @param {number} otherwise
   */
  const given = (text, otherwise) => (text && Number.isFinite(Number(text)) ? Number(text) : otherwise);
  return {
    rate_dps: given(asked.rate, Number(((rate_dps[1] ?? 0) / 2).toPrecision(3))),
    temperature_c: given(asked.temperature, Number(((cold + warm) / 2).toFixed(1))),
  };
}

/**
 * The table over what was calibrated: a row for each axis and temperature, a column for each rate.
 * @param {Uncertainty} answer
 */
function over({ grid, coverage_factor }) {
  if (!grid) return null;
  const rows = Object.entries(grid.axes).flatMap(([axis, lines]) =>
    lines.map((cells, k) => ({ axis, warm: grid.temperature_c[k], cells })),
  );
  const several = Object.keys(grid.axes).length > 1;
  return h(
    "div",
    { class: "stack" },
    h(
      "p",
      { class: "muted small" },
      `Expanded uncertainty of a corrected rate about the axis of each output, the others at rest, on a later day, after another power-on, in deg/s (k = ${coverage_factor}, about 95\u00a0%). The noise of a single reading is not included.`,
    ),
    table(
      [
        several ? { title: "Axis", cell: (row) => row.axis } : null,
        { title: "Temperature, °C", number: true, cell: (row) => fixed(row.warm, 1) },
        ...grid.rate_dps.map((rate, k) => ({
          title: `${plainNumber(rate, 3)} deg/s`,
          number: true,
          /** @param {{ cells: readonly AxisUncertainty[] }} row */
          cell: (row) => cell(row.cells[k], coverage_factor),
        })),
      ],
      rows,
      { dense: true, label: "Uncertainty in use" },
    ),
    reasons(rows.flatMap((row) => row.cells)),
  );
}

/**
 * The largest uncertainty where the unit turns about any axis: a row for each output.
 * @param {Uncertainty} answer
 */
function aboutAnyAxis({ any_axis }) {
  const rows = Object.entries(any_axis ?? {});
  if (!rows.length) return null;
  const whys = [...new Set(rows.flatMap(([, one]) => [one.why, one.cross_rates?.why ?? ""]))].filter(Boolean);
  const across = [...new Set(rows.flatMap(([, one]) => one.cross_rates?.about ?? []))];
  /** @param {number | null} value */
  const figure = (value) => (value === null ? unknown() : shown(value));
  return h(
    "div",
    { class: "stack" },
    h("h3", {}, "Turned about any axis"),
    h(
      "p",
      { class: "muted small" },
      `The table above holds while the unit turns about the axis of one output. This one holds while it turns about any axis of its case: the largest expanded uncertainty of each corrected rate, in deg/s, over rate vectors of any direction up to ${plainNumber(rows[0][1].reach_dps)} deg/s. The angles of the mountings count in the frame of the case; for a unit whose axes are aligned in use, only their differences count.`,
    ),
    table(
      [
        { title: "Output", cell: ([axis]) => axis },
        { title: "Frame of the case", number: true, cell: ([, one]) => figure(one.bound_dps) },
        { title: "Aligned in use", number: true, cell: ([, one]) => figure(one.aligned_bound_dps) },
        across.length
          ? {
              title: `Per deg/s about ${joined(across)}, without an output`,
              number: true,
              cell: ([, one]) => figure(one.cross_rates?.per_dps ?? null),
            }
          : null,
      ],
      rows,
      { dense: true, label: "Uncertainty about any axis" },
    ),
    whys.length ? notice("warn", h("p", {}, h("strong", {}, "Unknown: "), whys.map(withoutPart).join("; "))) : null,
  );
}

/** @param {Uncertainty} answer */
function pictures({ grid }) {
  return grid
    ? h("div", { class: "stack" }, h("h3", {}, "Contributions"), contributionFigures(grid.contributions))
    : null;
}

/**
 * An expanded uncertainty; where it is unknown, what is known of it below.
 * @param {AxisUncertainty} one
 * @param {number} k
 */
function cell(one, k) {
  if (one.expanded_dps !== null) return shown(one.expanded_dps);
  const least =
    one.same_run_dps === null ? null : h("div", { class: "muted small" }, `same run ${shown(k * one.same_run_dps)}`);
  return [unknown(), least];
}

/**
 * Why some of the cells are unknown, one line for each reason.
 * @param {readonly AxisUncertainty[]} cells
 */
function reasons(cells) {
  /** @type {Map<string, { parts: Set<string>, cells: Set<AxisUncertainty> }>} */
  const found = new Map();
  for (const one of cells)
    for (const [part, why] of Object.entries(one.unknown)) {
      const places = found.get(why) ?? { parts: new Set(), cells: new Set() };
      places.parts.add(titleOf(part).toLowerCase());
      places.cells.add(one);
      found.set(why, places);
    }
  if (!found.size) return null;
  /** @param {number} n */
  const where = (n) => (n === cells.length ? "" : ` (${n} of ${cells.length} cells)`);
  return notice(
    "warn",
    h("p", {}, h("strong", {}, "Why it is unknown:")),
    h(
      "ul",
      { class: "plain" },
      [...found].map(([why, { parts: names, cells: here }]) =>
        h("li", {}, `${sentence(joined([...names]))}: ${why}${where(here.size)}.`),
      ),
    ),
    cells.some((one) => one.expanded_dps === null && one.same_run_dps !== null)
      ? h(
          "p",
          { class: "small" },
          "“same run”: uncertainty of coefficients, model and standards, expanded; valid only until the unit is switched off.",
        )
      : null,
  );
}

/**
 * The parts at a place that can be chosen.
 * @param {Uncertainty} first
 * @param {{ rate_dps: number, temperature_c: number }} place
 * @param {{ serial: string, version: number }} path
 * @param {AbortSignal} signal
 */
function parts(first, place, path, signal) {
  const result = h("div", { class: "stack", "aria-live": "polite" });
  /**
   * @param {number} value
   * @returns {HTMLInputElement}
   */
  const input = (value) =>
    h("input", {
      type: "number",
      step: "any",
      required: true,
      value: String(value),
      style: "width: 9rem",
      onchange: ask,
    });
  const [rate, warm] = [input(place.rate_dps), input(place.temperature_c)];
  let latest = 0;
  async function ask() {
    if (!rate.reportValidity() || !warm.reportValidity()) return;
    const own = ++latest;
    updateQuery({ rate: rate.value, temperature: warm.value });
    try {
      const asked = { rate_dps: [Number(rate.value)], temperature_c: Number(warm.value) };
      const answer = await get(PATH, { path, query: asked, signal });
      if (own === latest) setChildren(result, atPlace(answer), budgetLines(answer));
    } catch (error) {
      if (!isAbort(error) && own === latest) setChildren(result, notice("bad", messageOf(error)));
    }
  }
  setChildren(result, atPlace(first), budgetLines(first));
  return h(
    "div",
    { class: "stack" },
    h("h3", {}, "Contributions to the uncertainty"),
    h("div", { class: "row" }, labelledField("Rate, deg/s", rate), labelledField("Temperature, °C", warm)),
    result,
  );
}
