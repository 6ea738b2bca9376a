// The page of one campaign: its plan and progress, its events, and why it ended.

import { get } from "../core/http/api.js";
import { isAbort, messageOf } from "../core/http/errors.js";
import { setChildren, h } from "../core/elements.js";
import { count, percent } from "../core/format.js";
import { card, chip, factList, pageHeader, cardWithHeader, notice } from "../core/components.js";
import { toggleGroup } from "../core/fields.js";
import { navigate, updateQuery, show as showAgain } from "../core/router.js";
import { linkButton, resumeControl, stopButton } from "../bench/actions.js";
import { eventList } from "../bench/event_list.js";
import { followCampaign } from "../bench/campaign_stream.js";
import { remainingSeconds } from "../bench/campaign_history.js";
import { courseCard } from "../campaigns/course.js";
import { uncertaintyCard } from "../campaigns/uncertainty.js";
import { planChart } from "../campaigns/plan_chart.js";
import { draftsCard } from "../campaigns/drafts.js";
import { adviceNotice } from "../campaigns/advice.js";
import {
  campaignDuration,
  durationFact,
  instantFact,
  durationTaken,
  hindrances,
  planNote,
} from "../campaigns/campaign_time.js";
import { hasEnded, isRunning, stateKind } from "../campaigns/states.js";
import { stateChip } from "../campaigns/state_chip.js";

/** @import { Campaign, CampaignPlan } from "../../../types/api.js" */

/** @import { PageContext } from "../../../types/pages.js" */

/** @type {[level: string, text: string][]} */
const LEVELS = [
  ["info", "all"],
  ["warning", "warnings and errors"],
  ["error", "errors"],
];
const MAX_EVENTS = 200;
const PLAN_REFRESH_MS = 2500;

/** @param {PageContext} context */
export async function page({ params, query, signal }) {
  const path = { campaign: params.id };
  const answers = await Promise.all([
    get("/api/campaigns/{campaign}", { path, signal }),
    get("/api/campaigns/{campaign}/plan", { path, signal }),
    get("/api/benches", { signal }),
  ]);
  let [now, plan] = answers;
  const benches = answers[2];
  const here = benches[0]?.name === now.bench;
  const level = LEVELS.find(([each]) => each === query.level)?.[0] ?? "info";
  const events = eventList(MAX_EVENTS, level, now);
  const [about, reason, connection] = [h("div", {}), h("div", { class: "stack" }), h("div", { "aria-live": "polite" })];
  const [drafts, recordings, target] = [h("div", {}), h("div", {}), h("div", {})];
  let shownU = "";
  /** @type {number | null} */
  let scrubbed_s = null;
  const picture = planChart(
    `Campaign ${now.id} plan`,
    () => ({
      timeline: plan.timeline,
      now_s: scrubbed_s ?? (isRunning(now) ? now.t_s : null),
      scrubbed: scrubbed_s !== null,
      live: true,
    }),
    {
      pick: (dataset) =>
        Object.values(now.recordings)[0] &&
        navigate(`/recordings/${Object.values(now.recordings)[0]}?dataset=${dataset}`),
    },
  );
  let asked = Date.now();

  /** @param {Campaign} next */
  function show(next) {
    const ended = hasEnded(next) && !hasEnded(now);
    now = next;
    setChildren(about, summary(now, plan));
    setChildren(reason, reasonNotices(now));
    setChildren(drafts, draftsCard(now.drafts ?? []));
    setChildren(recordings, recordingsCard(now, setStates(plan).includes("done")));
    showTarget();
    if (ended) showAgain();
    else if (Date.now() - asked > PLAN_REFRESH_MS) again();
  }
  async function again() {
    asked = Date.now();
    plan = await get("/api/campaigns/{campaign}/plan", { path, signal }).catch(() => plan);
    picture.redraw();
  }
  /** U against the target, anew after each evaluation. */
  function showTarget() {
    const said = JSON.stringify(now.target);
    if (!now.target || said === shownU) return;
    shownU = said;
    const units = now.target.units;
    get("/api/campaigns/{campaign}/uncertainty", { path, signal })
      .then((answer) => setChildren(target, uncertaintyCard(answer, units)))
      .catch((error) => isAbort(error) || setChildren(target, notice("bad", messageOf(error))));
  }
  show(now);
  followCampaign(
    now.id,
    {
      progress: show,
      event: (event) => events.add(event),
      link: ({ stale, since, why }) =>
        setChildren(
          connection,
          stale
            ? notice(
                "bad",
                h(
                  "strong",
                  {},
                  `No update since ${new Date(since).toLocaleTimeString("en-GB")}${now.simulated_time ? " (real time)" : ""}. `,
                ),
                `${why}. The page retries every few seconds.`,
              )
            : null,
        ),
    },
    signal,
  );

  const course = h("div", {});
  loadCourse(now, path, signal)
    .then(([answer, datasets, recording]) => {
      const sets = datasets && { ...datasets, output: recording?.info.output ?? {} };
      const moved = (/** @type {number} */ t_s) => {
        scrubbed_s = t_s;
        picture.redraw();
      };
      setChildren(course, courseCard(answer, plan, sets, moved));
    })
    .catch((error) => isAbort(error) || setChildren(course, notice("bad", messageOf(error))));

  const acts = isRunning(now)
    ? [linkButton("To the bench", "/bench"), here ? stopButton(now.id) : null]
    : endedActions(now, plan, here);
  return h(
    "div",
    { class: "page", "data-source": `campaign ${now.id}, ${now.recipe} on ${now.bench}` },
    pageHeader(
      `Campaign ${now.id}`,
      h("span", {}, h("strong", {}, now.recipe), ` on bench ${now.bench}`),
      ...acts.filter(Boolean),
    ),
    connection,
    reason,
    about,
    drafts,
    target,
    cardWithHeader("Plan", h("span", { class: "muted small" }, "Click a data set to open its readings."), picture),
    course,
    recordings,
    Object.assign(
      cardWithHeader(
        "Events",
        toggleGroup("Events to show", LEVELS, level, (value) => {
          updateQuery({ level: value === "info" ? null : value });
          events.from(value);
        }),
        events,
      ),
      { id: "events" },
    ),
  );
}

