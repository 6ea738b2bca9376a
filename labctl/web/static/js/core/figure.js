// Figures: a Plotly plot in the colours of the theme, with buttons that save it as PNG, SVG or CSV.

import { saveBlob } from "./api.js";
import { h, whenNearViewport } from "./elements.js";

let script = null;
const drawnFigures = new Set();

/** Load Plotly once, on first use. */
export function loadPlotly() {
  script ??= new Promise((resolve, reject) => {
    const failed = () => {
      script = null; // the next figure tries again
      reject(new Error("the drawing library could not be loaded"));
    };
    document.head.append(
      h("script", { src: "/static/plotly.js", onload: () => resolve(window.Plotly), onerror: failed }),
    );
  });
  return script;
}

export const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
export const axisColour = (axis) => colour(`axis-${axis}`) || colour("accent");
const TOOLS = [["zoom2d", "pan2d", "select2d", "lasso2d", "resetScale2d"]];
const TOOLS_3D = [["orbitRotation", "pan3d", "resetCameraDefault3d"]];
const config = (data) => ({
  displaylogo: false,
  responsive: true,
  displayModeBar: "hover",
  modeBarButtons: data.some((trace) => /surface|3d/.test(trace.type)) ? TOOLS_3D : TOOLS,
});

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
    legend: { orientation: "h", y: 1.02, yanchor: "bottom", x: 0 },
    hoverlabel: { bgcolor: colour("surface"), bordercolor: colour("border-strong"), font: { color: colour("text") } },
    xaxis: axis,
    yaxis: axis,
    ...layout,
    ...own,
  };
}

/**
 * Create a figure. `draw()` gives {data, layout}; it is called again when the theme changes.
 * `csv()` gives [[heading, ...], [value, ...], ...]; without it the traces' own x, y, z are saved.
 * Return an element with `.update()` (draw), `.redraw()` (draw again, if it was drawn), `.plot` (Plotly's element) and
 * `.ondrawn(plot)`, a callback for the first drawing.
 */
export function figure(name, caption, draw, { height = "20rem", csv } = {}) {
  const plot = h("div", { class: "plot", role: "group", "aria-label": `${name}. ${caption ?? ""}` });
  const tool = (text, act, label) =>
    h(
      "button",
      { type: "button", class: "button quiet tiny", "aria-label": `Save ${name} as ${label}`, onclick: act },
      text,
    );
  const element = h(
    "figure",
    { class: "figure", style: `--figure-height: ${height}` },
    plot,
    caption ? h("figcaption", {}, caption) : null,
    h(
      "div",
      { class: "toolbar" },
      tool("PNG", () => picture("png"), "PNG"),
      tool("SVG", () => picture("svg"), "SVG"),
      tool("CSV", () => saveBlob(new Blob([text(rows())], { type: "text/csv" }), `${file(name)}.csv`), "CSV"),
    ),
  );

  async function picture(format) {
    const Plotly = await loadPlotly();
    const link = await Plotly.toImage(plot, {
      format,
      width: Math.max(plot.clientWidth, 800),
      height: Math.max(plot.clientHeight, 450),
      scale: format === "png" ? 2 : 1,
    });
    saveBlob(await (await fetch(link)).blob(), `${file(name)}.${format}`);
  }

  const rows = () => csv?.() ?? traces(plot.data ?? []);
  let waiting = false;
  element.plot = plot;
  element.update = async () => {
    if (waiting) return;
    waiting = true;
    const Plotly = await loadPlotly();
    await new Promise(requestAnimationFrame);
    waiting = false;
    const { data, layout = {} } = draw();
    const first = !plot.data;
    await Plotly.react(plot, data, themedLayout(layout), config(data));
    performance.mark("labctl:picture");
    if (first) {
      drawnFigures.add(element);
      element.ondrawn?.(plot);
    }
  };
  element.redraw = () => plot.data && element.update();
  whenNearViewport(element, element.update); // draw on demand: a page with ten figures opens as fast as one with two
  return element;
}

window.addEventListener("labctl:theme", () => {
  for (const element of drawnFigures) element.isConnected ? element.update() : drawnFigures.delete(element);
});

const file = (name) =>
  name
    .toLowerCase()
    .replaceAll(/[^a-z0-9]+/g, "-")
    .replaceAll(/^-|-$/g, "");
const text = (rows) =>
  rows
    .map((row) =>
      row
        .map((cell) => (/[",\n]/.test(String(cell)) ? `"${String(cell).replaceAll('"', '""')}"` : (cell ?? "")))
        .join(","),
    )
    .join("\n") + "\n";

function traces(data) {
  const rows = [["trace", "x", "y", "z"]];
  for (const trace of data) {
    const label = trace.name ?? "";
    if (trace.z && !trace.z[0]?.length)
      trace.z.forEach((z, k) => rows.push([label, trace.x[k], trace.y[k], z])); // dots or a line in space
    else if (trace.z)
      trace.z.forEach((line, r) =>
        Array.from(line).forEach((z, c) => rows.push([label, trace.x?.[c] ?? c, trace.y?.[r] ?? r, z])),
      );
    else Array.from(trace.x ?? trace.y ?? []).forEach((x, k) => rows.push([label, trace.x ? x : k, trace.y?.[k], ""]));
  }
  return rows;
}
