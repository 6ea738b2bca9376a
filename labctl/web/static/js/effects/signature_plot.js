// Plot of an effect's signature: a thumbnail for the list, a figure for its page.

import { svg } from "../core/elements.js";
import { colourAt, TEMPERATURE_SCALE } from "../core/colour_scales.js";
import { colour, figure } from "../core/figure.js";
import { POSITIONS, signature } from "./signatures.js";

/** @import { Effect } from "../../../types/api.js" */
/** @import { Picture } from "../../../types/pages.js" */

const [WIDE, HIGH] = [116, 62];

/**
 * A small drawing beside the text; decorative, because the text says all of it.
 * @param {string} id
 */
export function signatureThumbnail(id) {
  const found = signature(id);
  const picture = svg(
    "svg",
    { viewBox: `0 0 ${WIDE} ${HIGH}`, class: "signature", "aria-hidden": "true" },
    svg("line", { x1: 4, y1: HIGH / 2, x2: WIDE - 4, y2: HIGH / 2, class: "zero" }),
  );
  if (!found) return picture;
  const { course } = found;
  /**
   * @param {number} x
   * @param {number} y
   */
  const at = (x, y) =>
    `${(6 + ((x - found.from) / (found.to - found.from)) * (WIDE - 12)).toFixed(1)},${(HIGH / 2 - (y * (HIGH - 12)) / 2.1).toFixed(1)}`;
  if (found.from < 0) picture.append(svg("line", { x1: WIDE / 2, y1: 5, x2: WIDE / 2, y2: HIGH - 5, class: "zero" }));
  if (found.over === "position") {
    picture.append(
      ...found.lines[0].y.map((y, k) => {
        const [x, top] = at(k, y).split(",").map(Number);
        return svg("rect", {
          x: x * 0.88 + 4,
          width: 8,
          y: Math.min(top, HIGH / 2),
          height: Math.max(Math.abs(top - HIGH / 2), 1),
          class: "bar",
        });
      }),
    );
    return picture;
  }
  if (course)
    picture.append(
      svg("polyline", {
        points: course.x.map((x, k) => at(x, 1.7 * course.y[k] - 0.85)).join(" "),
        class: "temperature-course",
      }),
    );
  found.lines.forEach((line, k) =>
    picture.append(
      svg("polyline", {
        points: line.x.map((x, i) => at(x, Math.min(Math.max(line.y[i], -1.05), 1.05))).join(" "),
        class: `curve of-${found.lines.length} nr-${k}`,
        style: found.lines.length === 3 ? `stroke: ${lineColour(k, 3)}` : null,
      }),
    ),
  );
  return picture;
}

/**
 * @param {number} k
 * @param {number} n
 */
const lineColour = (k, n) =>
  n === 1 ? colour("accent") : n === 3 ? colourAt(TEMPERATURE_SCALE, k / 2) : colour(k ? "axis-y" : "axis-x");

/** @param {Effect} effect */
export function signatureFigure(effect) {
  const found = signature(effect.id);
  if (!found) return null;
  /** @returns {Picture} */
  const draw = () => ({
    data: [
      ...(found.over === "position"
        ? [
            {
              type: "bar",
              name: "error at rest",
              x: POSITIONS.map((each) => `${each} up`),
              y: found.lines[0].y,
              marker: { color: colour("accent") },
              hoverinfo: "skip",
            },
          ]
        : found.lines.map((line, k) => ({
            type: "scatter",
            mode: "lines",
            name: line.name,
            x: line.x,
            y: line.y,
            line: { color: lineColour(k, found.lines.length), width: 2.5 },
            hoverinfo: "skip",
          }))),
      ...(found.course
        ? [
            {
              type: "scatter",
              mode: "lines",
              name: "temperature",
              x: found.course.x,
              y: found.course.y.map((y) => 1.7 * y - 0.85),
              line: { color: colour("text-muted"), dash: "dot", width: 1.5 },
              hoverinfo: "skip",
            },
          ]
        : []),
    ],
    layout: {
      showlegend: found.lines.length > 1 || Boolean(found.course),
      dragmode: false,
      margin: { l: 50, r: 12, t: 30, b: 46 },
      xaxis: {
        title: { text: found.title },
        fixedrange: true,
        ...(found.over === "angle" ? { dtick: 90 } : { showticklabels: found.over === "position", ticks: "" }),
      },
      yaxis: {
        title: { text: "error" },
        range: [-1.15, 1.15],
        fixedrange: true,
        showticklabels: false,
        ticks: "",
        zeroline: true,
      },
      shapes: found.marks.map(([x]) => ({
        type: "line",
        x0: x,
        x1: x,
        yref: "paper",
        y0: 0,
        y1: 1,
        line: { color: colour("border-strong"), dash: "dot", width: 1 },
      })),
      annotations: found.marks.map(([x, text]) => ({
        x,
        y: 1,
        yref: "paper",
        text,
        showarrow: false,
        xanchor: "left",
        yanchor: "top",
        font: { size: 11 },
      })),
    },
  });
  return figure(
    `Signature of ${effect.id}`,
    "Schematic: only the shape of the error is meaningful, not its size or scale. The page Explore shows measured pictures.",
    draw,
    { height: "19rem" },
  );
}
