// One channel over time. The service sends at most as many columns as the plot can show.

import { get } from "../core/http/api.js";
import { isAbort, messageOf } from "../core/http/errors.js";
import { timeUnit } from "../core/time_unit.js";
import { continuousPieces, envelopeOutline, meanLine } from "./trace_pieces.js";
import { setChildren, h } from "../core/elements.js";
import { faded } from "../core/colour_scales.js";
import { colour, figure } from "../core/figure.js";
import { count, duration, isNumber, number } from "../core/format.js";
import { busyIndicator, button, cardWithHeader, notice } from "../core/components.js";
import { pointPlace, pythonValue, selectPoints } from "../core/figure_point.js";
import { option, selectField } from "../core/fields.js";
import { updateQuery } from "../core/router.js";
import { channelName, channelTitle } from "./channels.js";

/** @import { Trace } from "../../../types/api.js" */
/** @import { Picture, RecordingState } from "../../../types/pages.js" */
/** @import { Asked } from "../core/figure_point.js" */

const COLUMNS = 1200;
const SETTLE_MS = 200;
const HOURS_FROM_S = 7200;

/**
 * Request a channel in a window, s; null: to its end.
 * @param {Pick<RecordingState, "id" | "channel" | "from" | "until">} window
 * @param {AbortSignal} signal
 */
export const askTrace = ({ id, channel, from, until }, signal) =>
  get("/api/recordings/{recording}/trace", {
    path: { recording: id },
    query: { channel, from_s: from, until_s: until, points: COLUMNS },
    signal,
  });

/**
 * The trace of a recording. `state` has {id, channel, from, until, dataset, sets}; a change is written to the address.
 * @param {RecordingState} state
 * @param {Promise<Trace> | null} first the trace that is shown first, where it is requested already
 * @param {AbortSignal} signal
 */
