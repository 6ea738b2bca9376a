// The page of noise at rest: the Allan deviations of several recordings over each other, with the data sheet's line.

import { get, getPart } from "../core/http/api.js";
import { Problem } from "../core/http/errors.js";
import { h, setChildren } from "../core/elements.js";
import { figure } from "../core/figure.js";
import { ticksOf } from "../core/log_ticks.js";
import { duration, number } from "../core/format.js";
import { card, emptyState, loadInto, notice, pageHeader, table } from "../core/components.js";
import { pointPlace, selectPoints } from "../core/figure_point.js";
import { longList } from "../core/long_list.js";
import { updateQuery } from "../core/router.js";
import { allanPoint, askedAllan, NOISE_FIGURES } from "../recordings/allan.js";

/** @import { Allan, NoiseFigure, RecordingRow } from "../../../types/api.js" */
/** @import { PageContext } from "../../../types/pages.js" */

/** @typedef {Pick<RecordingRow, "id" | "serial">} Row */
/** @typedef {{ row: Row, found: Allan | null, why: string }} Record */
/** @typedef {{ id: number, why: string }} LeftOut a recording that was asked for and cannot be drawn */

const MOST = 8;
/** What a recording without every reading holds, in words. @type {{ [kind: string]: string }} */
const HELD = { points: "only means of data sets", coefficients: "only published coefficients" };
const COLOURS = ["#4477aa", "#ee6677", "#228833", "#ccbb44", "#66ccee", "#aa3377", "#888888", "#222255"];
const DASHES = ["solid", "dash", "dot"];
const DASH_NAMES = ["solid", "dashed", "dotted"];

/** @param {PageContext} context */
export async function page({ query, signal }) {
  /** @type {Map<number, Row>} */
  const known = new Map();
  /** @type {Map<number, HTMLInputElement>} */
  const boxes = new Map();
  const asked = [...new Set((query.recordings ?? "").split(",").filter(Boolean).map(Number))];
  const read = await Promise.all(asked.slice(0, MOST).map((id) => rowOf(id, signal)));
  const first = read.flatMap((each) => ("serial" in each ? [each] : []));
  /** @type {LeftOut[]} */
  let leftOut = [
    ...read.flatMap((each) => ("why" in each ? [each] : [])),
    ...asked.slice(MOST).map((id) => ({ id, why: `at most ${MOST} are drawn at once.` })),
  ];
  for (const row of first) known.set(row.id, row);
  let chosen = first.map((row) => row.id);
  const place = h("div", { class: "stack" });
  const show = () =>
    loadInto(place, "Working out the Allan deviations", async () => {
      const rows = [...chosen].sort((a, b) => b - a).flatMap((id) => known.get(id) ?? []);
      place.setAttribute("data-source", rows.map((row) => `unit ${row.serial}, recording ${row.id}`).join("; "));
      const records = await Promise.all(rows.map((row) => recordOf(row, signal)));
      if (!records.length && !leftOut.length) return emptyState("Choose one recording or more.");
      return [leftOutNotice(records, leftOut), overlay(records)];
    });
  /** @param {number} id */
  const toggle = (id) => {
    leftOut = []; // what the address asked for is no longer what is shown
    chosen = chosen.includes(id) ? chosen.filter((each) => each !== id) : [...chosen, id].slice(-MOST);
    for (const [each, box] of boxes) box.checked = chosen.includes(each);
    updateQuery({ recordings: chosen.join(",") });
    show();
  };
  /** @param {readonly Row[]} rows */
  const choices = (rows) => {
    boxes.clear();
    const listed = new Set(rows.map((row) => row.id));
    for (const row of rows) known.set(row.id, row);
    const others = chosen.filter((id) => !listed.has(id)).flatMap((id) => known.get(id) ?? []); // that are not in the part
    return h(
      "div",
      { class: "stack" },
      [...others, ...rows].map((row) => {
        const box = h("input", { type: "checkbox", checked: chosen.includes(row.id), onchange: () => toggle(row.id) });
        boxes.set(row.id, box);
        return h("label", { class: "row" }, box, `Recording ${row.id}, ${row.serial}`);
      }),
    );
  };
  const list = await longList({
    what: "recordings",
    hint: "Serial number or notes.",
    search: query.search,
    read: (part) => getPart("/api/recordings", { query: { ...part, kind: "samples" }, signal }),
    draw: choices,
    empty: emptyState(
      "An Allan deviation needs every reading, but all recordings hold only means. Import a recording with all readings.",
    ),
  });
  if (asked.length) show();
  else setChildren(place, emptyState("Choose one recording or more."));
  return h(
    "div",
    { class: "page" },
    pageHeader("Noise at rest", "Allan deviations of the longest section at rest of each recording, in one picture."),
    card("Recordings", h("p", { class: "muted" }, `At most ${MOST} at once.`), list.element),
    card("Allan deviation", place),
  );
}

