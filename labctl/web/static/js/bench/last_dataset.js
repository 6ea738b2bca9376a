// The readings of the newest finished data set of a campaign.

import { get } from "../core/http/api.js";
import { setChildren, h } from "../core/elements.js";
import { axisColour, figure } from "../core/figure.js";
import { plainNumber } from "../core/format.js";
import { cardWithHeader } from "../core/components.js";

/** @import { Campaign, SampleColumns, Timeline } from "../../../types/api.js" */

const MAX_READINGS = 4000;
const MIN_INTERVAL_MS = 3000;

/**
 * A card with `onStatus(status)`: shows each data set when it is finished.
 * @param {Timeline} timeline
 * @param {AbortSignal} signal
 */
export function lastDataset(timeline, signal) {
  const about = h("span", { class: "muted small" });
  const place = h("div", {}, h("p", { class: "muted" }, "The first data set has not been measured yet."));
  /** @type {SampleColumns} */
  let columns = {};
  /** @type {number | null} */
  let shown = null;
  /** @type {string | null} */
  let unit = null;
  let [next, busy] = [0, false];
  const gyroColumns = () => Object.keys(columns).filter((name) => name.startsWith("gyro_"));
  const picture = figure(
    "Gyro output of the last data set",
    `Readings as recorded; only the first ${MAX_READINGS} of a longer data set are drawn.`,
    () => {
      const axes = gyroColumns();
      const t = (columns.t_s ?? []).map((value) => value - columns.t_s[0]);
      const thirds = axes.length > 1 ? axes.length : 1;
      return {
        data: axes.map((name, k) => ({
          type: "scatter",
          mode: "lines",
          name: `axis ${name.slice(5)}`,
          x: t,
          y: columns[name],
          yaxis: k ? `y${k + 1}` : "y",
          line: { width: 0.8, color: axisColour(name.slice(5)) },
          hovertemplate: "%{y:.6~g} after %{x:.4~f} s<extra></extra>",
        })),
        layout: {
          showlegend: false,
          margin: { l: 62, r: 12, t: 8, b: 42 },
          xaxis: { title: { text: "time in the data set, s" }, anchor: thirds > 1 ? `y${thirds}` : "y" },
          ...Object.fromEntries(
            axes.map((name, k) => [
              k ? `yaxis${k + 1}` : "yaxis",
              {
                title: { text: `${name.slice(5)}, ${unit}` },
                domain: [1 - (k + 1) / thirds + (k + 1 < thirds ? 0.04 : 0), 1 - k / thirds - (k ? 0.04 : 0)],
              },
            ]),
          ),
        },
      };
    },
    {
      height: "21rem",
      csv: () => [
        ["t_s", ...gyroColumns()],
        ...columns.t_s.map((t, k) => [t, ...gyroColumns().map((name) => columns[name][k])]),
      ],
    },
  );

  /** @param {Campaign} status */
  async function onStatus(status) {
    const until = (status.step ?? 1) - (status.state === "done" ? 0 : 1);
    const dataset = timeline.dataset.slice(0, until).findLast((each) => each !== null) ?? null;
    const recording = Object.values(status.recordings)[0];
    if (busy || !recording || dataset === null || dataset === shown || Date.now() < next) return;
    [busy, next] = [true, Date.now() + MIN_INTERVAL_MS];
    try {
      const found = await get("/api/recordings/{recording}/samples", {
        path: { recording },
        query: { dataset, limit: MAX_READINGS },
        signal,
      });
      unit ??= await outputUnit(recording, found.columns, signal);
      columns = found.columns;
      const k = timeline.dataset.indexOf(dataset);
      setChildren(
        about,
        h("a", { href: `/recordings/${recording}?dataset=${dataset}` }, `Data set ${dataset}`),
        `: ${plainNumber(timeline.rate_dps[k])} deg/s at ${plainNumber(timeline.temperature_c[k])} °C, ${timeline.position[k] ?? "?"} up`,
      );
      if (!picture.isConnected) setChildren(place, picture);
      picture.redraw();
      shown = dataset;
    } catch {
      // not written yet, or aborted: the next status tries again
    } finally {
      busy = false;
    }
  }
  return Object.assign(cardWithHeader("Last data set", about, place), { onStatus });
}

/**
 * The unit of a gyro output, from a short trace of it.
 * @param {number} recording
 * @param {SampleColumns} columns
 * @param {AbortSignal} signal
 */
async function outputUnit(recording, columns, signal) {
  const channel = Object.keys(columns).find((name) => name.startsWith("gyro_"));
  const asked = { channel, from_s: columns.t_s[0], until_s: columns.t_s.at(-1), points: 200 };
  return (await get("/api/recordings/{recording}/trace", { path: { recording }, query: asked, signal })).unit;
}
