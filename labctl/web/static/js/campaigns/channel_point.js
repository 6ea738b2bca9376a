// A mean of a data set among the channels of a campaign, computed again from its readings.

import { get } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { pythonValue } from "../core/figure_point.js";
import { channelName } from "../recordings/channels.js";

/** @import { Campaign } from "../../../types/api.js" */
/** @import { Asked } from "../core/figure_point.js" */
/** @import { Series } from "./channel_series.js" */

/**
 * @param {Campaign} campaign
 * @param {string} serial
 * @param {string} channel
 * @param {number | undefined} dataset
 * @returns {Asked | null}
 */
export function channelPoint(campaign, serial, channel, dataset) {
  const recording = campaign.recordings[serial];
  if (recording === undefined || dataset === undefined) return null;
  return {
    key: `mean_${recording}_${dataset}_${channel}`,
    name: `${serial}, ${channelName(channel)}, data set ${dataset}`,
    read: () =>
      get("/api/recordings/{recording}/datasets/{dataset}/mean", { path: { recording, dataset }, query: { channel } }),
    call: `client.mean_point(${recording}, ${dataset}, ${pythonValue(channel)})`,
    links: () =>
      h("a", { class: "button tiny", href: `/recordings/${recording}?dataset=${dataset}` }, "Open its readings"),
  };
}

/**
 * The mean that an address names; null where no series has it.
 * @param {Campaign} campaign
 * @param {readonly Series[]} series
 * @param {string} key
 */
export function askedMean(campaign, series, key) {
  for (const { means } of series)
    for (const dataset of means?.dataset ?? []) {
      const asked = means ? channelPoint(campaign, means.serial, means.channel, dataset) : null;
      if (asked?.key === key) return asked;
    }
  return null;
}