/**
 * A recording that the address of the page names; or why it cannot be drawn: it is not there, or holds no readings.
 * @param {number} id
 * @param {AbortSignal} signal
 * @returns {Promise<Row | LeftOut>}
 */
async function rowOf(id, signal) {
  try {
    const path = { recording: id };
    const found = await get("/api/recordings/{recording}", { path, query: { points: false }, signal });
    if (found.kind === "samples") return { id, serial: found.serial };
    return { id, why: `it holds ${HELD[found.kind] ?? found.kind}, and an Allan deviation needs every reading.` };
  } catch (error) {
    if (error instanceof Problem && error.status < 500) return { id, why: error.message };
    throw error;
  }
}

/**
 * How many of the recordings that were asked for are drawn, and why the others are not; nothing where all are.
 * @param {readonly Record[]} records
 * @param {readonly LeftOut[]} others
 */
function leftOutNotice(records, others) {
  const all = [...records.filter(({ found }) => !found).map(({ row, why }) => ({ id: row.id, why })), ...others];
  if (!all.length) return null;
  const asked = records.length + others.length;
  return notice(
    "warn",
    h("p", {}, h("strong", {}, `${asked - all.length} of ${asked} recordings are drawn.`)),
    all.map(({ id, why }) => h("p", {}, `Recording ${id}: ${why}`)),
  );
}

/**
 * A recording with its Allan deviation, or with the reason why it has none.
 * @param {Row} row
 * @param {AbortSignal} signal
 * @returns {Promise<Record>}
 */
async function recordOf(row, signal) {
  try {
    const found = await get("/api/recordings/{recording}/allan", { path: { recording: row.id }, signal });
    return { row, found, why: "" };
  } catch (error) {
    if (error instanceof Problem && error.status < 500) return { row, found: null, why: error.message };
    throw error;
  }
}

