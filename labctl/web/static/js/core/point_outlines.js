// Outlines over points of a figure that are there in the next frame: Plotly draws its whole picture again for each change.

import { svg } from "./elements.js";

/** @import { Figure } from "../../../types/pages.js" */

/**
 * A square around a point of a figure: the number of the panel's axes as Plotly has it ("", "2", ...), and the point in
 * units of the axes, of categories their number from 0; side and line in px.
 * @typedef {{ axes: string, x: number, y: number, side_px: number, line_px: number, color: string }} Outline
 */

/**
 * Outline points of a figure that is drawn, instead of those that were outlined so before. Returns what takes these
 * outlines away: they stand for Plotly's own until these are drawn.
 * @param {Figure} figure
 * @param {readonly Outline[]} outlines
 */
export function outlinePoints(figure, outlines) {
  const { plot } = figure;
  figure.querySelector(":scope > .point-outlines")?.remove();
  const layer = svg(
    "svg",
    {
      class: "point-outlines",
      "aria-hidden": "true",
      style: `left: ${plot.offsetLeft}px; top: ${plot.offsetTop}px; width: ${plot.offsetWidth}px; height: ${plot.offsetHeight}px`,
    },
    outlines.map(({ axes, x, y, side_px: side, line_px, color }) => {
      const across = plot._fullLayout[`xaxis${axes}`];
      const up = plot._fullLayout[`yaxis${axes}`];
      return svg("rect", {
        x: across._offset + across.c2p(x) - side / 2,
        y: up._offset + up.c2p(y) - side / 2,
        width: side,
        height: side,
        fill: "none",
        stroke: color,
        "stroke-width": line_px,
      });
    }),
  );
  figure.append(layer);
  requestAnimationFrame(() => setTimeout(() => performance.mark("labctl:outlined"))); // after the frame that shows them
  return () => layer.remove();
}