export function trace(state, first, signal) {
  /** @type {Trace | null} */
  let found = null;
  /** How many seconds a unit of the time axis has. */
  let seconds = 1;
  let asked = new AbortController();
  /** @type {ReturnType<typeof setTimeout> | undefined} */
  let waiting;
  const readingCount = h("p", { class: "muted small", "aria-live": "polite" });
  const place = h("div", { style: "min-height: 24rem" }, busyIndicator("Reading"));
  const picture = figure(
    `Recording ${state.id} trace`,
    "Band: from the smallest to the largest reading in each bin of time; line: the mean of the bin. Drag across the plot to zoom in; click a point to see the readings it is made of.",
    draw,
    {
      height: "21rem",
      csv: () => (found ? traceCsv(found) : []),
    },
  );
  const channels = h("div", {});
  const points = pointPlace();

  /** @param {Trace} answer */
  const windowOf = (answer) => [state.from ?? answer.from_s ?? 0, state.until ?? answer.until_s ?? 0];

  /** @returns {Picture} */
  function draw() {
    if (!found) return { data: [], layout: {} };
    const answer = found;
    const [low, high] = windowOf(answer);
    const unit = timeUnit(high - low, HOURS_FROM_S);
    seconds = unit.seconds;
    const t = answer.t_s.map((value) => value / seconds);
    const pieces = continuousPieces(answer.t_s, (high - low) / COLUMNS);
    const line = colour("accent");
    const name = channelTitle(state.channel, answer.unit);
    const few = answer.n.every((n) => n === 1) && t.length < 800;
    const tips = answer.t_s.map((_, k) =>
      answer.n[k] === 1
        ? "1 reading"
        : `${number(answer.min[k], 5)} to ${number(answer.max[k], 5)}, ${count(answer.n[k])} readings`,
    );
    const set = state.dataset === null ? -1 : state.sets.number.indexOf(state.dataset);
    return {
      data: [
        {
          type: "scatter",
          mode: "lines",
          name: "minimum to maximum",
          fill: "toself",
          fillcolor: faded(line, 0.28),
          line: { width: 0 },
          hoverinfo: "skip",
          ...envelopeOutline(t, answer, pieces),
        },
        {
          type: "scatter",
          mode: few ? "lines+markers" : "lines",
          name: "mean",
          line: { color: line, width: 1.3 },
          marker: { size: 4 },
          ...meanLine(t, answer.mean, tips, pieces),
          hovertemplate: `%{y:.6~g} ${answer.unit}<br>at %{x:.6~f} ${unit.name}<br>%{text}<extra></extra>`,
        },
      ],
      layout: {
        showlegend: false,
        xaxis: { title: { text: `time, ${unit.name}` }, range: [low / seconds, high / seconds] },
        yaxis: { title: { text: name }, fixedrange: true },
        margin: { l: 64, r: 12, t: 8, b: 46 },
        shapes:
          set < 0
            ? []
            : [
                {
                  type: "rect",
                  xref: "x",
                  yref: "paper",
                  x0: (state.sets.t_from_s[set] ?? NaN) / seconds,
                  x1: (state.sets.t_until_s[set] ?? NaN) / seconds,
                  y0: 0,
                  y1: 1,
                  line: { width: 1, color: colour("warn") },
                  fillcolor: colour("warn"),
                  opacity: 0.22,
                },
              ],
      },
    };
  }

  /** @param {Promise<Trace> | null} [requested] */
  async function load(requested) {
    asked.abort();
    asked = new AbortController();
    const own = AbortSignal.any([signal, asked.signal]);
    try {
      const answer = await (requested ?? askTrace(state, own));
      if (own.aborted) return;
      found = answer;
    } catch (error) {
      if (!isAbort(error)) setChildren(place, notice("", messageOf(error)));
      return;
    }
    if (!picture.isConnected) setChildren(place, picture);
    setChildren(
      channels,
      selectField(
        "Channel",
        found.channels.map((name) => option(name, channelName(name))),
        state.channel,
        (value) => show({ channel: value }),
      ),
    );
    const [from, until] = windowOf(found);
    const shown = found.n.reduce((sum, n) => sum + n, 0);
    setChildren(
      readingCount,
      `${count(shown)} readings${found.raw ? "" : ", from envelopes of each data set"}; ${duration(until - from)} shown.`,
    );
    picture.redraw();
    const answer = found;
    points.open((key) => {
      const k = answer.t_s.findIndex((t_s) => `trace_${t_s}` === key);
      return k < 0 ? null : binPoint(answer, k);
    });
  }

  /**
   * Show another channel or window: {channel, from, until}; null is all.
   * @param {Partial<Pick<RecordingState, "channel" | "from" | "until">>} change
   */
  function show(change) {
    Object.assign(state, change);
    [state.from, state.until] = [rounded(state.from), rounded(state.until)]; // a link has the same bins
    points.close();
    updateQuery({ channel: state.channel, from: state.from, until: state.until });
    return load();
  }

  /**
   * Pan or zoom by shares of the window.
   * @param {number} left
   * @param {number} right
   */
  const move = (left, right) => {
    if (!found) return;
    const [low, high] = windowOf(found);
    const wide = high - low;
    show({ from: low + left * wide, until: high + right * wide });
  };
  picture.ondrawn = (plot) => {
    plot.on("plotly_relayout", (event) => {
      clearTimeout(waiting);
      const range = event["xaxis.range"];
      const [low, high] = Array.isArray(range) ? range : [event["xaxis.range[0]"], event["xaxis.range[1]"]];
      if (event["xaxis.autorange"]) waiting = setTimeout(() => show({ from: null, until: null }), SETTLE_MS);
      else if (isNumber(low) && isNumber(high))
        waiting = setTimeout(() => show({ from: low * seconds, until: high * seconds }), SETTLE_MS);
    });
  };
  selectPoints(picture, points, (series, k) => {
    const x = picture.plot.data?.[series].x?.[k]; // the drawn line has gaps, the bins have none
    const bin = series === 1 && typeof x === "number" ? (found?.t_s.findIndex((t) => t / seconds === x) ?? -1) : -1;
    return found && bin >= 0 ? binPoint(found, bin) : null;
  });

  /**
   * The bin of the trace at a point of the drawn line.
   * @param {Trace} answer
   * @param {number} k
   * @returns {Asked}
   */
  function binPoint(answer, k) {
    const t_s = answer.t_s[k];
    const window = { from_s: state.from, until_s: state.until, points: COLUMNS };
    const words = Object.entries(window).map(([name, value]) => `${name}=${pythonValue(value)}`);
    return {
      key: `trace_${t_s}`,
      name: `${channelName(answer.channel)} at ${number(t_s, 6)} s`,
      read: () =>
        get("/api/recordings/{recording}/trace/point", {
          path: { recording: state.id },
          query: { channel: answer.channel, t_s, ...window },
        }),
      call: `client.trace_point(${state.id}, ${pythonValue(answer.channel)}, t_s=${t_s}, ${words.join(", ")})`,
      links: ({ datasets: [first] }) =>
        first ? button(`Open data set ${first}`, () => state.pick(first), { kind: "tiny" }) : null,
    };
  }
  /**
   * @param {string} text
   * @param {string} label
   * @param {() => unknown} act
   */
  const tool = (text, label, act) =>
    h("button", { type: "button", class: "button tiny", "aria-label": label, title: label, onclick: act }, text);
  const tools = h(
    "div",
    { class: "row tight", role: "group", "aria-label": "Window" },
    tool("◀", "Earlier", () => move(-0.5, -0.5)),
    tool("▶", "Later", () => move(0.5, 0.5)),
    tool("+", "Zoom in", () => move(0.25, -0.25)),
    tool("−", "Zoom out", () => move(-0.5, 0.5)),
    tool("All", "The whole recording", () => show({ from: null, until: null })),
  );
  load(first);
  const element = cardWithHeader(
    "Trace",
    h("div", { class: "row", style: "align-items: end" }, channels, tools),
    place,
    points.element,
    readingCount,
  );
  return Object.assign(element, { show, redraw: () => picture.redraw() });
}

/** @param {number | null} value */
const rounded = (value) => (isNumber(value) ? Number(value.toFixed(3)) : null);

/** @param {Trace} trace */
const traceCsv = ({ channel, t_s, min, max, mean, n }) => [
  ["t_s", `min_${channel}`, `max_${channel}`, `mean_${channel}`, "n"],
  ...t_s.map((t, k) => [t, min[k], max[k], mean[k], n[k]]),
];
