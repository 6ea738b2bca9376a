// What a changed model would do: errors, residuals and sizes, before and after.

import { h } from "../core/elements.js";
import { axisColour, colour, figure } from "../core/figure.js";
import { idText } from "../core/format.js";
import { channelTitle, inDatasetOrder, scaled, setText, shownText } from "./dataset_rows.js";
import { selectedRows } from "./residual_map.js";
import { usualSizeText } from "./suspect_notes.js";

/** @import { Effect, Preview } from "../../../types/api.js" */
/** @import { ExploreState } from "./state.js" */

/**
 * @param {number | null} before
 * @param {number | null} after
 */
export function relativeChange(before, after) {
  if (!before || !after) return null;
  const share = after / before - 1;
  return h(
    "span",
    { class: share < -0.02 ? "good-text" : share > 0.02 ? "bad-text" : "muted" },
    `${share < 0 ? "–" : "+"}${Math.abs(Math.round(100 * share))} %`,
  );
}

/**
 * What the residual is drawn over: the table's rate, or at one rate the temperature, or the time.
 * @param {Record<string, readonly (number | null)[]>} channels
 */
export const channelOf = (channels) =>
  ["table_rate_dps", "temperature_c", "t_s"].find((name) => new Set(channels[name] ?? []).size > 1) ?? "table_rate_dps";

/**
 * @param {ExploreState} state
 * @param {Preview} found
 * @param {number | null} floor
 */
export function residualFigure(state, found, floor) {
  const draw = () => {
    const rows = selectedRows(state);
    const channel = channelOf(rows.channels);
    const x = scaled(channel, rows.channels[channel]);
    const after = inDatasetOrder(state, found.residuals, "residual_dps");
    /**
     * @param {readonly (number | null)[]} y
     * @param {string} name
     * @param {object} marker
     */
    const dots = (y, name, marker) => ({
      type: "scatter",
      mode: "markers",
      name,
      x,
      y,
      marker,
      customdata: rows.dataset,
      text: rows.dataset.map((_, k) => setText(rows, k)),
      hovertemplate: `%{text}<br>%{x:.5g}: %{y:.3g} deg/s<extra>${name}</extra>`,
    });
    /** @param {number} y */
    const line = (y) => ({
      type: "line",
      xref: "paper",
      x0: 0,
      x1: 1,
      y0: y,
      y1: y,
      line: { color: colour("border-strong"), dash: "dash", width: 1 },
    });
    return {
      data: [
        dots(rows.residual, "before", { size: 5, color: colour("border-strong"), symbol: "circle-open" }),
        dots(after, "after", { size: 6, color: axisColour(state.axis) }),
      ],
      layout: {
        title: shownText(state.criticism) ? { text: shownText(state.criticism), font: { size: 11 } } : undefined,
        xaxis: { title: { text: channelTitle(channel) } },
        yaxis: { title: { text: "residual of<br>the fitted model, deg/s" } },
        shapes: floor ? [line(2 * floor), line(-2 * floor)] : [],
      },
    };
  };
  return figure("Residual before and after", "Dashed: two noise floors.", draw, { height: "18rem" });
}

/**
 * @param {ExploreState} state
 * @param {Preview} found
 * @param {{ add: ReadonlySet<string> }} change
 * @param {readonly Effect[]} effects
 */
export function plausibility(state, found, change, effects) {
  /** @param {string} id */
  const unitOf = (id) => effects.find((each) => each.id === id)?.unit;
  const own = found.axes[state.axis]?.coefficients;
  const added = [...change.add].map((id) => id.split(":")[0]);
  if (!own || !added.length) return null;
  const ranges = added.flatMap((id) => {
    const range = found.plausible[id];
    return range ? [{ id, ...range }] : [];
  });
  const hint = found.thermal_hint ? [h("li", {}, found.thermal_hint.text)] : [];
  return ranges.length || hint.length
    ? h(
        "ul",
        { class: "plain" },
        hint,
        ranges.map(({ id, from, to, inside }) =>
          h("li", {}, `${idText(id)}: `, usualSizeText(id, inside, [from, to], unitOf(id))),
        ),
      )
    : null;
}
