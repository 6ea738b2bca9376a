// The page of one recording: conditions, trace, data sets, readings, noise, and the file to download.

import { download, get } from "../core/http/api.js";
import { h, scrollTo } from "../core/elements.js";
import { count, day, number, plainNumber } from "../core/format.js";
import { button, card, factList, pageHeader, notice } from "../core/components.js";
import { updateQuery } from "../core/router.js";
import { motionCard, MOTION_NAMES, MOTION_TITLES } from "../motions/card.js";
import { allan } from "../recordings/allan.js";
import { channelUnit } from "../recordings/channels.js";
import { meanPlots } from "../recordings/mean_plots.js";
import { REFERENCE_TEXTS } from "../recordings/motion_texts.js";
import { datasetReadings } from "../recordings/readings.js";
import { inspectionCard } from "../recordings/inspection.js";
import { datasetTable } from "../recordings/dataset_table.js";
import { askTrace, trace } from "../recordings/trace.js";
import { SIMULATED } from "../campaigns/campaign_time.js";

/** @import { DataSets, Recording, Trace } from "../../../types/api.js" */

/** @import { PageContext, Part, RecordingState } from "../../../types/pages.js" */

/** @type {Record<string, string>} */
const KIND_TEXTS = {
  samples: "every reading",
  points: "one mean per data set",
  coefficients: "a published table, no readings",
};

/** @param {PageContext} context */
export async function page({ params, query, signal }) {
  const path = { recording: params.id };
  const askedSets = get("/api/recordings/{recording}/datasets", { path, signal });
  askedSets.catch(() => {}); // awaited below
  const about = await get("/api/recordings/{recording}", { path, query: { points: false }, signal });
  const { info } = about;
  /** @param {string | undefined} text */
  const numberIn = (text) => (text && Number.isFinite(Number(text)) ? Number(text) : null);
  const window = {
    id: about.id,
    channel: query.channel ?? `gyro_${info.axes[0]}`,
    from: numberIn(query.from),
    until: numberIn(query.until),
  };
  // the first figure: it does not wait for the data sets; readings always have times
  const askedTrace = about.kind === "samples" ? askTrace(window, signal) : null;
  askedTrace?.catch(() => {}); // shown where it is awaited
  const sets = await askedSets;
  /** @type {RecordingState} */
  const state = {
    ...window,
    kind: about.kind,
    sets,
    motion: info.motion ?? "rates",
    output: info.output ?? {},
    dataset: numberIn(query.dataset),
    pick: (dataset) => {
      state.dataset = dataset === state.dataset ? null : dataset;
      updateQuery({ dataset: state.dataset });
      for (const part of parts) part.redraw();
      if (state.dataset !== null) scrollTo(readings, "nearest");
    },
  };
  const element = h(
    "div",
    { class: "page", "data-source": `unit ${about.serial}, recording ${about.id}` },
    recordingHeader(about),
    conditionsCard(about, sets),
  );
  if (about.kind === "coefficients") {
    element.append(
      notice(
        "",
        "This recording is a published table of scale factors and offsets over temperature. It can be fitted, but it has no data sets and no readings to show.",
      ),
    );
    return element;
  }
  const timed = sets.t_from_s.some((t) => t !== null);
  const readings = datasetReadings(state, signal);
  /** @type {Part[]} */
  const parts = [readings, datasetTable(state, query)];
  if (!timed && sets.number.length && (info.motion ?? "rates") === "rates") parts.unshift(meanPlots(state));
  if (timed) parts.unshift(shownTrace(state, askedTrace, signal));
  const motion = info.motion ?? "rates";
  if (motion !== "rates") element.append(motionCard(about.id, motion, info.axes, signal));
  if (about.kind === "samples" && info.motion !== "poses") parts.push(allan(state, signal));
  if (about.kind === "samples") element.append(inspectionCard(about.id, signal));
  element.append(...parts);
  return element;
}

/**
 * The trace, and in the state how to show a data set in it.
 * @param {RecordingState} state
 * @param {Promise<Trace> | null} asked
 * @param {AbortSignal} signal
 */
