// What has happened since the evening before, and what waits for a person: one row for each, the most urgent first. Units
// that are due have a list of their own.

import { number, percent, personText } from "../core/format.js";
import { stateText } from "../campaigns/states.js";

/** @import { Bench, CalibrationEvent, Campaign, Scheduled } from "../../../types/api.js" */

/** @typedef {"bad" | "warn" | "good" | "accent"} Kind */
/**
 * A row: what it is about, one sentence, and the page of its button. `share` is how far a campaign came, `over_floor` the
 * error of a draft over the noise floor, each null where it is neither.
 * @typedef {object} News
 * @property {Kind} kind
 * @property {string} about
 * @property {string} text
 * @property {string} href
 * @property {string} act
 * @property {string | null} at
 * @property {number | null} campaign its number: campaigns are numbered in the order of their starts
 * @property {number | null} share
 * @property {number | null} over_floor
 */

/** How far back the list goes, by name. */
export const SPANS = { evening: "Since yesterday 18:00", week: "Last 7 days", all: "All that is open" };
/** @typedef {keyof typeof SPANS} Span */
const EVENING_H = 18;
/** Campaigns of simulated benches that are listed. */
const SIMULATED = 5;
/** @type {Record<Kind, number>} */
const URGENCY = { bad: 0, warn: 1, accent: 2, good: 3 };

/**
 * The begin of a span, ms since 1970.
 * @param {Span} span
 * @param {Date} now
 */
export function beginOf(span, now) {
  if (span === "all") return -Infinity;
  const begin = new Date(now);
  if (span === "week") begin.setDate(begin.getDate() - 7);
  else {
    begin.setDate(begin.getDate() - 1);
    begin.setHours(EVENING_H, 0, 0, 0);
  }
  return begin.getTime();
}

/**
 * @param {object} found
 * @param {readonly Campaign[]} found.campaigns
 * @param {readonly Bench[]} found.benches
 * @param {readonly Scheduled[]} found.schedule
 * @param {readonly CalibrationEvent[]} found.events newest first
 * @param {Span} span
 * @param {Date} now
 * @returns {News[]}
 */
export function newsOf({ campaigns, benches, schedule, events }, span, now) {
  const begin = beginOf(span, now);
  /** @param {string | null | undefined} at */
  const isNew = (at) => !at || Date.parse(at) >= begin;
  // the clock of a simulated bench is its own: of its campaigns the newest ones are new
  const simulated = campaigns.filter((each) => each.simulated_time).slice(0, SIMULATED);
  const recent = campaigns.filter((each) =>
    each.simulated_time ? simulated.includes(each) || !each.ended : !each.ended || isNew(each.ended_at),
  );
  const news = [
    ...benches.flatMap(benchNews),
    ...recent.flatMap(campaignNews),
    ...recent.filter((each) => each.ended).flatMap(draftNews),
    ...schedule.flatMap((start) => missedNews(start, isNew)),
    ...calibrationNews(
      events.filter(({ at }) => isNew(at)),
      campaigns,
    ),
  ];
  return news.sort((a, b) => URGENCY[a.kind] - URGENCY[b.kind] || orderOf(a, b));
}

const LAST = Number.MAX_SAFE_INTEGER;
/**
 * The newest start first, whatever its clock says: that of each simulated bench begins at the same date. What is of no
 * campaign stands first, the newest first.
 * @param {News} a
 * @param {News} b
 */
const orderOf = (a, b) =>
  (b.campaign ?? LAST) - (a.campaign ?? LAST) || Date.parse(b.at ?? "0") - Date.parse(a.at ?? "0");

/** @param {string} serial */
const unitPage = (serial) => `/units/${encodeURIComponent(serial)}`;

/** What a row has that is about neither a campaign nor a draft. */
const PLAIN = { at: null, campaign: null, share: null, over_floor: null };

/**
 * @param {Bench} bench
 * @returns {News[]}
 */
const benchNews = (bench) =>
  bench.unconfirmed
    ? [
        {
          ...PLAIN,
          kind: "bad",
          about: bench.name,
          text: "was not confirmed safe; inspect the bench.",
          href: "/bench",
          act: "To the bench",
        },
      ]
    : [];

/**
 * @param {Campaign} campaign
 * @returns {News[]}
 */
