// The page of the channels of a campaign: any of them, over any time, while it runs and afterwards.

import { get } from "../core/http/api.js";
import { setChildren, h } from "../core/elements.js";
import { colour, figure } from "../core/figure.js";
import { cardWithHeader, pageHeader } from "../core/components.js";
import { count } from "../core/format.js";
import { option, selectField } from "../core/fields.js";
import { pointPlace, selectPoints } from "../core/figure_point.js";
import { updateQuery } from "../core/router.js";
import { timeUnit } from "../core/time_unit.js";
import { followCampaign } from "../bench/campaign_stream.js";
import { linkButton } from "../bench/actions.js";
import { stateChip } from "../campaigns/state_chip.js";
import { isRunning } from "../campaigns/states.js";
import { askedMean, channelPoint } from "../campaigns/channel_point.js";
import { allSeries, appendLive, inRange, panels } from "../campaigns/channel_series.js";

/** @import { Campaign } from "../../../types/api.js" */
/** @import { Figure, PageContext, PlotTrace } from "../../../types/pages.js" */
/** @import { Series } from "../campaigns/channel_series.js" */

const POINTS = 4000;
const REFRESH_MS = 10_000;
const REDRAW_MS = 1000;
const HOURS_FROM_S = 10_800;
const PANEL_REM = 13;
/** @type {readonly [string, string][]} */
const SPANS = [
  ["", "the whole campaign"],
  ["7200", "the last 2 h"],
  ["1800", "the last 30 min"],
  ["300", "the last 5 min"],
];
/** Colours that differ from each other; further traces differ by their dashes, and points by their symbols. */
const SHADES = ["axis-x", "axis-y", "axis-z", "text-muted"];
const DASHES = ["solid", "dash", "dot"];
const SYMBOLS = ["circle", "square", "diamond"];

/** @param {PageContext} context */
export async function page({ params, query, signal }) {
  const path = { campaign: params.id };
  let now = await get("/api/campaigns/{campaign}", { path, signal });
  /** @type {Map<string, Series>} */
  const live = new Map();
  let logged = await readLogged(now, query.last, signal);
  const chosen = new Set(query.channels ? query.channels.split(",").map(decodeURIComponent) : usual(logged));
  let last = SPANS.some(([value]) => value === query.last) ? (query.last ?? "") : "";
  const [heading, choices, place] = [h("span", {}), h("div", {}), h("div", {})];

  const all = () => [...logged, ...live.values()];
  const shown = () => {
    const until_s = Math.max(0, ...all().map((each) => each.t_s.at(-1) ?? 0));
    const from_s = last ? Math.max(0, until_s - Number(last)) : 0;
    const series = all().filter((each) => chosen.has(each.id));
    return { from_s, until_s, series: series.map((each) => inRange(each, from_s, until_s)) };
  };
  /** @type {ReturnType<typeof picture> | null} */
  let drawn = null;
  const points = pointPlace();
  /**
   * What a point is made of: a mean of the readings of its data set; other series are values as they were logged.
   * @param {readonly Series[]} series
   * @param {Figure} figure
   * @param {number} drawnSeries
   * @param {number} k
   */
  const pointAt = (series, figure, drawnSeries, k) => {
    const name = figure.plot.data?.[drawnSeries].name;
    const found = series.find((each) => each.name === name);
    return found?.means ? channelPoint(now, found.means.serial, found.means.channel, found.means.dataset[k]) : null;
  };
  function drawAnew() {
    const { series } = shown();
    drawn = series.length ? picture(shown, panels(series).length) : null;
    if (drawn) selectPoints(drawn, points, (each, k) => (drawn ? pointAt(shown().series, drawn, each, k) : null));
    setChildren(place, drawn ?? h("p", { class: "muted" }, "No channel is chosen."));
  }
  function choose() {
    updateQuery({ channels: [...chosen].map(encodeURIComponent).join(","), last: last || null });
    drawAnew();
  }
  let listed = "";
  function listChannels() {
    const ids = all().map(({ id }) => id);
    if (ids.join() === listed) return; // a box that is about to be pressed stays where it is
    listed = ids.join();
    setChildren(choices, channelBoxes(all(), chosen, choose));
  }
  /** Every channel that there is: more of them come while the campaign runs. */
  async function refresh() {
    logged = await readLogged(now, last, signal).catch(() => logged);
    listChannels();
    drawn?.redraw();
  }
  setChildren(heading, stateChip(now));
  listChannels();
  drawAnew();
  if (isRunning(now)) follow();
  points.open((key) => askedMean(now, all(), key));

  function follow() {
    let redrawn = 0;
    followCampaign(
      now.id,
      {
        progress(next) {
          const known = live.size;
          now = next;
          setChildren(heading, stateChip(now));
          appendLive(live, now);
          if (live.size > known) listChannels();
          if (Date.now() - redrawn < REDRAW_MS) return;
          redrawn = Date.now();
          drawn?.redraw();
        },
        event() {},
        link({ stale, why }) {
          setChildren(heading, stateChip(now), stale ? h("span", { class: "bad-text" }, ` no update: ${why}`) : null);
        },
      },
      signal,
    ).then(refresh);
    const timer = setInterval(() => document.hidden || !isRunning(now) || refresh(), REFRESH_MS);
    signal.addEventListener("abort", () => clearInterval(timer));
  }

  return h(
    "div",
    { class: "page", "data-source": `campaign ${now.id}, ${now.recipe} on ${now.bench}` },
    pageHeader(
      `Channels of campaign ${now.id}`,
      h("span", {}, h("strong", {}, now.recipe), ` on bench ${now.bench} `, heading),
      linkButton("To the campaign", `/campaigns/${now.id}`),
    ),
    cardWithHeader(
      "Channels",
      selectField(
        "Time",
        SPANS.map(([value, text]) => option(value, text)),
        last,
        async (value) => {
          last = value;
          choose();
          await refresh();
        },
      ),
      choices,
      place,
      points.element,
    ),
  );
}

