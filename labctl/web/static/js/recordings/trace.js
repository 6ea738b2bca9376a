// One channel over time. The service sends at most as many columns as the plot can show.

import { get } from "../core/api.js";
import { setChildren, h } from "../core/elements.js";
import { colour, figure } from "../core/figure.js";
import { count, duration, number } from "../core/format.js";
import { busyIndicator, selectField, cardWithHeader, notice } from "../core/components.js";
import { updateQuery } from "../core/router.js";
import { channelName, channelTitle } from "./channels.js";

const COLUMNS = 1200;
const SETTLE_MS = 200;
const UNITS = [
  [7200, "h", 3600],
  [600, "min", 60],
  [0, "s", 1],
];

/** The trace of a recording. `state` has {id, channel, from, until, dataset, sets}; a change is written to the address. */
export function trace(state, signal) {
  let found = null;
  let asked = new AbortController();
  let waiting = null;
  const readingCount = h("p", { class: "muted small", "aria-live": "polite" });
  const place = h("div", { style: "min-height: 24rem" }, busyIndicator("Reading"));
  const picture = figure(
    `Recording ${state.id} trace`,
    "Band: from the least to the greatest reading of a column; line: their mean. Drag across to look closer, press a data set to open its readings.",
    draw,
    {
      height: "21rem",
      csv: () => [
        ["t_s", `min_${state.channel}`, `max_${state.channel}`, `mean_${state.channel}`, "n"],
        ...found.t_s.map((t, k) => [t, found.min[k], found.max[k], found.mean[k], found.n[k]]),
      ],
    },
  );
  const channels = h("div", {});

  function draw() {
    if (!found) return { data: [], layout: {} };
    const [low, high] = [state.from ?? found.from_s, state.until ?? found.until_s];
    const [, unit, seconds] = UNITS.find(([from]) => high - low >= from);
    picture.seconds = seconds;
    const t = found.t_s.map((value) => value / seconds);
    const pieces = continuousPieces(found.t_s, (high - low) / COLUMNS);
    const line = colour("accent");
    const name = channelTitle(state.channel, found.unit);
    const few = found.n.every((n) => n === 1) && t.length < 800;
    const tips = found.t_s.map((_, k) =>
      found.n[k] === 1
        ? "1 reading"
        : `${number(found.min[k], 5)} to ${number(found.max[k], 5)}, ${count(found.n[k])} readings`,
    );
    const set = state.sets.number.indexOf(state.dataset);
    return {
      data: [
        {
          type: "scatter",
          mode: "lines",
          name: "least to greatest",
          fill: "toself",
          fillcolor: `color-mix(in srgb, ${line} 28%, transparent)`,
          line: { width: 0 },
          hoverinfo: "skip",
          ...envelopeOutline(t, found, pieces),
        },
        {
          type: "scatter",
          mode: few ? "lines+markers" : "lines",
          name: "mean",
          line: { color: line, width: 1.3 },
          marker: { size: 4 },
          ...meanLine(t, found.mean, tips, pieces),
          hovertemplate: `%{y:.6~g} ${found.unit}<br>at %{x:.6~f} ${unit}<br>%{text}<extra></extra>`,
        },
      ],
      layout: {
        labctlConfig: { showTips: false },
        showlegend: false,
        xaxis: { title: { text: `time, ${unit}` }, range: [low / seconds, high / seconds] },
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
                  x0: state.sets.t_from_s[set] / seconds,
                  x1: state.sets.t_until_s[set] / seconds,
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

  async function load() {
    asked.abort();
    asked = new AbortController();
    try {
      found = await get(`/api/recordings/${state.id}/trace`, {
        query: { channel: state.channel, from_s: state.from, until_s: state.until, points: COLUMNS },
        signal: AbortSignal.any([signal, asked.signal]),
      });
    } catch (error) {
      if (error.name !== "AbortError") setChildren(place, notice("", error.message));
      return;
    }
    if (!picture.isConnected) setChildren(place, picture);
    setChildren(
      channels,
      selectField(
        "Channel",
        found.channels.map((name) => [name, channelName(name)]),
        state.channel,
        (value) => show({ channel: value }),
      ),
    );
    const shown = found.n.reduce((sum, n) => sum + n, 0);
    setChildren(
      readingCount,
      `${count(shown)} readings${found.raw ? "" : ", from envelopes of each data set"}; ${duration((state.until ?? found.until_s) - (state.from ?? found.from_s))} shown.`,
    );
    picture.redraw();
  }

  /** Show another channel or window: {channel, from, until}; null is all. */
  function show(change) {
    Object.assign(state, change);
    updateQuery({ channel: state.channel, from: rounded(state.from), until: rounded(state.until) });
    return load();
  }

  const window_ = () => [state.from ?? found.from_s, state.until ?? found.until_s];
  /** Pan or zoom by shares of the window. */
  const move = (left, right) => {
    if (!found) return;
    const [low, high] = window_();
    const wide = high - low;
    show({ from: low + left * wide, until: high + right * wide });
  };
  picture.ondrawn = (plot) => {
    plot.on("plotly_relayout", (event) => {
      clearTimeout(waiting);
      const [low, high] = event["xaxis.range"] ?? [event["xaxis.range[0]"], event["xaxis.range[1]"]];
      const seconds = picture.seconds;
      if (event["xaxis.autorange"]) waiting = setTimeout(() => show({ from: null, until: null }), SETTLE_MS);
      else if (Number.isFinite(low))
        waiting = setTimeout(() => show({ from: low * seconds, until: high * seconds }), SETTLE_MS);
    });
    plot.on("plotly_click", (event) => {
      const t = event.points[0].x * picture.seconds;
      const k = state.sets.number.findIndex(
        (_, each) => state.sets.t_from_s[each] <= t && t <= state.sets.t_until_s[each],
      );
      if (k >= 0) state.pick(state.sets.number[k]);
    });
  };
  const tool = (text, label, act) =>
    h("button", { type: "button", class: "button tiny", "aria-label": label, title: label, onclick: act }, text);
  const tools = h(
    "div",
    { class: "row tight", role: "group", "aria-label": "Window" },
    tool("◀", "Earlier", () => move(-0.5, -0.5)),
    tool("▶", "Later", () => move(0.5, 0.5)),
    tool("+", "Look closer", () => move(0.25, -0.25)),
    tool("−", "Look wider", () => move(-0.5, 0.5)),
    tool("All", "The whole recording", () => show({ from: null, until: null })),
  );
  load();
  const element = cardWithHeader(
    "Trace",
    h("div", { class: "row", style: "align-items: end" }, channels, tools),
    place,
    readingCount,
  );
  return Object.assign(element, { show, redraw: () => picture.redraw() });
}

const rounded = (value) => (Number.isFinite(value) ? Number(value.toFixed(3)) : null);

/** Continuous pieces of the bins: [first, last] of each; a gap is longer than three columns. */
function continuousPieces(t, column) {
  const steps = t
    .slice(1)
    .map((value, k) => value - t[k])
    .sort((a, b) => a - b);
  const gap = 3 * Math.max(column, steps[Math.floor(steps.length / 2)] ?? 0);
  const pieces = [];
  t.forEach((value, k) => {
    const last = pieces.at(-1);
    if (last && value - t[last[1]] <= gap) last[1] = k;
    else pieces.push([k, k]);
  });
  return pieces;
}

function meanLine(t, values, texts, pieces) {
  const [x, y, text] = [[], [], []];
  for (const [from, to] of pieces) {
    x.push(...t.slice(from, to + 1), null);
    y.push(...values.slice(from, to + 1), null);
    text.push(...texts.slice(from, to + 1), null);
  }
  return { x, y, text };
}

/** Outline of each piece: forward along the maximum, back along the minimum. */
function envelopeOutline(t, found, pieces) {
  const [x, y] = [[], []];
  for (const [from, to] of pieces) {
    x.push(...t.slice(from, to + 1), ...t.slice(from, to + 1).reverse(), t[from], null);
    y.push(...found.max.slice(from, to + 1), ...found.min.slice(from, to + 1).reverse(), found.max[from], null);
  }
  return { x, y };
}
