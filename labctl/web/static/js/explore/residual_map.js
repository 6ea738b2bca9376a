// Residual over noise floor as a map over rate and temperature. Cells can be selected.

import { colour, DIVERGING, figure } from "../core/figure.js";
import { number, plainNumber } from "../core/format.js";
import { groupLevels, datasetRows } from "./dataset_rows.js";

const LIMITS = [3, 10];
const DIMMED_BELOW = 2;
/** Height of a panel on a narrow screen, where panels are stacked, px. */
const PANEL_PX = 210;

/** End of the colour scale: the largest residual over floor of several criticisms, clipped to LIMITS. */
export function colourLimit(...all) {
  const largest = Math.max(...all.map((rows) => rows.score.reduce((most, score) => Math.max(most, Math.abs(score)), 0)));
  return Math.min(Math.max(largest, LIMITS[0]), LIMITS[1]);
}

/** Cells of one position: their centres, mean scores and data sets. */
function mapCells(rows, position) {
  const here = rows.position.map((p, k) => (p === position ? k : -1)).filter((k) => k >= 0);
  const [rates, across] = groupLevels(here.map((k) => rows.channels.table_rate_dps[k]), 1e-3);
  const [warm, down] = groupLevels(here.map((k) => rows.channels.temperature_c[k]), 1, 30);
  const found = new Map();
  here.forEach((k, i) => {
    const id = `${down[i]} ${across[i]}`;
    const cell = found.get(id) ?? found.set(id, { row: down[i], column: across[i], sum: 0, sets: [] }).get(id);
    cell.sum += rows.score[k];
    cell.sets.push(rows.dataset[k]);
  });
  return { rates: rates.map((v) => plainNumber(v)), warm: warm.map((v) => plainNumber(v, 3)), cells: [...found.values()] };
}

/** The traces and axes of one position; `id` is "" or the number of the panel from 2 on, as in Plotly's axis names. */
function positionPanel(rows, position, id, limit, pick) {
  const { rates, warm, cells: all } = mapCells(rows, position);
  const grid = () => warm.map(() => rates.map(() => null));
  const [z, dim, sets, texts] = [grid(), grid(), grid(), grid()];
  for (const cell of all) {
    const mean = cell.sum / cell.sets.length;
    z[cell.row][cell.column] = mean;
    sets[cell.row][cell.column] = cell.sets;
    texts[cell.row][cell.column] = `${rates[cell.column]} deg/s, ${warm[cell.row]} deg C, ${position} up<br>${number(mean, 2)} floors<br>data set ${cell.sets.slice(0, 6).join(", ")}${cell.sets.length > 6 ? " …" : ""}`;
    if (Math.abs(mean) * Math.sqrt(cell.sets.length) < DIMMED_BELOW) dim[cell.row][cell.column] = 1;
  }
  const axes = { xaxis: `x${id}`, yaxis: `y${id}` };
  const shade = colour("surface");
  const heat = { type: "heatmap", ...axes, x: rates, y: warm, xgap: 1, ygap: 1 };
  const mark = (which, marker, name) => ({
    type: "scatter", mode: "markers", name, ...axes, showlegend: false, marker,
    x: which.map((cell) => rates[cell.column]), y: which.map((cell) => warm[cell.row]), customdata: which.map((cell) => cell.sets), hoverinfo: "skip", selected: { marker: { opacity: marker.opacity ?? 1 } }, unselected: { marker: { opacity: marker.opacity ?? 1 } },
  });
  const picked = all.filter((cell) => cell.sets.some((set) => pick.has(set)));
  return {
    data: [
      { ...heat, z, customdata: sets, text: texts, hovertemplate: "%{text}<extra></extra>", zmin: -limit, zmax: limit, colorscale: DIVERGING, showscale: id === "", colorbar: { title: { text: "floors" }, thickness: 12, outlinewidth: 0 }, name: `${position} up` },
      { ...heat, z: dim, colorscale: [[0, shade], [1, shade]], opacity: 0.6, showscale: false, hoverinfo: "skip", name: "within noise" },
      mark(all, { size: 18, opacity: 0.01, symbol: "square" }, "cells"),
      mark(picked, { size: 13, symbol: "square-open", color: colour("text"), line: { width: 2.5 } }, "picked"),
    ],
    x: { type: "category", categoryorder: "array", categoryarray: rates, showgrid: false, title: { text: "table rate, deg/s" } },
    y: { type: "category", categoryorder: "array", categoryarray: warm, showgrid: false, title: id === "" ? { text: "deg C" } : undefined },
  };
}

/** The map of an axis, a panel for each position. `give()` returns {rows, limit, pick}. */
export function residualMap(name, caption, give, { pickable = true, height = "22rem" } = {}) {
  const draw = () => {
    const { rows, limit, pick = new Set() } = give();
    const positions = [...new Set(rows.position)];
    const several = positions.length > 1;
    const layout = { margin: { l: 52, r: 8, t: several ? 28 : 10, b: 46 }, dragmode: pickable ? "select" : false };
    const below = several && window.innerWidth < 760;
    if (below) layout.height = positions.length * PANEL_PX;
    if (several) layout.grid = below ? { rows: positions.length, columns: 1, pattern: "independent", ygap: 0.4 } : { rows: 1, columns: positions.length, pattern: "independent", xgap: 0.14 };
    const data = positions.flatMap((position, k) => {
      const id = k ? String(k + 1) : "";
      const { data: traces, x, y } = positionPanel(rows, position, id, limit, pick);
      layout[`xaxis${id}`] = below && k < positions.length - 1 ? { ...x, title: undefined } : x; // one title for all panels
      layout[`yaxis${id}`] = y;
      return traces;
    });
    if (several) layout.annotations = positions.map((position, k) => ({ text: `${position} up`, showarrow: false, xref: `x${k ? k + 1 : ""} domain`, yref: `y${k ? k + 1 : ""} domain`, x: 0, y: 1.02, xanchor: "left", yanchor: "bottom", font: { size: 12 } }));
    return { data, layout };
  };
  return figure(name, caption, draw, { height });
}

/** The data sets under a Plotly click or selection on a map. */
export const datasetsUnder = (event) => [...new Set((event?.points ?? []).flatMap((point) => point.customdata ?? []))];

export const selectedRows = (state) => datasetRows(state.criticism, state.axis);
