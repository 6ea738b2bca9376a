// Residual over noise floor as a map over rate and temperature: every measured cell. Cells can be selected.

import { DIVERGING } from "../core/colour_scales.js";
import { colour, figure } from "../core/figure.js";
import { datasetRows, distinctLabels } from "./dataset_rows.js";
import { reachByKeyboard } from "../core/keyboard_points.js";
import { outlinePoints } from "../core/point_outlines.js";
import { cellText, COLOUR_LIMIT, mapCells } from "./residual_cells.js";

/** @import { ResidualMap } from "../../../types/api.js" */
/** @import { PlotEvent, PlotLayout } from "../../../types/pages.js" */
/** @import { Place } from "../core/keyboard_points.js" */
/** @import { Cell } from "./residual_cells.js" */
/** @import { ExploreState } from "./state.js" */
/** @typedef {ReturnType<typeof mapCells>} Cells */
/** @typedef {Cell & { x: string | number, y: string | number, at: readonly number[] }} PlacedCell */

const DIMMED_BELOW = 2;
/** Cells that fill less than this share of their rows and columns are drawn where they are, not in a grid. */
const MIN_FILLED = 0.3;
/** A screen below this width is narrow. */
const NARROW_PX = 760;
/** Height of a panel on a narrow screen, where panels are stacked, px. */
const PANEL_PX = 210;
/** A panel has room for its title in whole from this width on; a figure for title and tool bar in one line. */
const [WHOLE_TITLE_PX, ONE_LINE_PX] = [260, 560];
/** Height of the tool bar of a figure. */
const TOOLBAR_PX = 26;

/** The squares around cells: of those that are selected, and of the one that the keyboard is at. */
const PICKED = { side_px: 13, line_px: 2.5, color: "text" };
const CURSOR = { side_px: 20, line_px: 4, color: "accent" };

/** @param {Cell} cell */
const isDim = (cell) => Math.abs(cell.mean) * Math.sqrt(cell.sets.length) < DIMMED_BELOW;
/**
 * @param {Cell} cell
 * @param {ReadonlySet<number>} pick
 */
const isPicked = ({ sets }, pick) => sets.some((set) => pick.has(set));
/**
 * @param {Cell} cell
 * @param {Place | null} cursor
 */
const isUnder = ({ sets }, cursor) => cursor?.sets[0] === sets[0];
/**
 * Cells as a grid, with a faded layer over those within the noise.
 * @param {Cells} found
 * @param {string} position
 * @param {object} shared
 */
function gridTraces({ rates, temperatures, cells }, position, shared) {
  const labels = [distinctLabels(rates), distinctLabels(temperatures)];
  /** @returns {unknown[][]} */
  const grid = () => temperatures.map(() => rates.map(() => null));
  const [z, dim, sets, texts] = [grid(), grid(), grid(), grid()];
  const placed = cells.map((cell) => {
    const [row, column] = [temperatures.indexOf(cell.temperature), rates.indexOf(cell.rate)];
    z[row][column] = cell.mean;
    sets[row][column] = cell.sets;
    texts[row][column] = cellText(cell, position);
    if (isDim(cell)) dim[row][column] = 1;
    return { ...cell, x: labels[0][column], y: labels[1][row], at: [column, row] };
  });
  const shade = colour("surface");
  const heat = { type: "heatmap", ...shared, x: labels[0], y: labels[1], xgap: 1, ygap: 1 };
  return {
    traces: [
      {
        ...heat,
        z,
        customdata: sets,
        text: texts,
        hovertemplate: "%{text}<extra></extra>",
        coloraxis: "coloraxis",
        name: `${position} up`,
      },
      {
        ...heat,
        z: dim,
        colorscale: [
          [0, shade],
          [1, shade],
        ],
        opacity: 0.6,
        showscale: false,
        hoverinfo: "skip",
        name: "within noise",
      },
    ],
    x: { type: "category", categoryorder: "array", categoryarray: labels[0] },
    y: { type: "category", categoryorder: "array", categoryarray: labels[1] },
    placed,
  };
}

/**
 * Cells that share few rates or temperatures, as squares at their own rate and temperature.
 * @param {Cells} found
 * @param {string} position
 * @param {object} shared
 */
