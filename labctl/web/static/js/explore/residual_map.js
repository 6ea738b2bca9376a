// Residual over noise floor as a map over rate and temperature: every measured cell. Cells can be selected.

import { DIVERGING } from "../core/colour_scales.js";
import { colour, figure } from "../core/figure.js";
import { number, plainNumber } from "../core/format.js";
import { datasetRows, distinctLabels } from "./dataset_rows.js";

const LIMITS = [3, 10];
const DIMMED_BELOW = 2;
/** Cells that fill less than this share of their rows and columns are drawn where they are, not in a grid. */
const LEAST_FILLED = 0.3;
/** Height of a panel on a narrow screen, where panels are stacked, px. */
const PANEL_PX = 210;

/** The maps of an axis, one for each position: columns of equal length, one number for each data set. */
export const mapsOf = (criticism, axis) => criticism.maps.filter((map) => map.axis === axis);

/** End of the colour scale: the largest residual over floor of several lists of maps, clipped to LIMITS. */
export function colourLimit(...all) {
  const largest = all
    .flat()
    .reduce((most, map) => map.over_floor.reduce((m, score) => Math.max(m, Math.abs(score)), most), 0);
  return Math.min(Math.max(largest, LIMITS[0]), LIMITS[1]);
}

/** Which data sets share a cell, in words. */
export function cellsText(criticism) {
  const width = Math.max(0, ...criticism.maps.map((map) => map.level_width_c));
  return `Data sets share a cell where rate and temperature repeat within 0.1 % and 0.25 K${width ? `; temperatures of one row are within ${plainNumber(width, 2)} K` : ""}.`;
}

const sorted = (values) => [...new Set(values)].sort((a, b) => a - b);

/** Measured cells of one map: their rates and temperatures, and each cell's mean score and data sets. */
function mapCells(map) {
  const found = new Map();
  map.dataset.forEach((set, k) => {
    const [rate, warm] = [map.rate_level_dps[k], map.temperature_level_c[k]];
    const cell =
      found.get(`${rate} ${warm}`) ??
      found.set(`${rate} ${warm}`, { rate, warm, sum: 0, sets: [] }).get(`${rate} ${warm}`);
    cell.sum += map.over_floor[k];
    cell.sets.push(set);
  });
  const cells = [...found.values()].map((cell) => ({ ...cell, mean: cell.sum / cell.sets.length }));
  return { rates: sorted(map.rate_level_dps), warm: sorted(map.temperature_level_c), cells };
}

const isDim = (cell) => Math.abs(cell.mean) * Math.sqrt(cell.sets.length) < DIMMED_BELOW;
const cellText = (cell, position) =>
  `${plainNumber(cell.rate)} deg/s, ${plainNumber(cell.warm)} deg C, ${position} up<br>${number(cell.mean, 2)} floors<br>data set ${cell.sets.slice(0, 6).join(", ")}${cell.sets.length > 6 ? " …" : ""}`;

/** Cells as a grid, with a faded layer over those within the noise. */
function gridTraces({ rates, warm, cells }, position, shared) {
  const labels = [distinctLabels(rates), distinctLabels(warm)];
  const grid = () => warm.map(() => rates.map(() => null));
  const [z, dim, sets, texts] = [grid(), grid(), grid(), grid()];
  for (const cell of cells) {
    const [row, column] = [warm.indexOf(cell.warm), rates.indexOf(cell.rate)];
    Object.assign(cell, { x: labels[0][column], y: labels[1][row] });
    z[row][column] = cell.mean;
    sets[row][column] = cell.sets;
    texts[row][column] = cellText(cell, position);
    if (isDim(cell)) dim[row][column] = 1;
  }
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
  };
}

/** Cells that share few rates or temperatures, as squares at their own rate and temperature. */
function scatteredTraces({ cells }, position, shared) {
  for (const cell of cells) Object.assign(cell, { x: cell.rate, y: cell.warm });
  return {
    traces: [
      {
        type: "scatter",
        mode: "markers",
        ...shared,
        name: `${position} up`,
        showlegend: false,
        x: cells.map((cell) => cell.x),
        y: cells.map((cell) => cell.y),
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
  };
}

/** The traces and axes of one map; `id` is "" or the number of the panel from 2 on, as in Plotly's axis names. */
function positionPanel(map, id, pick) {
  const found = mapCells(map);
  const shared = { xaxis: `x${id}`, yaxis: `y${id}` };
  const filled = found.cells.length >= LEAST_FILLED * found.rates.length * found.warm.length;
  const { traces, x, y } = (filled ? gridTraces : scatteredTraces)(found, map.position, shared);
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
  const picked = found.cells.filter((cell) => cell.sets.some((set) => pick.has(set)));
  return {
    data: [
      ...traces,
      mark(found.cells, { size: 18, opacity: 0.01, symbol: "square" }, "cells"),
      mark(picked, { size: 13, symbol: "square-open", color: colour("text"), line: { width: 2.5 } }, "picked"),
    ],
    x: { ...x, showgrid: false, title: { text: "table rate, deg/s" } },
    y: { ...y, showgrid: false, title: id === "" ? { text: "deg C" } : undefined },
    text: `${map.position} up: ${map.dataset.length} data sets${found.cells.length < map.dataset.length ? ` in ${found.cells.length} cells` : ""}`,
  };
}

/** The map of an axis, a panel for each position. `give()` returns {maps, limit, pick}. */
export function residualMap(name, caption, give, { pickable = true, height = "22rem" } = {}) {
  const draw = () => {
    const { maps, limit, pick = new Set() } = give();
    const several = maps.length > 1;
    const layout = {
      margin: { l: 52, r: 8, t: 28, b: 46 },
      dragmode: pickable ? "select" : false,
      coloraxis: {
        colorscale: DIVERGING,
        cmin: -limit,
        cmax: limit,
        colorbar: { title: { text: "floors" }, thickness: 12, outlinewidth: 0 },
      },
    };
    const below = several && window.innerWidth < 760;
    if (below) layout.height = maps.length * PANEL_PX;
    if (several)
      layout.grid = below
        ? { rows: maps.length, columns: 1, pattern: "independent", ygap: 0.4 }
        : { rows: 1, columns: maps.length, pattern: "independent", xgap: 0.14 };
    layout.annotations = [];
    const data = maps.flatMap((map, k) => {
      const id = k ? String(k + 1) : "";
      const { data: traces, x, y, text } = positionPanel(map, id, pick);
      layout[`xaxis${id}`] = below && k < maps.length - 1 ? { ...x, title: undefined } : x; // one title for all panels
      layout[`yaxis${id}`] = y;
      layout.annotations.push({
        text,
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
  return figure(name, caption, draw, { height });
}

/** The data sets under a Plotly click or selection on a map. */
export const datasetsUnder = (event) => [...new Set((event?.points ?? []).flatMap((point) => point.customdata ?? []))];

export const selectedRows = (state) => datasetRows(state.criticism, state.axis);
