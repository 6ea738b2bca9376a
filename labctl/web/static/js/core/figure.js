// Figures: a Plotly plot in the colours of the theme, with buttons that save it as PNG, SVG or CSV.

import { saveBlob } from "./http/api.js";
import { copyText } from "./copy_text.js";
import { figureAddress, showIfAsked } from "./figure_link.js";
import { csvText, fileName, traceRows } from "./csv.js";
import { toast } from "./components.js";
import { h, whenNearViewport } from "./elements.js";
import { loadPlotly, loadedFor, setDrawnBy } from "./plotly.js";

/** @import { CsvRows, Figure, Picture, Plot, PlotLayout, Plotly, PlotTrace } from "../../../types/pages.js" */

/** @type {Set<Figure>} */
const drawnFigures = new Set();

/** Height of the line below a saved figure. */
const LINE_PX = 24;

/** @param {string} name */
export const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
/** @param {string} axis */
export const axisColour = (axis) => colour(`axis-${axis}`) || colour("accent");
const TOOLS = [["zoom2d", "pan2d", "select2d", "lasso2d", "resetScale2d"]];
const TOOLS_3D = [["orbitRotation", "pan3d", "resetCameraDefault3d"]];
/** @param {readonly PlotTrace[]} data */
const config = (data) => ({
  displaylogo: false,
  responsive: true,
  displayModeBar: "hover",
  modeBarButtons: isSolid(data) ? TOOLS_3D : TOOLS,
});
/** @param {readonly PlotTrace[]} data */
const isSolid = (data) => data.some((trace) => /surface|3d/.test(trace.type));

/**
 * @param {PlotLayout} layout
 * @returns {PlotLayout}
 */
function themedLayout(layout) {
  const axis = {
    gridcolor: colour("border"),
    zerolinecolor: colour("border-strong"),
    linecolor: colour("border-strong"),
    automargin: true,
    exponentformat: "power",
    ticks: "outside",
    tickcolor: colour("border"),
  };
  const own = Object.fromEntries(
    Object.entries(layout)
      .filter(([name]) => /^[xy]axis\d*$/.test(name))
      .map(([name, value]) => [name, { ...axis, ...value }]),
  );
  return {
    paper_bgcolor: "rgba(0,0,0,0)",
    plot_bgcolor: "rgba(0,0,0,0)",
    font: { family: getComputedStyle(document.body).fontFamily, size: 12.5, color: colour("text-muted") },
    margin: { l: 58, r: 16, t: 12, b: 44 },
    hovermode: "closest",
    dragmode: "zoom",
    modebar: { bgcolor: "rgba(0,0,0,0)", color: colour("border-strong"), activecolor: colour("accent") },
    legend: { orientation: "h", y: 1.02, yanchor: "bottom", x: 0, traceorder: "normal" }, // a band would turn it round
    hoverlabel: { bgcolor: colour("surface"), bordercolor: colour("border-strong"), font: { color: colour("text") } },
    xaxis: axis,
    yaxis: axis,
    ...layout,
    ...own,
  };
}

/**
 * A drawn figure with a line of text below it.
 * @param {Plot} plot
 * @param {string} text
 */
function withLine({ data = [], layout = {} }, text) {
  const { margin = {}, annotations = [] } = layout;
  const below = (margin.b ?? 0) + LINE_PX;
  const line = {
    text,
    showarrow: false,
    xref: "paper",
    yref: "paper",
    x: 0,
    y: 0,
    xanchor: "left",
    yanchor: "bottom",
    yshift: -below,
    font: { size: 10 },
  };
  return { data, layout: { ...layout, margin: { ...margin, b: below }, annotations: [...annotations, line] } };
}

/**
 * @typedef {object} FigureOptions
 * @property {string} [height]
 * @property {() => CsvRows} [csv]
 * @property {string} [slug] its name in an address, where several figures of a page have the same name
 * @property {() => string | null} [cell] the notebook cell that gives this figure; null: there is none as it is now
 */
/**
 * Create a figure. `draw()` gives {data, layout}; it is called again when the theme changes.
 * `csv()` gives [[heading, ...], [value, ...], ...]; without it the traces' own x, y, z are saved.
 * Return an element with `.update()` (draw), `.redraw()` (draw again, if it was drawn), `.drawAt(width)` (draw now, for
 * paper), `.solidPicture(width)` (a picture of a figure in three dimensions, for paper), `.plot` (Plotly's element) and `.ondrawn(plot)`, a callback for the first drawing.
 * @param {string} name
 * @param {string | null} caption
 * @param {() => Picture} draw
 * @param {FigureOptions} [options]
 * @returns {Figure}
 */