function scatteredTraces({ cells }, position, shared) {
  return {
    traces: [
      {
        type: "scatter",
        mode: "markers",
        ...shared,
        name: `${position} up`,
        showlegend: false,
        x: cells.map((cell) => cell.rate),
        y: cells.map((cell) => cell.temperature),
        customdata: cells.map((cell) => cell.sets),
        text: cells.map((cell) => cellText(cell, position)),
        hovertemplate: "%{text}<extra></extra>",
        marker: {
          symbol: "square",
          size: 9,
          color: cells.map((cell) => cell.mean),
          coloraxis: "coloraxis",
          opacity: cells.map((cell) => (isDim(cell) ? 0.35 : 1)),
        },
      },
    ],
    x: {},
    y: {},
    placed: cells.map((cell) => ({ ...cell, x: cell.rate, y: cell.temperature, at: [cell.rate, cell.temperature] })),
  };
}

/**
 * The traces and axes of one map; `id` is "" or the number of the panel from 2 on, as in Plotly's axis names.
 * @param {ResidualMap} map
 * @param {string} id
 * @param {ReadonlySet<number>} pick
 * @param {Place | null} cursor the cell that the keyboard is at, of this panel
 */
function positionPanel(map, id, pick, cursor) {
  const found = mapCells(map);
  const shared = { xaxis: `x${id}`, yaxis: `y${id}` };
  const filled = found.cells.length >= MIN_FILLED * found.rates.length * found.temperatures.length;
  const { traces, x, y, placed } = (filled ? gridTraces : scatteredTraces)(found, map.position, shared);
  /**
   * @param {readonly PlacedCell[]} which
   * @param {{ opacity?: number, [option: string]: unknown }} marker
   * @param {string} name
   */
  const mark = (which, marker, name) => ({
    type: "scatter",
    mode: "markers",
    name,
    ...shared,
    showlegend: false,
    marker,
    x: which.map((cell) => cell.x),
    y: which.map((cell) => cell.y),
    customdata: which.map((cell) => cell.sets),
    hoverinfo: "skip",
    selected: { marker: { opacity: marker.opacity ?? 1 } },
    unselected: { marker: { opacity: marker.opacity ?? 1 } },
  });
  /** @param {typeof PICKED} square */
  const around = ({ side_px: size, line_px: width, color }) => ({
    size,
    symbol: "square-open",
    color: colour(color),
    line: { width },
  });
  const picked = placed.filter((cell) => isPicked(cell, pick));
  const under = placed.filter((cell) => isUnder(cell, cursor));
  return {
    placed,
    data: [
      ...traces,
      mark(placed, { size: 18, opacity: 0.01, symbol: "square" }, "cells"),
      mark(picked, around(PICKED), "picked"),
      mark(under, around(CURSOR), "keyboard"),
    ],
    x: { ...x, showgrid: false, title: { text: "table rate, deg/s" } },
    y: { ...y, showgrid: false, title: id === "" ? { text: "temperature, °C" } : undefined },
    text: `${map.position} up: ${map.dataset.length} data sets${found.cells.length < map.dataset.length ? ` in ${found.cells.length} cells` : ""}`,
  };
}

/**
 * The cells of all panels for the keyboard, from the coldest row of the first panel on.
 * @param {readonly ResidualMap[]} maps
 * @returns {Place[]}
 */
export function cellPlaces(maps) {
  return maps.flatMap((map, panel) => {
    const { rates, temperatures, cells } = mapCells(map);
    return cells
      .map((cell) => ({
        panel,
        column: rates.indexOf(cell.rate),
        row: temperatures.indexOf(cell.temperature),
        sets: cell.sets,
        text: cellText(cell, map.position).replaceAll("<br>", ", "),
      }))
      .sort((a, b) => a.row - b.row || a.column - b.column);
  });
}

/**
 * The map of an axis, a panel for each position. `give()` returns {maps, pick}; `onselect` gets the data sets
 * that the keyboard selects, and makes the cells reachable by it.
 * @param {string} name
 * @param {string | null} caption
 * @param {() => { maps: ResidualMap[], pick?: ReadonlySet<number> }} give
 * @param {object} [options]
 * @param {string} [options.height]
 * @param {(sets: readonly number[], beside: boolean) => unknown} [options.onselect] absent: no cell can be selected
 */
