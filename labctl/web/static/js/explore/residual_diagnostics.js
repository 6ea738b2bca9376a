// Residual diagnostics: the residual map, the residual against channels, and the selected data sets, all linked.

import { setChildren, h } from "../core/elements.js";
import { axisColour, colour, figure } from "../core/figure.js";
import { isNumber, number } from "../core/format.js";
import { reachByKeyboard } from "../core/keyboard_points.js";
import { cardWithHeader, table } from "../core/components.js";
import { option, selectField } from "../core/fields.js";
import { query, updateQuery } from "../core/router.js";
import { recordingMarks } from "../core/recording_marks.js";
import { residualText } from "./chosen_recordings.js";
import { oneFloorText } from "./noise_floor.js";
import { residualCell } from "./notebook_cell.js";
import { pointCard } from "./point_card.js";
import { cellsText, hasMap, mapsOf, SCALE_TEXT } from "./residual_cells.js";
import { residualMap, selectedRows, datasetsUnder } from "./residual_map.js";
import { channelName, channelTitle, scaled, setText, shownText } from "./dataset_rows.js";

/** @import { Figure, PlotEvent, PlotTrace } from "../../../types/pages.js" */
/** @import { Place } from "../core/keyboard_points.js" */
/** @import { ExploreState } from "./state.js" */

/** What there is of these is drawn at first: time where it is known, else the order of the data sets. */
const DEFAULT_CHANNELS = ["table_rate_dps", "temperature_c", "t_s", "order"];
const MAX_LISTED = 12;

/** @param {ExploreState} state */
export function residualDiagnostics(state) {
  const rows = () => selectedRows(state);
  const picture = !hasMap(state)
    ? null
    : residualMap(
        "Residual over floor",
        `Each measured cell shows the mean residual of its data sets divided by the noise floor. ${cellsText(state.criticism)}${oneFloorText(state.criticism.error)} Faded cells are less than two noise floors from zero; a single faded cell is not significant. ${SCALE_TEXT} Drag over cells to select them, or click one cell.`,
        () => ({
          maps: mapsOf(state.criticism, state.axis),
          pick: state.pick,
        }),
        { onselect: (sets, beside) => state.select(beside ? [...state.pick, ...sets] : sets) },
      );
  if (picture) bindSelection(picture, datasetsUnder, state);

  const channels = Object.entries(rows().channels).flatMap(([name, values]) => (varies(values) ? [name] : []));
  const shown = (query().channels?.split(",") ?? DEFAULT_CHANNELS).filter((name) => channels.includes(name));
  shown.push(...channels.filter((name) => !shown.includes(name)).slice(0, Math.max(3 - shown.length, 0)));
  const against = shown.map((name, k) => {
    const drawn = residualScatter(state, () => shown[k], `residual-against-${k + 1}`);
    const select = selectField(
      "Residual against",
      channels.map((each) => option(each, channelName(each))),
      name,
      (value) => {
        shown[k] = value;
        updateQuery({ channels: shown.join(",") });
        drawn.update();
      },
    );
    return h("div", { class: "stack" }, select, drawn);
  });

  const list = h("div", { class: "stack", "aria-live": "polite" });
  const point = h("div", {});
  const listed = () => {
    setChildren(list, pickedDatasets(state));
    setChildren(point, pickedPoint(state));
  };
  listed();
  state.onchange((what) => {
    if (what !== "overlay") {
      picture?.redraw(); // first: it outlines what was selected in the next frame
      listed();
    }
  });
  return cardWithHeader(
    "Where the model fails",
    h("span", { class: "muted small" }, "data sets selected in one picture are marked in all pictures"),
    h("p", { class: "muted small" }, `${residualText(state)}${piecesText(state)}`),
    picture,
    h("div", { class: "columns", style: "--column-min: 19rem" }, against),
    list,
    point,
  );
}

/**
 * What a dot is, where it is no data set.
 * @param {ExploreState} state
 */
