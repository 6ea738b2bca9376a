// See where it fails: the map, the residual against each channel, and the data sets of what is picked, all linked.

import { fill, h } from "../core/elements.js";
import { axisColour, colour, figure } from "../core/figure.js";
import { number } from "../core/format.js";
import { choice, headed, table } from "../core/components.js";
import { query, remember } from "../core/router.js";
import { map, rowsFor, scaleOf, setsUnder } from "./residual_map.js";
import { channelName, channelTitle, scaled } from "./dataset_rows.js";

const FIRST = ["table_rate_dps", "temperature_c", "t_s"];
const LISTED = 12;

export function fails(state) {
  const rows = () => rowsFor(state);
  const picture = map("Residual over floor", "Each cell is the mean residual of its data sets over the noise floor. Faded cells are within two floors of zero: by themselves they mean nothing. Drag over cells to pick them, press one to pick it.",
    () => ({ rows: rows(), limit: scaleOf(rows()), pick: state.pick }));
  picks(picture, setsUnder, state);

  const channels = Object.keys(rows().channels);
  const shown = (query().channels?.split(",") ?? FIRST).filter((name) => channels.includes(name));
  while (shown.length < Math.min(3, channels.length)) shown.push(channels.find((name) => !shown.includes(name)));
  const against = shown.map((name, k) => {
    const drawn = scatter(state, () => shown[k]);
    const select = choice("Residual against", channels.map((each) => [each, channelName(each)]), name, (value) => {
      shown[k] = value;
      remember({ channels: shown.join(",") });
      drawn.update();
    });
    return h("div", { class: "stack" }, select, drawn);
  });

  const list = h("div", { class: "stack", "aria-live": "polite" });
  const listed = () => fill(list, pickedSets(state));
  listed();
  state.onchange((what) => {
    if (what !== "overlay") {
      listed();
      picture.redraw();
    }
  });
  return headed("See where it fails", h("span", { class: "soft small" }, "a pick in one picture shows in all"),
    picture, h("div", { class: "columns", style: "--least: 19rem" }, against), list);
}

/** Listen for picks of a picture from when it is first drawn. */
function picks(element, setsOf, state) {
  element.ondrawn = (plot) => {
    // drawing again ends a selection once more, with nothing in it
    plot.on("plotly_selected", (event) => event?.points?.length && state.choose(setsOf(event)));
    plot.on("plotly_click", (event) => state.choose(setsOf(event)));
    plot.on("plotly_deselect", () => state.choose([]));
  };
}

function scatter(state, channel) {
  const draw = () => {
    const rows = rowsFor(state);
    const x = scaled(channel(), rows.channels[channel()]);
    const picked = state.pick.size ? rows.dataset.flatMap((set, k) => (state.pick.has(set) ? [k] : [])) : null;
    const data = [{
      type: "scatter", mode: "markers", name: "residual", x, y: rows.residual, customdata: rows.dataset, selectedpoints: picked,
      marker: { size: 6, color: axisColour(state.axis), opacity: 0.75 }, selected: { marker: { opacity: 1, size: 8 } }, unselected: { marker: { opacity: 0.15 } },
      text: rows.dataset.map((set, k) => `data set ${set}: ${number(rows.score[k], 2)} floors`), hovertemplate: "%{text}<br>%{x:.5g}: %{y:.3g} deg/s<extra></extra>",
    }];
    if (state.overlay) {
      data.push({ type: "scatter", mode: "markers", name: "explained", x, y: state.overlay.values, customdata: rows.dataset, marker: { size: 5, symbol: "diamond", color: colour("ink") }, hovertemplate: "%{y:.3g} deg/s<extra></extra>" });
    }
    return { data, layout: { dragmode: "select", xaxis: { title: { text: channelTitle(channel()) } }, yaxis: { title: { text: "residual, deg/s" } }, showlegend: Boolean(state.overlay), margin: { l: 62, r: 8, t: state.overlay ? 34 : 8, b: 44 } } };
  };
  const element = figure("Residual against a channel", null, draw, { tall: "16rem" });
  picks(element, (event) => (event.points ?? []).map((point) => point.customdata), state);
  state.onchange(() => element.redraw());
  return element;
}

function pickedSets(state) {
  const rows = rowsFor(state);
  if (!state.pick.size) return h("p", { class: "soft small" }, "Nothing is picked.");
  const chosen = rows.dataset.map((_, k) => k).filter((k) => state.pick.has(rows.dataset[k])).sort((a, b) => Math.abs(rows.score[b]) - Math.abs(rows.score[a]));
  const rms = Math.sqrt(chosen.reduce((sum, k) => sum + rows.residual[k] ** 2, 0) / Math.max(chosen.length, 1));
  return [
    h("div", { class: "row spread" },
      h("p", {}, h("strong", {}, `${chosen.length} data sets picked`), `: RMS ${number(rms)} deg/s${chosen.length > LISTED ? `; the ${LISTED} furthest off are listed` : ""}.`),
      h("button", { class: "button tiny", type: "button", onclick: () => state.choose([]) }, "Let go")),
    table([
      { title: "Data set", cell: (k) => h("a", { href: `/recordings/${state.recording}?dataset=${rows.dataset[k]}` }, `${rows.dataset[k]}`) },
      { title: "Table rate, deg/s", number: true, cell: (k) => number(rows.channels.table_rate_dps[k], 4) },
      { title: "Temperature, deg C", number: true, cell: (k) => number(rows.channels.temperature_c[k], 4) },
      { title: "Up", cell: (k) => rows.position[k] },
      { title: "Residual, deg/s", number: true, cell: (k) => number(rows.residual[k]) },
      { title: "Over floor", number: true, cell: (k) => number(rows.score[k], 2) },
    ], chosen.slice(0, LISTED), { dense: true, label: "Picked data sets" }),
  ];
}