function shownTrace(state, asked, signal) {
  const found = trace(state, asked, signal);
  state.showInTrace = (k) => {
    const [from, until] = [state.sets.t_from_s[k] ?? 0, state.sets.t_until_s[k] ?? 0];
    const beside = 0.5 * (until - from);
    found.show({ from: from - beside, until: until + beside });
    scrollTo(found);
  };
  return found;
}

/** @param {Recording} about */
function recordingHeader(about) {
  const unit = encodeURIComponent(about.serial);
  /**
   * @param {"csv" | "parquet"} format
   * @param {string} text
   */
  const file = (format, text) =>
    button(text, () =>
      download("/api/recordings/{recording}/file", `recording-${about.id}-${format}.zip`, {
        path: { recording: about.id },
        query: { format },
      }),
    );
  const from = about.campaign
    ? h("a", { href: `/campaigns/${about.campaign}` }, `campaign ${about.campaign}`)
    : about.origin === "simulation"
      ? "a simulation"
      : "an import";
  const made = [about.info.model, about.info.technology?.toUpperCase()].filter(Boolean);
  return pageHeader(
    `Recording ${about.id}`,
    h(
      "span",
      {},
      "Of ",
      h("a", { href: `/units/${unit}` }, about.serial),
      made.length ? ` (${made.join(", ")})` : "",
      ", from ",
      from,
      `, ${day(about.created_at)}${about.simulated_time ? ` (${SIMULATED})` : ""}. Holds ${KIND_TEXTS[about.kind] ?? about.kind}.`,
    ),
    h("a", { class: "button primary", href: `/explore?unit=${unit}&recording=${about.id}` }, "Explore"),
    ...(about.kind === "coefficients" ? [] : [file("parquet", "Save as Parquet"), file("csv", "Save as CSV")]),
  );
}

/**
 * @param {Recording} recording
 * @param {DataSets} sets
 */
function conditionsCard({ info, datasets, readings: n, kind }, sets) {
  /** @param {readonly (number | null)[] | undefined} values */
  const span = (values) => {
    const there = (values ?? []).filter((value) => value !== null);
    return there.length ? [Math.min(...there), Math.max(...there)] : null;
  };
  const warm = span(sets.channels.temperature_c?.mean);
  const motion = info.motion ?? "rates";
  const rates = motion === "rates" ? span(sets.table_rate_dps) : null;
  const turns = motion === "turns" ? sets.table_rate_dps.filter((rate) => rate !== 0).length : null;
  const units = [...new Set(info.axes.map((axis) => channelUnit(`gyro_${axis}`, info.output)))];
  const element = card(
    "Conditions",
    factList([
      motion === "rates" ? null : ["Motion", MOTION_NAMES[motion], null, MOTION_TITLES[motion]],
      turns === null ? null : ["Turns", count(turns), "", `${count(datasets - turns)} rests`],
      ["Axes", info.axes.join(", "), "", `output in ${units.join(", ")}`],
      datasets ? ["Data sets", count(datasets)] : null,
      kind === "samples"
        ? ["Readings", count(n), "", info.sample_rate_hz ? `${plainNumber(info.sample_rate_hz)} per second` : null]
        : null,
      rates
        ? [
            "Table rate",
            rates[0] === rates[1] ? plainNumber(rates[0]) : `${plainNumber(rates[0])} to ${plainNumber(rates[1])}`,
            "deg/s",
            info.max_rate_dps ? `unit's limit ${plainNumber(info.max_rate_dps)} deg/s` : null,
          ]
        : null,
      rates && info.rate_reference ? ["Rates are", REFERENCE_TEXTS[info.rate_reference]] : null,
      warm && motion !== "rest"
        ? [
            "Gyro temperature",
            warm[0] === warm[1] ? number(warm[0]) : `${number(warm[0])} to ${number(warm[1])}`,
            "°C",
            datasets > 1 ? "means of the data sets" : "mean",
          ]
        : null,
      info.latitude_deg === null
        ? null
        : [
            "Latitude",
            plainNumber(info.latitude_deg),
            "deg",
            motion === "poses"
              ? "the vertical part of the Earth's rate is subtracted from rests"
              : "the Earth's rate is subtracted",
          ],
    ]),
  );
  if (info.notes) element.append(h("p", { class: "muted" }, info.notes));
  return element;
}