function piecesText(state) {
  const { pieces, n } = selectedRows(state);
  return pieces ? ` Each dot is the mean of one of ${n} pieces of the recording's one data set.` : "";
}

/**
 * Whether a channel shows anything: at rest the rate is the same everywhere.
 * @param {readonly (number | null)[]} values
 */
const varies = (values) => new Set(values).size > 1;

/**
 * Connect the selection of a figure to the state once it is drawn.
 * @param {Figure} element
 * @param {(event: PlotEvent) => number[]} setsOf
 * @param {ExploreState} state
 */
function bindSelection(element, setsOf, state) {
  element.ondrawn = (plot) => {
    // a redraw ends the selection once more with no points in it
    plot.on("plotly_selected", (event) => event?.points?.length && state.select(setsOf(event)));
    plot.on("plotly_click", (event) => state.select(setsOf(event)));
    plot.on("plotly_deselect", () => state.select([]));
  };
}

/**
 * @param {ExploreState} state
 * @param {() => string} channel
 * @param {string} slug
 */
function residualScatter(state, channel, slug) {
  /** @type {(Place & { index: number }) | null} */
  let cursor = null;
  const draw = () => {
    const rows = selectedRows(state);
    const x = scaled(channel(), rows.channels[channel()]);
    const marks = recordingMarks(rows.recording, axisColour(state.axis));
    const picked = state.pick.size ? rows.dataset.flatMap((set, k) => (state.pick.has(set) ? [k] : [])) : null;
    /** @type {PlotTrace[]} */
    const data = [
      {
        type: "scatter",
        mode: "markers",
        name: "residual",
        x,
        y: rows.residual,
        customdata: rows.dataset,
        selectedpoints: picked,
        marker: { size: 6, color: axisColour(state.axis), opacity: 0.75, ...marks.marker },
        showlegend: false,
        selected: { marker: { opacity: 1, size: 8 } },
        unselected: { marker: { opacity: 0.15 } },
        text: rows.dataset.map((_, k) => `${setText(rows, k)}: ${number(rows.score[k], 2)} times the noise floor`),
        hovertemplate: "%{text}<br>%{x:.5g}: %{y:.3g} deg/s<extra></extra>",
      },
    ];
    if (state.overlay) {
      data.push({
        type: "scatter",
        mode: "markers",
        name: "explained",
        x,
        y: state.overlay.values,
        customdata: rows.dataset,
        marker: { size: 5, symbol: "diamond", color: colour("text") },
        hovertemplate: "%{y:.3g} deg/s<extra></extra>",
      });
    }
    data.push(...marks.legend);
    if (cursor) data.push(cursorTrace(x[cursor.index], rows.residual[cursor.index]));
    const shown = shownText(state.criticism);
    const annotations = shown
      ? [
          {
            text: shown,
            showarrow: false,
            xref: "paper",
            yref: "paper",
            x: 1,
            y: 1,
            xanchor: "right",
            yanchor: "bottom",
            font: { size: 11 },
          },
        ]
      : [];
    return {
      data,
      layout: {
        annotations,
        dragmode: "select",
        xaxis: { title: { text: channelTitle(channel()) } },
        yaxis: { title: { text: "residual of<br>the fitted model, deg/s" } },
        showlegend: Boolean(state.overlay) || marks.legend.length > 0,
        margin: { l: 76, r: 8, t: state.overlay || marks.legend.length ? 34 : shown ? 20 : 8, b: 44 },
      },
    };
  };
  const element = figure("Residual against a channel", null, draw, {
    height: "16rem",
    slug,
    cell: () => residualCell(state, channel(), location.origin),
  });
  bindSelection(element, (event) => (event.points ?? []).map((point) => point.customdata), state);
  reachByKeyboard(element, {
    places: () => pointPlaces(state, channel()),
    onmove: (place) => {
      cursor = place;
      element.redraw();
    },
    onselect: (sets, beside) => state.select(beside ? [...state.pick, ...sets] : sets),
  });
  state.onchange(() => element.redraw());
  return element;
}