export function residualMap(name, caption, give, { onselect, height = "22rem" } = {}) {
  /** @type {Place | null} */
  let cursor = null;
  /** @type {(PlacedCell & { panel: number, axes: string })[]} */
  let drawn = [];
  const draw = () => {
    drawn = [];
    const { maps, pick = new Set() } = give();
    const several = maps.length > 1;
    const isNarrow = window.innerWidth < NARROW_PX; // there the tools stand above the figure
    const below = several && isNarrow;
    const width = element.plot.clientWidth;
    const isShort = width / (several && !below ? maps.length : 1) < WHOLE_TITLE_PX;
    /** @type {PlotLayout} */
    const layout = {
      margin: { l: 52, r: 8, t: 28 + (width < ONE_LINE_PX && !isNarrow ? TOOLBAR_PX : 0), b: 46 },
      dragmode: onselect ? "select" : false,
      coloraxis: {
        colorscale: DIVERGING,
        cmin: -COLOUR_LIMIT,
        cmax: COLOUR_LIMIT,
        colorbar: { title: { text: "residual /<br>noise floor" }, thickness: 12, outlinewidth: 0 },
      },
    };
    if (below) layout.height = maps.length * PANEL_PX;
    if (several)
      layout.grid = below
        ? { rows: maps.length, columns: 1, pattern: "independent", ygap: 0.4 }
        : { rows: 1, columns: maps.length, pattern: "independent", xgap: 0.14 };
    layout.annotations = [];
    const data = maps.flatMap((map, k) => {
      const id = k ? String(k + 1) : "";
      const { data: traces, placed, x, y, text } = positionPanel(map, id, pick, cursor?.panel === k ? cursor : null);
      drawn.push(...placed.map((cell) => ({ ...cell, panel: k, axes: id })));
      layout[`xaxis${id}`] = below && k < maps.length - 1 ? { ...x, title: undefined } : x; // one title for all panels
      layout[`yaxis${id}`] = y;
      layout.annotations.push({
        text: isShort ? `${map.position} up` : text,
        showarrow: false,
        xref: `x${id} domain`,
        yref: `y${id} domain`,
        x: 0,
        y: 1.02,
        xanchor: "left",
        yanchor: "bottom",
        font: { size: 12 },
      });
      return traces;
    });
    return { data, layout };
  };
  const element = figure(name, caption, draw, { height, csv: () => mapRows(give().maps) });
  const { redraw } = element;
  const outlines = () => {
    const { pick = new Set() } = give();
    return drawn.flatMap(({ panel, axes, at: [x, y], ...cell }) => {
      const squares = [
        isPicked(cell, pick) ? PICKED : null,
        cursor?.panel === panel && isUnder(cell, cursor) ? CURSOR : null,
      ];
      return squares.flatMap((square) => (square ? [{ ...square, color: colour(square.color), axes, x, y }] : []));
    });
  };
  if (onselect) {
    element.redraw = () => {
      if (!element.plot.data) return;
      const clear = outlinePoints(element, outlines());
      return redraw()?.then(clear);
    };
    const onmove = (/** @type {Place | null} */ place) => {
      cursor = place;
      element.redraw();
    };
    reachByKeyboard(element, { places: () => cellPlaces(give().maps), onmove, onselect });
  }
  return element;
}

/**
 * Every data set of the maps as a row: where it was measured, and what the model leaves of it.
 * @param {readonly ResidualMap[]} maps
 * @returns {unknown[][]}
 */
export const mapRows = (maps) => [
  ["axis", "position", "data set", "table rate, deg/s", "temperature, °C", "residual, deg/s", "residual / noise floor"],
  ...maps.flatMap((map) =>
    map.dataset.map((set, k) => [
      map.axis,
      map.position,
      set,
      map.table_rate_dps[k],
      map.temperature_c[k],
      map.residual_dps[k],
      map.over_floor[k],
    ]),
  ),
];

/**
 * The data sets under a Plotly click or selection on a map.
 * @param {PlotEvent | undefined} event
 * @returns {number[]}
 */
export const datasetsUnder = (event) => [...new Set((event?.points ?? []).flatMap((point) => point.customdata ?? []))];

/** @param {Pick<ExploreState, "criticism" | "axis">} state */
export const selectedRows = (state) => datasetRows(state.criticism, state.axis);