function campaignNews(campaign) {
  const base = {
    about: `Campaign ${campaign.id}`,
    href: `/campaigns/${campaign.id}`,
    act: "Open",
    at: campaign.ended_at ?? campaign.started_at,
    campaign: campaign.id,
    share: campaign.progress,
    over_floor: null,
  };
  const name = `${campaign.recipe} on ${campaign.bench}`;
  if (campaign.prompt)
    return [
      { ...base, kind: "warn", text: `waits for a person: ${campaign.prompt.text}`, href: "/bench", act: "Answer" },
    ];
  const state = stateText(campaign);
  if (campaign.active) {
    const late = campaign.state === "running" ? "" : `, ${state}`;
    return [
      {
        ...base,
        kind: late ? "warn" : "accent",
        text: `${name}: ${percent(campaign.progress)} done${late}.`,
        href: "/bench",
      },
    ];
  }
  if (campaign.state === "done") {
    const repeated = campaign.repeated ? `; ${campaign.repeated} data sets were taken again` : "";
    return [{ ...base, kind: "good", text: `${name} is done${repeated}.` }];
  }
  return [{ ...base, kind: "bad", text: `${name}: ${state}${campaign.reason ? `: ${campaign.reason}` : "."}` }];
}

/**
 * The calibrations that a campaign ended in, and what a person decides of each.
 * @param {Campaign} campaign
 * @returns {News[]}
 */
function draftNews(campaign) {
  return campaign.drafts.flatMap((draft) => {
    const base = { about: draft.serial, at: draft.at, campaign: draft.campaign, share: null, over_floor: null };
    if (draft.state === "failed")
      return [
        {
          ...base,
          kind: /** @type {Kind} */ ("bad"),
          text: `was not fitted: ${draft.reason}`,
          href: `/campaigns/${draft.campaign}`,
          act: "Open",
        },
      ];
    const report = draft.report;
    if (!report || draft.version === null || draft.certified) return [];
    const { rms_dps, noise_floor_dps } = report.error;
    const over_floor = rms_dps && noise_floor_dps ? rms_dps / noise_floor_dps : null;
    const error = over_floor === null ? "" : ` The error is ${number(over_floor, 2)} times the noise floor.`;
    const explore = `/explore?unit=${encodeURIComponent(draft.serial)}&version=${draft.version}`;
    if (report.verdict === "adequate" && !report.objections.length)
      return [
        {
          ...base,
          over_floor,
          kind: /** @type {Kind} */ ("good"),
          text: `version ${draft.version} can be certified.${error}`,
          href: `${unitPage(draft.serial)}?version=${draft.version}`,
          act: "Certify",
        },
      ];
    const why = report.verdict_text || report.objections[0]?.text || "was not judged.";
    return [
      {
        ...base,
        over_floor,
        kind: /** @type {Kind} */ ("warn"),
        text: `version ${draft.version}: ${why}${error}`,
        href: explore,
        act: "Explore",
      },
    ];
  });
}

/** Calibrations and certifications that are listed. */
const EVENTS = 20;

/**
 * Versions that were made by a person, and what was certified or revoked. A draft of a campaign has a row of its own.
 * @param {readonly CalibrationEvent[]} events
 * @param {readonly Campaign[]} campaigns
 * @returns {News[]}
 */
function calibrationNews(events, campaigns) {
  /** @param {{ serial: string, version: number | null }} of */
  const nameOf = ({ serial, version }) => JSON.stringify([serial, version]);
  const drafts = new Set(campaigns.flatMap((campaign) => campaign.drafts.map(nameOf)));
  return events
    .filter((event) => event.act !== "made" || !drafts.has(nameOf(event)))
    .slice(0, EVENTS)
    .map((event) => ({
      ...PLAIN,
      at: event.at,
      about: event.serial,
      ...EVENT_TEXTS[event.act](event),
    }));
}

/** @type {Record<CalibrationEvent["act"], (event: CalibrationEvent) => Pick<News, "kind" | "text" | "href" | "act">>} */
const EVENT_TEXTS = {
  made: ({ serial, version, model }) => ({
    kind: "good",
    text: `version ${version} was made: ${model}.`,
    href: `/explore?unit=${encodeURIComponent(serial)}&version=${version}`,
    act: "Explore",
  }),
  certify: ({ serial, version, by }) => ({
    kind: "good",
    text: `version ${version} was certified by ${personText(by)}.`,
    href: unitPage(serial),
    act: "Open",
  }),
  revoke: ({ serial, version, by }) => ({
    kind: "warn",
    text: `version ${version} was revoked by ${personText(by)}.`,
    href: unitPage(serial),
    act: "Open",
  }),
};

/**
 * Starts that were missed or refused.
 * @param {Scheduled} start
 * @param {(at: string | null) => boolean} isNew
 * @returns {News[]}
 */
const missedNews = (start, isNew) =>
  start.history
    .filter((event) => (event.outcome === "missed" || event.outcome === "refused") && isNew(event.at))
    .map((event) => ({
      ...PLAIN,
      kind: /** @type {Kind} */ ("bad"),
      about: start.recipe,
      text: `did not begin: ${event.message}`,
      href: "/campaigns",
      act: "Open the schedule",
      at: event.at,
    }));