/**
 * The series in the database: the environment of the time that is shown, and the data sets of each unit.
 * @param {Campaign} now
 * @param {string | undefined} last s before the present that are shown; empty: all
 * @param {AbortSignal} signal
 */
async function readLogged(now, last, signal) {
  const path = { campaign: String(now.id) };
  const from_s = last && now.t_s ? Math.max(0, now.t_s - Number(last)) : undefined;
  const [course, plan, ...measured] = await Promise.all([
    get("/api/campaigns/{campaign}/course", { path, query: { points: POINTS, ...(from_s ? { from_s } : {}) }, signal }),
    get("/api/campaigns/{campaign}/plan", { path, signal }),
    ...Object.entries(now.recordings).map(async ([serial, recording]) => {
      const of = { path: { recording: String(recording) }, signal };
      const [sets, about] = await Promise.all([
        get("/api/recordings/{recording}/datasets", of),
        get("/api/recordings/{recording}", { ...of, query: { points: false } }),
      ]);
      return { serial, sets: { ...sets, output: about.info.output ?? {} } };
    }),
  ]);
  return allSeries(course, plan.timeline, measured);
}

/**
 * What is chosen at first: temperatures, and the outputs of the data sets.
 * @param {readonly Series[]} series
 */
const usual = (series) =>
  series
    .map(({ id }) => id)
    .filter((id) => /^(setpoint|chamber|unit\.|rate$)/.test(id) || /^mean\..*\.gyro_[a-z]$/.test(id));

/**
 * A box for each channel.
 * @param {readonly Series[]} series
 * @param {Set<string>} chosen changed by the boxes
 * @param {() => void} changed
 */
function channelBoxes(series, chosen, changed) {
  const summary = h("summary", {});
  const state = () => {
    const number = series.filter(({ id }) => chosen.has(id)).length;
    summary.textContent = `${count(number)} of ${count(series.length)} channels are chosen`;
  };
  state();
  return h(
    "details",
    { open: true },
    summary,
    h(
      "div",
      { class: "channel-boxes" },
      series.map(({ id, name, unit }) =>
        h(
          "label",
          { class: "row small" },
          h("input", {
            type: "checkbox",
            checked: chosen.has(id),
            /** @param {Event} event */
            onchange: (event) => {
              if (/** @type {HTMLInputElement} */ (event.target).checked) chosen.add(id);
              else chosen.delete(id);
              state();
              changed();
            },
          }),
          unit ? `${name}, ${unit}` : name,
        ),
      ),
    ),
  );
}

/**
 * One panel for each unit over one axis of time.
 * @param {() => { from_s: number, until_s: number, series: readonly Series[] }} shown
 * @param {number} height panels
 */
function picture(shown, height) {
  const draw = () => {
    const { from_s, until_s, series } = shown();
    const unit = timeUnit(until_s - from_s, HOURS_FROM_S);
    const rows = panels(series);
    /** @type {Record<string, object>} */
    const axes = {};
    rows.forEach(([text], k) => {
      const top = 1 - k / rows.length;
      axes[`yaxis${k ? k + 1 : ""}`] = { title: { text }, domain: [top - 0.92 / rows.length, top] };
    });
    const before = rows.map((_, row) => rows.slice(0, row).reduce((n, [, members]) => n + members.length, 0));
    const data = rows.flatMap(([text, members], row) =>
      members.map((each, k) => trace(each, before[row] + k, text, row ? `y${row + 1}` : "y", unit.seconds)),
    );
    return {
      data,
      layout: {
        margin: { l: 70, r: 12, t: 12 + 20 * Math.ceil(data.length / 3), b: 42 },
        hovermode: "x unified",
        showlegend: true,
        xaxis: {
          title: { text: `time of the campaign, ${unit.name}` },
          range: [from_s / unit.seconds, until_s / unit.seconds],
          anchor: rows.length > 1 ? `y${rows.length}` : "y",
        },
        ...axes,
      },
    };
  };
  const live = shown().series.some(({ id }) => id.startsWith("now.")) ? "; “now” is since this page was opened" : "";
  const caption = `Temperatures as they were logged, the rate of each step, means of the data sets (points; click one to see its readings)${live}.`;
  return figure("Channels of the campaign", caption, draw, {
    height: `${Math.max(18, PANEL_REM * height)}rem`,
    csv: () => [
      ["channel", "unit", "t_s", "value"],
      ...shown().series.flatMap((each) => each.t_s.map((t, k) => [each.name, each.unit, t, each.values[k]])),
    ],
  });
}

/**
 * @param {Series} series
 * @param {number} k place in the legend: no two traces look the same
 * @param {string} unit
 * @param {string} axis
 * @param {number} seconds of a unit of the axis of time
 * @returns {PlotTrace}
 */
const trace = (series, k, unit, axis, seconds) => ({
  type: "scatter",
  mode: series.drawn === "points" ? "markers" : "lines",
  name: series.name,
  x: series.t_s.map((t) => t / seconds),
  y: series.values,
  yaxis: axis,
  marker: {
    size: 5,
    color: colour(SHADES[k % SHADES.length]),
    symbol: SYMBOLS[Math.floor(k / SHADES.length) % SYMBOLS.length],
  },
  line: {
    color: colour(SHADES[k % SHADES.length]),
    width: 1.6,
    dash: DASHES[Math.floor(k / SHADES.length) % DASHES.length],
    shape: series.drawn === "hold" ? "hv" : "linear",
  },
  hovertemplate: `%{y:.7~g} ${unit}<extra>${series.name}</extra>`,
});