/**
 * The data sets of a figure over a channel for the keyboard, from left to right.
 * @param {ExploreState} state
 * @param {string} channel
 * @returns {(Place & { index: number })[]}
 */
function pointPlaces(state, channel) {
  const rows = selectedRows(state);
  const x = scaled(channel, rows.channels[channel]);
  const order = rows.dataset
    .map((_, k) => k)
    .filter((k) => isNumber(x[k]) && isNumber(rows.residual[k]))
    .sort((a, b) => Number(x[a]) - Number(x[b]));
  return order.map((k, column) => ({
    panel: 0,
    column,
    row: 0,
    index: k,
    sets: [rows.dataset[k]],
    text: `${setText(rows, k)}: ${channelTitle(channel)} ${number(x[k], 5)}, residual ${number(rows.residual[k])} deg/s, ${number(rows.score[k], 2)} times the noise floor`,
  }));
}

/**
 * The mark of the point that the keyboard is at.
 * @param {number | null} x
 * @param {number | null} y
 * @returns {PlotTrace}
 */
const cursorTrace = (x, y) => ({
  type: "scatter",
  mode: "markers",
  name: "keyboard",
  x: [x],
  y: [y],
  hoverinfo: "skip",
  showlegend: false,
  marker: { size: 14, symbol: "circle-open", color: colour("accent"), line: { width: 3 } },
});

/**
 * The one data set that is selected, with its readings; null for none or several, and for pieces of a data set.
 * @param {ExploreState} state
 */
function pickedPoint(state) {
  const rows = selectedRows(state);
  const chosen = rows.dataset.flatMap((set, k) => (state.pick.has(set) ? [k] : []));
  if (chosen.length !== 1 || rows.pieces) return null;
  const [k] = chosen;
  return pointCard(state, { recording: rows.recording?.[k] ?? state.recording, dataset: rows.own[k] });
}

/** @param {ExploreState} state */
function pickedDatasets(state) {
  const rows = selectedRows(state);
  if (!state.pick.size) return h("p", { class: "muted small" }, "No data set is selected.");
  const chosen = rows.dataset
    .map((_, k) => k)
    .filter((k) => state.pick.has(rows.dataset[k]))
    .sort((a, b) => Math.abs(rows.score[b] ?? 0) - Math.abs(rows.score[a] ?? 0));
  const rms = Math.sqrt(chosen.reduce((sum, k) => sum + (rows.residual[k] ?? 0) ** 2, 0) / Math.max(chosen.length, 1));
  return [
    h(
      "div",
      { class: "row space-between" },
      h(
        "p",
        {},
        h("strong", {}, `${chosen.length} data ${chosen.length === 1 ? "set" : "sets"} selected`),
        `: RMS ${number(rms)} deg/s${chosen.length > MAX_LISTED ? `; the ${MAX_LISTED} furthest off are listed` : ""}.`,
      ),
      h("button", { class: "button tiny", type: "button", onclick: () => state.select([]) }, "Clear selection"),
    ),
    table(
      [
        {
          title: "Data set",
          cell: (k) =>
            h(
              "a",
              { href: `/recordings/${rows.recording?.[k] ?? state.recording}?dataset=${rows.own[k]}` },
              rows.recording ? setText(rows, k) : `${rows.own[k]}`,
            ),
        },
        { title: "Table rate, deg/s", number: true, cell: (k) => number(rows.channels.table_rate_dps[k], 4) },
        { title: "Temperature, °C", number: true, cell: (k) => number(rows.channels.temperature_c[k], 4) },
        { title: "Up", cell: (k) => rows.position[k] },
        { title: "Residual, deg/s", number: true, cell: (k) => number(rows.residual[k]) },
        { title: "Over floor", number: true, cell: (k) => number(rows.score[k], 2) },
      ],
      chosen.slice(0, MAX_LISTED),
      { dense: true, label: "Selected data sets" },
    ),
  ];
}
