// A running campaign: status bar, operator prompt, warnings, gauges and plots.

import { get } from "../core/http/api.js";
import { setChildren, h } from "../core/elements.js";
import { duration } from "../core/format.js";
import { card, cardWithHeader, notice } from "../core/components.js";
import { navigate } from "../core/router.js";
import { planChart } from "../campaigns/plan_chart.js";
import { campaignInstant, hindrances } from "../campaigns/campaign_time.js";
import { hasEnded } from "../campaigns/states.js";
import { stateChip } from "../campaigns/state_chip.js";
import { linkButton, pauseButton, resumeButton, stopButton } from "./actions.js";
import { eventList } from "./event_list.js";
import { followCampaign } from "./campaign_stream.js";
import { gauges } from "./gauges.js";
import { limitStrips } from "./limit_strips.js";
import { liveOutput } from "./live_output.js";
import { campaignHistory, remainingSeconds, appendStatus } from "./campaign_history.js";
import { operatorPrompt } from "./operator_prompt.js";
import { slowText } from "./speed_text.js";
import { turnNow } from "./turn_now.js";
import { lastDataset } from "./last_dataset.js";
import { historyPlot } from "./history_plot.js";
import { alarmSound, enterWall } from "./wall_view.js";

/** @import { Campaign, CampaignPlan } from "../../../types/api.js" */

const MAX_EVENTS = 8;
const PLAN_REFRESH_MS = 2500;
/** The service does not know the speed of simulated time in the first second of a campaign. */
const SPEED_REFRESH_MS = 2500;

/**
 * `over()` is called when the campaign has ended.
 * @param {Campaign} status
 * @param {CampaignPlan} plan
 * @param {{ signal: AbortSignal, over: () => void, wall: boolean }} page `wall`: state, readings and limits only, large
 */
export function runningCampaign(status, plan, { signal, over, wall }) {
  const { timeline } = plan;
  const history = campaignHistory(status.id);
  const bar = statusBar(status, plan);
  const [connection, prompt, speed, warningList] = [
    h("div", { "aria-live": "assertive" }),
    h("div", {}),
    h("p", { class: "small muted", hidden: true }),
    h("div", { class: "stack", "aria-live": "polite" }),
  ];
  const dials = gauges(timeline);
  const strips = limitStrips(signal);
  const sound = wall ? alarmSound(signal) : null;
  if (wall) enterWall(signal);
  let isStale = false;
  const turn = turnNow();
  const hasTable = timeline.kind.includes("home");
  const [historyFigure, outputCard, datasetCard, events] = [
    historyPlot(history),
    liveOutput(status.id),
    lastDataset(timeline, signal),
    eventList(MAX_EVENTS, "info", status),
  ];
  let [now, planned] = [status, 0];
  /** @type {string | undefined} */
  let asked;
  const picture = planChart(
    `Campaign ${status.id} plan`,
    () => ({ timeline: plan.timeline, now_s: now.t_s, live: true }),
    {
      height: "22rem",
      pick: (dataset) =>
        Object.values(now.recordings)[0] &&
        navigate(`/recordings/${Object.values(now.recordings)[0]}?dataset=${dataset}`),
    },
  );
  const setpoint = () => now.setpoint_c ?? timeline.temperature_c[Math.max((now.step ?? 1) - 1, 0)];

  /** @param {Campaign} next */
  function show(next) {
    now = next;
    bar.show(now);
    dials.set(now, setpoint());
    strips.onStatus(now);
    sound?.onStatus(now, isStale);
    appendStatus(history, now, setpoint());
    historyFigure.onStatus();
    outputCard.onStatus(now);
    turn.onStatus(now);
    datasetCard.onStatus(now);
    if (now.prompt?.id !== asked) {
      asked = now.prompt?.id;
      setChildren(prompt, now.prompt ? operatorPrompt(now.id, now.prompt, hasTable) : null);
    }
    setChildren(warningList, warnings(now));
    if (hasEnded(now)) over();
    else if (Date.now() > planned) again();
  }
  /** Reload the plan for the states of its steps. */
  async function again() {
    planned = Date.now() + PLAN_REFRESH_MS;
    try {
      plan.timeline = (await get("/api/campaigns/{campaign}/plan", { path: { campaign: status.id }, signal })).timeline;
      picture.redraw();
    } catch {
      // the event stream reports a silent service
    }
  }
  /** Say at which speed simulated time runs, where that is not the one that was asked for. */
  async function showSpeed() {
    if (document.hidden) return;
    try {
      const [bench] = await get("/api/benches", { signal });
      speed.textContent = bench ? slowText(bench) : "";
      speed.hidden = !speed.textContent;
    } catch {
      // the event stream reports a silent service
    }
  }
  show(status);
  if (status.simulated_time) {
    showSpeed();
    const timer = setInterval(showSpeed, SPEED_REFRESH_MS);
    signal.addEventListener("abort", () => clearInterval(timer));
  }
  followCampaign(
    status.id,
    {
      progress: show,
      event: (event) => events.add(event),
      link: ({ stale, since, why }) => {
        bar.classList.toggle("stale", stale);
        isStale = stale;
        sound?.onStatus(now, stale);
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
                `The values on this page may be out of date: ${why}. The page retries every few seconds.`,
              )
            : null,
        );
      },
    },
    signal,
  );
  if (wall) {
    const leave = h("div", { class: "row wall-actions" }, sound, linkButton("Leave this view", "/bench", "tiny"));
    return [bar, connection, leave, warningList, dials, strips, prompt, turn];
  }
  return [
    bar,
    speed,
    connection,
    prompt,
    turn,
    warningList,
    dials,
    strips,
    h(
      "div",
      { class: "columns", style: "--column-min: 26rem" },
      card("Rate and temperatures", historyFigure),
      outputCard,
    ),
    cardWithHeader("Plan", linkButton(`Campaign ${status.id}`, `/campaigns/${status.id}`, "tiny"), picture),
    datasetCard,
    cardWithHeader(
      "Last events",
      linkButton("All of them", `/campaigns/${status.id}?level=info#events`, "tiny"),
      events,
    ),
  ];
}

