// The page of one recording: conditions, trace, data sets, readings, noise, and the file to download.

import { download, get } from "../core/api.js";
import { h } from "../core/elements.js";
import { count, day, number, plainNumber } from "../core/format.js";
import { button, card, factList, pageHeader, notice } from "../core/components.js";
import { updateQuery } from "../core/router.js";
import { allan } from "../recordings/allan.js";
import { channelUnit } from "../recordings/channels.js";
import { meanPlots } from "../recordings/mean_plots.js";
import { datasetReadings } from "../recordings/readings.js";
import { datasetTable } from "../recordings/dataset_table.js";
import { trace } from "../recordings/trace.js";
import { SIMULATED } from "../campaigns/campaign_time.js";

const KIND_TEXTS = { samples: "every reading", points: "one mean per data set", coefficients: "a published table, no readings" };

export async function page({ params, query, signal }) {
  const path = `/api/recordings/${encodeURIComponent(params.id)}`;
  const [about, sets] = await Promise.all([get(path, { query: { points: false }, signal }), get(`${path}/datasets`, { signal })]);
  const { info } = about;
  const number_ = (text) => (text && Number.isFinite(Number(text)) ? Number(text) : null);
  const state = { id: about.id, kind: about.kind, sets, output: info.output ?? {}, channel: query.channel ?? `gyro_${info.axes[0]}`, from: number_(query.from), until: number_(query.until), dataset: number_(query.dataset) };
  const element = h("div", { class: "page" }, recordingHeader(about, path), conditionsCard(about, sets));
  if (about.kind === "coefficients") {
    element.append(notice("", "This recording is a published table: scale factors and offsets over temperature. It has no data sets and no readings to look at; it can be fitted."));
    return element;
  }
  const timed = sets.t_from_s.some((t) => t !== null);
  const parts = { raw: datasetReadings(state, signal), table: datasetTable(state, query) };
  if (timed) {
    parts.trace = trace(state, signal);
    state.showInTrace = (k) => {
      const about_ = 0.5 * (sets.t_until_s[k] - sets.t_from_s[k]);
      parts.trace.show({ from: sets.t_from_s[k] - about_, until: sets.t_until_s[k] + about_ });
      parts.trace.scrollIntoView({ block: "start", behavior: "smooth" });
    };
  }
  if (!timed && sets.number.length) parts.means = meanPlots(state);
  if (about.kind === "samples") parts.allan = allan(state, signal);
  state.pick = (dataset) => {
    state.dataset = dataset === state.dataset ? null : dataset;
    updateQuery({ dataset: state.dataset });
    for (const part of Object.values(parts)) part.redraw();
    if (state.dataset !== null) parts.raw.scrollIntoView({ block: "nearest", behavior: "smooth" });
  };
  element.append(...[parts.trace, parts.means, parts.raw, parts.table, parts.allan].filter(Boolean));
  return element;
}

function recordingHeader(about, path) {
  const unit = encodeURIComponent(about.serial);
  const file = (format, text) => button(text, () => download(`${path}/file?format=${format}`, `recording-${about.id}-${format}.zip`));
  const from = about.campaign ? h("a", { href: `/campaigns/${about.campaign}` }, `campaign ${about.campaign}`) : "an import";
  const made = [about.info.model, about.info.technology?.toUpperCase()].filter(Boolean);
  return pageHeader(`Recording ${about.id}`, h("span", {}, "Of ", h("a", { href: `/units/${unit}` }, about.serial), made.length ? ` (${made.join(", ")})` : "", ", from ", from, `, ${day(about.created_at)}${about.simulated_time ? ` (${SIMULATED})` : ""}. Holds ${KIND_TEXTS[about.kind] ?? about.kind}.`),
    h("a", { class: "button primary", href: `/explore?unit=${unit}&recording=${about.id}` }, "Explore"),
    ...(about.kind === "coefficients" ? [] : [file("parquet", "Save as Parquet"), file("csv", "Save as CSV")]));
}

function conditionsCard({ info, datasets, readings: n, kind }, sets) {
  const span = (values) => {
    const there = (values ?? []).filter((value) => value !== null);
    return there.length ? [Math.min(...there), Math.max(...there)] : null;
  };
  const warm = span(sets.channels.temperature_c?.mean);
  const rates = span(sets.table_rate_dps);
  const units = [...new Set(info.axes.map((axis) => channelUnit(`gyro_${axis}`, info.output)))];
  const card_ = card("Conditions", factList([
    ["Axes", info.axes.join(", "), "", `output in ${units.join(", ")}`],
    datasets ? ["Data sets", count(datasets)] : null,
    kind === "samples" ? ["Readings", count(n), "", info.sample_rate_hz ? `${plainNumber(info.sample_rate_hz)} per second` : null] : null,
    rates ? ["Table rate", `${plainNumber(rates[0])} to ${plainNumber(rates[1])}`, "deg/s", info.max_rate_dps ? `unit's limit ${plainNumber(info.max_rate_dps)} deg/s` : null] : null,
    warm ? ["Gyro temperature", `${number(warm[0])} to ${number(warm[1])}`, "deg C"] : null,
    info.latitude_deg === null ? null : ["Latitude", plainNumber(info.latitude_deg), "deg", "the Earth's rate is taken off"],
  ]));
  if (info.notes) card_.append(h("p", { class: "muted" }, info.notes));
  return card_;
}