export function figure(name, caption, draw, { height = "20rem", csv, slug = fileName(name), cell } = {}) {
  const box = h("div", { class: "plot", role: "group", "aria-label": `${name}. ${caption ?? ""}` });
  const plot = /** @type {Plot} */ (/** @type {HTMLElement} */ (box)); // Plotly gives it `on` and `data`
  /**
   * @param {string} text
   * @param {() => unknown} act
   * @param {string} label
   */
  const tool = (text, act, label) =>
    h(
      "button",
      { type: "button", class: "button quiet tiny", "aria-label": `Save ${name} as ${label}`, onclick: act },
      text,
    );
  /** @type {Figure} */
  const element = Object.assign(
    h(
      "figure",
      { class: "figure", style: `--figure-height: ${height}` },
      plot,
      caption ? h("figcaption", {}, caption) : null,
      h(
        "div",
        { class: "toolbar" },
        tool("PNG", () => picture("png"), "PNG"),
        tool("SVG", () => picture("svg"), "SVG"),
        tool("CSV", () => saveBlob(new Blob([table()], { type: "text/csv" }), `${fileTitle()}.csv`), "CSV"),
        h(
          "button",
          {
            type: "button",
            class: "button quiet tiny",
            "aria-label": `Link: copy the address of ${name}`,
            onclick: () => copyText(figureAddress(slug), "Link to this figure"),
          },
          "Link",
        ),
        cell ? cellButton(name, cell) : null,
      ),
    ),
    { plot, update, redraw: () => (plot.data ? update() : undefined), drawAt, solidPicture },
  );

  /** What the page shows figures of, as it says in `data-source`: "unit A1, version 2 (0f3a...), recording 7". */
  const source = () => element.closest("[data-source]")?.getAttribute("data-source") ?? "";
  /** What a saved figure says of itself, so that it can be traced to what it shows. */
  const provenance = () =>
    [name, source(), `saved ${new Date().toISOString().slice(0, 19)}Z`].filter(Boolean).join("; ");
  const fileTitle = () => fileName(`${source().replace(/\([^)]*\)/g, "")} ${name}`);
  const table = () => `# ${provenance()}\n${csvText(rows())}`;

  /** @param {"png" | "svg"} format */
  async function picture(format) {
    const Plotly = await loadPlotly(plot.data);
    const link = await Plotly.toImage(withLine(plot, provenance()), {
      format,
      width: Math.max(plot.clientWidth, 800),
      height: Math.max(plot.clientHeight, 450),
      scale: format === "png" ? 2 : 1,
    });
    saveBlob(await (await fetch(link)).blob(), `${fileTitle()}.${format}`);
  }

  const rows = () => csv?.() ?? traceRows(plot.data ?? [], plot.layout);
  /** @type {Promise<void> | null} */
  let waiting = null;
  /** @type {number | null} */
  let paper_px = null; // an update that ends while the page is printed keeps the width of the paper
  function update() {
    return (waiting ??= drawAfterFrame());
  }

  /** Draw once for all that asks for it in a frame, after the frame: what else changed with it is seen first. */
  async function drawAfterFrame() {
    await loadPlotly();
    await new Promise(requestAnimationFrame);
    await new Promise((resolve) => setTimeout(resolve));
    waiting = null;
    const picture = draw();
    await drawWith(await loadPlotly(picture.data), picture);
    performance.mark("labctl:picture");
  }

  /**
   * @param {Plotly} Plotly
   * @param {Picture} picture
   */
  async function drawWith(Plotly, { data, layout = {} }) {
    setDrawnBy(plot, Plotly);
    const first = !plot.data;
    const sized = paper_px === null ? { autosize: true } : { autosize: false, width: paper_px, ...paperHeight(layout) };
    await Plotly.react(plot, data, { ...themedLayout(layout), ...sized }, config(data));
    if (first) {
      drawnFigures.add(element);
      element.ondrawn?.(plot);
    }
  }

  /**
   * Draw at once where Plotly is loaded: a page that is about to be printed does not wait.
   * @param {number | null} width px; null: as wide as the page lets it be
   */
  function drawAt(width) {
    paper_px = width;
    const picture = draw();
    const Plotly = loadedFor(picture.data);
    if (Plotly) drawWith(Plotly, picture);
  }

  /**
   * Put a picture of a figure in three dimensions beside it, which stands for it on paper; null for a flat one.
   * @param {number} width
   */
  async function solidPicture(width) {
    if (!plot.data || !isSolid(plot.data)) return null;
    const Plotly = await loadPlotly(plot.data);
    const height = Math.max(plot.clientHeight, 300);
    const src = await Plotly.toImage(plot, { format: "png", width, height, scale: 2 });
    const picture = h("img", { class: "print-picture", src, alt: name });
    plot.after(picture);
    return picture;
  }
  showIfAsked(element, slug);
  whenNearViewport(element, update); // draw on demand: a page with ten figures opens as fast as one with two
  return element;
}

/** Height of a figure on paper at most, CSS px: one sheet (A4 or letter) with the caption below it. */
const MAX_PAPER_PX = 860;
/**
 * A figure that is higher than a sheet is drawn lower on paper, so that none is broken.
 * @param {{ height?: number }} layout
 */
const paperHeight = ({ height }) => (height ? { height: Math.min(height, MAX_PAPER_PX) } : {});

/**
 * @param {string} name
 * @param {() => string | null} cell
 */
function cellButton(name, cell) {
  const copy = () => {
    const text = cell();
    if (text) copyText(text, "Notebook cell");
    else toast("bad", "The Python client has no column of this channel; choose rate, temperature or time.");
  };
  const label = `Notebook: copy a notebook cell that gives ${name}`;
  return h("button", { type: "button", class: "button quiet tiny", "aria-label": label, onclick: copy }, "Notebook");
}

/**
 * The figures of a part of the page, drawn or not.
 * @param {ParentNode} place
 * @returns {Figure[]}
 */
export const figuresOf = (place) =>
  [...place.querySelectorAll("figure.figure")].map((element) => /** @type {Figure} */ (element));

window.addEventListener("labctl:theme", () => {
  for (const element of drawnFigures) element.isConnected ? element.update() : drawnFigures.delete(element);
});