/**
 * @param {Campaign} status
 * @param {CampaignPlan} plan
 */
function statusBar(status, plan) {
  const [state, text, beside, acts] = [
    h("span", {}),
    h("strong", { class: "status-bar-step" }),
    h("span", { class: "muted small" }),
    h("div", { class: "row tight" }),
  ];
  const bar = h("i", {});
  const meter = h(
    "div",
    {
      class: "meter thick",
      role: "progressbar",
      "aria-label": "Progress of the campaign",
      "aria-valuemin": "0",
      "aria-valuemax": "100",
    },
    bar,
  );
  const stop = stopButton(status.id);
  /** @type {string | null} */
  let mode = null;
  const element = h(
    "section",
    { class: "card status-bar", "aria-label": "What the bench is doing" },
    h(
      "div",
      { class: "status-bar-line" },
      h("div", { class: "row" }, state, text),
      h("div", { class: "row tight status-bar-actions" }, acts, stop),
    ),
    meter,
    beside,
  );
  /** @param {Campaign} now */
  const show = (now) => {
    setChildren(state, stateChip(now));
    setChildren(text, now.step_text || "About to begin");
    bar.style.width = `${(100 * now.progress).toFixed(2)}%`;
    meter.setAttribute("aria-valuenow", String(Math.round(100 * now.progress)));
    setChildren(
      beside,
      `Step ${now.step ?? "–"} of ${now.steps}, ${(100 * now.progress).toFixed(1)} %. `,
      now.expected_end
        ? `${duration(remainingSeconds(now, plan.expected_s))} left, end ${campaignInstant(now, now.expected_end)}.`
        : "",
      now.wish === "pause"
        ? h("strong", {}, " Pauses after this data set.")
        : now.wish === "abort"
          ? h("strong", {}, " Stops now.")
          : null,
    );
    const wanted = now.state === "paused" || now.wish === "pause" ? "resume" : "pause";
    if (wanted !== mode) setChildren(acts, wanted === "resume" ? resumeButton(now.id) : pauseButton(now.id));
    mode = wanted;
  };
  return Object.assign(element, { show });
}

/**
 * Notices for links that fail, dropped units, a pause and the last fault; empty when there are none.
 * @param {Campaign} now
 */
function warnings(now) {
  /**
   * @param {Record<string, string>} found
   * @param {string} text
   */
  const listed = (found, text) =>
    Object.entries(found).map(([name, why]) => notice("warn", h("strong", {}, `${name} `), `${text}: ${why}`));
  return [
    ...listed(now.links, "does not answer normally"),
    ...listed(now.dropped, "is excluded from the rest of the campaign"),
    ...hindrances(now).map((text) => notice("warn", text)),
    now.state === "paused" ? notice("warn", `Paused: ${now.reason || "no reason given"}.`) : null,
    now.last_error ? notice("bad", h("strong", {}, "Last fault: "), now.last_error) : null,
  ].filter(Boolean);
}