/** @param {readonly Record[]} records */
function overlay(records) {
  const lines = records.flatMap(({ row, found }, k) =>
    Object.entries(found?.axes ?? {}).map(([axis, noise], n) => ({ row, axis, noise, found, k, n })),
  );
  const draw = () => ({
    data: [
      ...lines.map(({ row, axis, noise, k, n }) => ({
        type: "scatter",
        mode: "lines+markers",
        x: noise.tau_s,
        y: noise.deviation_dps,
        line: { color: COLOURS[k % COLOURS.length], dash: DASHES[n % DASHES.length], width: 2 },
        marker: { size: 4 },
        name: `${row.id} ${row.serial}`, // one name for all axes of a recording: their dashes are in the caption
        legendgroup: `recording ${row.id}`,
        showlegend: n === 0,
        hovertemplate: `${row.serial} ${axis}: %{y:.3~g} deg/s over %{x:.3~g} s<extra></extra>`,
      })),
      ...records.flatMap(({ row, found }, k) =>
        records.findIndex((each) => each.row.serial === row.serial && each.found) === k
          ? datasheetLines(row, found, COLOURS[k % COLOURS.length])
          : [],
      ),
    ],
    layout: {
      xaxis: { type: "log", title: { text: "averaging time, s" } },
      yaxis: {
        type: "log",
        title: { text: "Allan deviation, deg/s" },
        ...ticksOf(lines.flatMap(({ noise }) => noise.deviation_dps)),
      },
      margin: { l: 70, r: 12, t: 8, b: 46 },
    },
  });
  const csv = () => [
    ["recording", "axis", "tau_s", "deviation_dps", "low_dps", "high_dps"],
    ...lines.flatMap(({ row, axis, noise }) =>
      noise.tau_s.map((tau, i) => [row.id, axis, tau, noise.deviation_dps[i], noise.low_dps[i], noise.high_dps[i]]),
    ),
  ];
  const place = pointPlace();
  const drawn = lines.length
    ? figure(
        "Allan deviations",
        `${dashText(lines)}Thin lines: the unit's data sheet, if known. Click a point to see what it is made of.`,
        draw,
        { height: "26rem", csv },
      )
    : null;
  if (drawn)
    selectPoints(drawn, place, (series, k) => {
      const line = lines[series];
      return line ? allanPoint(line.row.id, line.axis, line.noise.tau_s[k]) : null;
    });
  place.open(
    (key) => records.map(({ row, found }) => found && askedAllan(key, row.id, null, found)).find(Boolean) ?? null,
  );
  return [
    drawn,
    place.element,
    lines.length
      ? table(
          [
            { title: "Record", cell: ({ row, axis }) => `${row.id} ${row.serial}, axis ${axis}` },
            { title: "Length", cell: ({ found }) => duration(found?.duration_s ?? null) },
            ...NOISE_FIGURES.map(([letter, name]) => ({
              title: `${letter}, ${name}`,
              /** @param {typeof lines[number]} line */
              cell: ({ noise }) => figureText(noise[letter]),
            })),
          ],
          lines,
          { label: "Figures of IEEE Std 952" },
        )
      : null,
  ];
}

/**
 * The lines of a data sheet: angle random walk falls with the root of the averaging time, bias stability is level.
 * @param {Row} row
 * @param {Allan | null} found
 * @param {string} colour
 */
function datasheetLines(row, found, colour) {
  const tau = Object.values(found?.axes ?? {})[0]?.tau_s ?? [];
  /** @type {[string, (tau: number) => number][]} */
  const laws = [];
  const { angle_random_walk_dps_rthz: walk, bias_stability_dps: stability } = found?.datasheet ?? {};
  if (walk) laws.push(["angle random walk", (t) => walk / Math.sqrt(t)]);
  if (stability) laws.push(["bias stability", () => stability]);
  return laws.map(([what, law], k) => ({
    type: "scatter",
    mode: "lines",
    x: tau,
    y: tau.map((t) => (t === null ? null : law(t))),
    line: { color: colour, width: 1 },
    name: `${row.serial}, data sheet`,
    legendgroup: `data sheet ${row.serial}`,
    showlegend: k === 0,
    hovertemplate: `${row.serial}, data sheet: ${what}<extra></extra>`,
  }));
}

/**
 * Which dash is of which axis, where there are several.
 * @param {readonly { axis: string, n: number }[]} lines
 */
function dashText(lines) {
  const axes = new Map(lines.map(({ axis, n }) => [axis, DASH_NAMES[n % DASHES.length]]));
  if (axes.size < 2) return "";
  return `Axes: ${[...axes].map(([axis, dash]) => `${axis} ${dash}`).join(", ")}. `;
}

/** @param {NoiseFigure} noise */
function figureText(noise) {
  if (noise.value !== null) return `${number(noise.value)} ${noise.unit}`;
  return noise.at_most === null ? "not seen" : `below ${number(noise.at_most, 2)} ${noise.unit}`;
}
