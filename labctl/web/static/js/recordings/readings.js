// The raw readings of one data set.

import { get } from "../core/http/api.js";
import { setChildren, h } from "../core/elements.js";
import { colour, figure } from "../core/figure.js";
import { count, number, plainNumber } from "../core/format.js";
import { factList, cardWithHeader, loadInto, table } from "../core/components.js";
import { option, selectField } from "../core/fields.js";
import { channelName, channelTitle, channelUnit } from "./channels.js";
import { RATE_TITLES } from "./motion_texts.js";

/** @import { Samples } from "../../../types/api.js" */
/** @import { Fact, RecordingState } from "../../../types/pages.js" */

const MAX_READINGS = 20_000;
const TABLE_ROWS = 40;
const NO_CHANNEL = new Set(["dataset", "t_s", "position", "run", "mounting", "valid"]);

/**
 * The card of the selected data set; empty until one is selected.
 * @param {RecordingState} state
 * @param {AbortSignal} signal
 */
export function datasetReadings(state, signal) {
  const element = h("div", {});
  async function show() {
    const k = state.dataset === null ? -1 : state.sets.number.indexOf(state.dataset);
    if (k < 0) return setChildren(element);
    const place = h("div", { class: "stack" });
    const close = h("button", { type: "button", class: "button tiny", onclick: () => state.pick(null) }, "Close");
    const showButton =
      state.sets.t_from_s[k] !== null && state.showInTrace
        ? h("button", { type: "button", class: "button tiny", onclick: () => state.showInTrace?.(k) }, "In the trace")
        : null;
    setChildren(
      element,
      cardWithHeader(
        `Data set ${state.dataset}`,
        h("div", { class: "row" }, showButton, close),
        summary(state, k),
        place,
      ),
    );
    if (state.kind === "samples")
      await loadInto(place, "Reading", async () =>
        readingsFigure(
          state,
          await get("/api/recordings/{recording}/samples", {
            path: { recording: state.id },
            query: { dataset: state.dataset, limit: MAX_READINGS },
            signal,
          }),
        ),
      );
    return element;
  }
  show();
  return Object.assign(element, { redraw: show });
}

/**
 * @param {RecordingState} state
 * @param {number} k
 */
function summary(state, k) {
  const { sets } = state;
  /** @type {Fact[]} */
  const outputs = Object.entries(sets.channels)
    .filter(([name]) => name.startsWith("gyro_"))
    .map(([name, { mean, std }]) => {
      const unit = channelUnit(name, state.output);
      const scatter = std[k] === null ? null : `scatter ${number(std[k], 3)} ${unit}`;
      return [channelName(name).replace("gyro output", "Output"), number(mean[k], 6), unit, scatter];
    });
  const rateTitle = RATE_TITLES[state.motion];
  const [from, until] = [sets.t_from_s[k], sets.t_until_s[k]];
  return factList([
    rateTitle
      ? [
          rateTitle,
          plainNumber(sets.table_rate_dps[k], 7),
          "deg/s",
          `${sets.position[k]} up, mounting ${sets.mounting[k]}, session ${sets.run[k]}`,
        ]
      : ["Session", `${sets.run[k]}`, "", `mounting ${sets.mounting[k]}`],
    sets.channels.temperature_c
      ? [
          "Gyro temperature",
          number(sets.channels.temperature_c.mean[k], 4),
          "°C",
          sets.chamber_setpoint_c[k] === null ? null : `set point ${plainNumber(sets.chamber_setpoint_c[k])} °C`,
        ]
      : null,
    ...outputs,
    ["Readings", count(sets.n[k]), "", from === null || until === null ? null : `over ${number(until - from, 4)} s`],
    sets.lost[k] || sets.damaged[k] ? ["Lost", count(sets.lost[k]), "", `${count(sets.damaged[k])} damaged`] : null,
    sets.reason[k] ? ["State", sets.state[k], "", sets.reason[k]] : null,
  ]);
}

/**
 * @param {RecordingState} state
 * @param {Samples} found
 */
function readingsFigure(state, found) {
  const { columns } = found;
  const names = Object.keys(columns).filter((name) => !NO_CHANNEL.has(name) && typeof columns[name][0] === "number");
  let channel = names.includes(state.channel)
    ? state.channel
    : (names.find((name) => name.startsWith("gyro_")) ?? names[0]);
  const n = columns.t_s?.length ?? columns[channel].length;
  const t = columns.t_s ? columns.t_s.map((value) => value - columns.t_s[0]) : Array.from({ length: n }, (_, k) => k);
  const mean = () => columns[channel].reduce((sum, value) => sum + value, 0) / n;
  const bad = () => (columns.valid ?? []).map((valid, k) => (valid ? -1 : k)).filter((k) => k >= 0);
  const draw = () => ({
    data: [
      {
        type: "scatter",
        mode: n < 400 ? "lines+markers" : "lines",
        name: channelName(channel),
        x: t,
        y: columns[channel],
        line: { color: colour("accent"), width: 0.8 },
        marker: { size: 4 },
        hovertemplate: `%{y:.6~g} ${channelUnit(channel, state.output)}<br>after %{x:.4~f} s<extra></extra>`,
      },
      {
        type: "scatter",
        mode: "lines",
        name: "mean",
        x: [t[0], t[n - 1]],
        y: [mean(), mean()],
        line: { color: colour("text"), width: 1.5, dash: "dash" },
        hovertemplate: `mean %{y:.6~g} ${channelUnit(channel, state.output)}<extra></extra>`,
      },
      {
        type: "scatter",
        mode: "markers",
        name: "marked as bad",
        x: bad().map((k) => t[k]),
        y: bad().map((k) => columns[channel][k]),
        marker: { color: colour("bad"), size: 7, symbol: "x" },
      },
    ].filter((trace) => trace.x.length),
    layout: {
      showlegend: false,
      xaxis: { title: { text: columns.t_s ? "time since its first reading, s" : "reading" } },
      yaxis: { title: { text: channelTitle(channel, channelUnit(channel, state.output)) } },
      margin: { l: 70, r: 12, t: 8, b: 46 },
    },
  });
  const shown = Object.keys(columns).filter((name) => name !== "dataset");
  const csv = () => [shown, ...Array.from({ length: n }, (_, k) => shown.map((name) => columns[name][k]))];
  const picture = figure(
    `Recording ${state.id} data set ${state.dataset}`,
    found.readings > n
      ? `The first ${count(n)} of ${count(found.readings)} readings. Dashed: mean of these readings.`
      : `All ${count(n)} readings. Dashed: mean of these readings.`,
    draw,
    { height: "18rem", csv },
  );
  return [
    h(
      "div",
      { class: "row" },
      selectField(
        "Channel of its readings",
        names.map((name) => option(name, channelName(name))),
        channel,
        (value) => {
          channel = value;
          picture.redraw();
        },
      ),
    ),
    picture,
    h(
      "details",
      {},
      h("summary", {}, `The first ${Math.min(TABLE_ROWS, n)} readings as numbers`),
      table(
        shown.map((name) => ({
          title: channelUnit(name, state.output)
            ? channelTitle(name, channelUnit(name, state.output))
            : channelName(name),
          number: typeof columns[name][0] === "number",
          cell: (k) =>
            typeof columns[name][k] === "number" ? plainNumber(columns[name][k], 8) : String(columns[name][k]),
        })),
        Array.from({ length: Math.min(TABLE_ROWS, n) }, (_, k) => k),
        { label: "Readings" },
      ),
    ),
  ];
}