/**
 * The course of the campaign, and its first recording with the data sets.
 * @param {Campaign} now
 * @param {{ campaign: string }} path
 * @param {AbortSignal} signal
 */
function loadCourse(now, path, signal) {
  const first = Object.values(now.recordings)[0];
  const one = { path: { recording: String(first) }, signal };
  const alone = { ...one, query: { points: false } };
  return Promise.all([
    get("/api/campaigns/{campaign}/course", { path, signal }),
    first === undefined ? null : get("/api/recordings/{recording}/datasets", one),
    first === undefined ? null : get("/api/recordings/{recording}", alone),
  ]);
}

/**
 * Resume comes first only where it would be accepted and nothing speaks against it.
 * @param {Campaign} now
 * @param {CampaignPlan} plan
 * @param {boolean} here
 */
function endedActions(now, plan, here) {
  const again = linkButton(
    "Plan the same again",
    `/campaigns/new?${plan.text ? `toml=${encodeURIComponent(plan.text)}` : `recipe=${encodeURIComponent(now.recipe)}`}`,
  );
  const resume = here ? resumeControl(now) : [];
  return now.resumable && !now.resume_reason ? [...resume, again] : [again, ...resume];
}

/**
 * The states of the data sets of a plan.
 * @param {CampaignPlan} plan
 */
const setStates = (plan) =>
  plan.timeline.dataset.map((dataset, k) => (dataset === null ? null : plan.timeline.state?.[k])).filter(Boolean);

/**
 * @param {Campaign} now
 * @param {CampaignPlan} plan
 */
function summary(now, plan) {
  const states = setStates(plan);
  const done = states.filter((state) => state === "done").length;
  return h(
    "div",
    { class: "card" },
    factList([
      ["State", stateChip(now), "", percent(now.progress)],
      ["Data sets", `${count(done)} of ${count(states.length)}`, "", `step ${now.step ?? "–"} of ${now.steps}`],
      ["Begun", ...instantFact(now, now.started_at)],
      isRunning(now)
        ? [
            "Expected end",
            ...instantFact(now, now.expected_end),
            `${campaignDuration(now, remainingSeconds(now, plan.expected_s))} left`,
          ]
        : ["Ended", ...instantFact(now, now.ended_at), durationTaken(now)],
      ["Planned", ...durationFact(now, plan.expected_s), planNote(now)],
    ]),
  );
}

/**
 * The reason of the present state, as the service gives it.
 * @param {Campaign} now
 */
function reasonNotices(now) {
  const kind = stateKind(now);
  return [
    isRunning(now) && now.state === "running"
      ? null
      : (adviceNotice(now) ??
        notice(
          kind,
          h("p", { class: "lead" }, now.reason || `It is ${now.state}.`),
          now.last_error && !now.last_error.includes(now.reason) ? h("p", {}, `Last fault: ${now.last_error}`) : null,
        )),
    ...hindrances(now).map((text) => notice("warn", text)),
    ...Object.entries(now.dropped).map(([unit, why]) =>
      notice("warn", h("strong", {}, unit), ` was excluded from the rest of the campaign: ${why}`),
    ),
  ].filter(Boolean);
}

/**
 * @param {Campaign} now
 * @param {boolean} hasData whether a data set is done, so that there is something to fit
 */
function recordingsCard(now, hasData) {
  const rows = Object.entries(now.recordings);
  if (!rows.length) return card("Units and recordings", h("p", { class: "muted" }, "Nothing was recorded."));
  return card(
    "Units and recordings",
    h(
      "ul",
      { class: "plain" },
      rows.map(([serial, recording]) =>
        h(
          "li",
          { class: "row space-between" },
          h(
            "span",
            { class: "row" },
            h("a", { href: `/units/${encodeURIComponent(serial)}` }, serial),
            now.dropped[serial] ? chip("dropped", "warn") : null,
          ),
          h(
            "span",
            { class: "row" },
            linkButton(`Recording ${recording}`, `/recordings/${recording}`, "tiny"),
            hasData
              ? linkButton(
                  "Explore",
                  `/explore?unit=${encodeURIComponent(serial)}&recording=${recording}`,
                  "tiny primary",
                )
              : h("span", { class: "muted small" }, "no data set is done yet"),
          ),
        ),
      ),
    ),
    saidOnBegin(now),
  );
}

/**
 * What the instruments and their USB adapters said of themselves when the campaign began.
 * @param {Campaign} now
 */
function saidOnBegin(now) {
  const said = Object.entries(now.reported ?? {});
  if (!said.length) return null;
  return h(
    "ul",
    { class: "plain small muted", "aria-label": "Identification that the instruments reported" },
    said.map(([device, what]) =>
      h(
        "li",
        {},
        `${device}: ${Object.entries(what)
          .map(([name, value]) => `${name.replaceAll("_", " ")} ${value}`)
          .join(", ")}`,
      ),
    ),
  );
}
