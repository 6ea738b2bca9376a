// A campaign while it runs: the strip that stays in view, the question that waits, and what the bench is doing.

import { get } from "../core/api.js";
import { fill, h } from "../core/elements.js";
import { duration, instant } from "../core/format.js";
import { card, headed, notice } from "../core/components.js";
import { go } from "../core/router.js";
import { planPicture } from "../campaigns/plan_chart.js";
import { stateChip } from "../campaigns/states.js";
import { link, pauseButton, resumeButton, stopButton } from "./actions.js";
import { eventList } from "./event_list.js";
import { ENDED, follow } from "./campaign_stream.js";
import { gauges } from "./gauges.js";
import { live } from "./live_output.js";
import { historyOf, left, take } from "./campaign_history.js";
import { promptCard } from "./operator_prompt.js";
import { output } from "./last_dataset.js";
import { rolling } from "./history_plot.js";

const EVENTS = 8;
const PLAN_AGAIN_MS = 2500;

/** `over()` is called when it has ended. */
export function running(status, plan, bench, { signal, over }) {
  const { timeline } = plan;
  const history = historyOf(status.id);
  const strip = stripOf(status, plan, bench);
  const [silent, question, trouble] = [h("div", { "aria-live": "assertive" }), h("div", {}), h("div", { class: "stack", "aria-live": "polite" })];
  const dials = gauges(timeline);
  const [lines, heard, sound, events] = [rolling(history), live(status.id), output(timeline, signal), eventList(EVENTS)];
  let [now, asked, planned] = [status, null, 0];
  const picture = planPicture(`Campaign ${status.id} plan`, () => ({ timeline: plan.timeline, now_s: now.t_s, live: true }), { tall: "22rem", pick: (dataset) => Object.values(now.recordings)[0] && go(`/recordings/${Object.values(now.recordings)[0]}?dataset=${dataset}`) });
  const setpoint = () => now.setpoint_c ?? timeline.temperature_c[Math.max((now.step ?? 1) - 1, 0)];

  function show(next) {
    now = next;
    strip.show(now);
    dials.set(now, setpoint());
    take(history, now, setpoint());
    lines.tell();
    heard.tell(now);
    sound.tell(now);
    if (now.prompt?.id !== asked) {
      asked = now.prompt?.id;
      fill(question, now.prompt ? promptCard(now.id, now.prompt) : null);
    }
    fill(trouble, troubles(now));
    if (ENDED.has(now.state)) over();
    else if (Date.now() > planned) again();
  }
  /** The states of the steps, asked for again while they change. */
  async function again() {
    planned = Date.now() + PLAN_AGAIN_MS;
    try {
      plan.timeline = (await get(`/api/campaigns/${status.id}/plan`, { signal })).timeline;
      picture.redraw();
    } catch {
      // the stream says that the service is silent
    }
  }
  show(status);
  follow(status.id, {
    progress: show,
    event: (event) => events.add(event),
    link: ({ stale, since, why }) => {
      strip.classList.toggle("stale", stale);
      fill(silent, stale ? notice("bad", h("strong", {}, `Nothing new since ${new Date(since).toLocaleTimeString("en-GB")}. `), `What you see may no longer be so: ${why}. Trying again.`) : null);
    },
  }, signal);
  return [strip, silent, question, trouble, dials,
    h("div", { class: "columns", style: "--least: 26rem" }, card("Rate and temperatures", lines), heard),
    headed("Plan", link(`Campaign ${status.id}`, `/campaigns/${status.id}`, "tiny"), picture),
    sound,
    headed("Last events", link("All of them", `/campaigns/${status.id}?level=info#events`, "tiny"), events)];
}

function stripOf(status, plan, bench) {
  const [state, text, beside, acts] = [h("span", {}), h("strong", { class: "strip-step" }), h("span", { class: "soft small" }), h("div", { class: "row tight" })];
  const bar = h("i", {});
  const meter = h("div", { class: "meter tall", role: "progressbar", "aria-label": "Progress of the campaign", "aria-valuemin": "0", "aria-valuemax": "100" }, bar);
  const stop = stopButton(status.id);
  let mode = null;
  const element = h("section", { class: "card strip", "aria-label": "What the bench is doing" },
    h("div", { class: "strip-line" }, h("div", { class: "row" }, state, text), h("div", { class: "row tight strip-acts" }, acts, stop)), meter, beside);
  element.show = (now) => {
    fill(state, stateChip(now));
    text.textContent = now.step_text || "About to begin";
    bar.style.width = `${(100 * now.progress).toFixed(2)}%`;
    meter.setAttribute("aria-valuenow", String(Math.round(100 * now.progress)));
    fill(beside, `Step ${now.step ?? "–"} of ${now.steps}, ${(100 * now.progress).toFixed(1)} %. `,
      now.expected_end ? `${duration(left(now, plan.expected_s))} left, end ${instant(now.expected_end)}` : "", now.expected_end && bench.simulated ? h("span", { class: "wide-only" }, " on the simulated bench's own clock") : "", now.expected_end ? "." : "",
      now.wish === "pause" ? h("strong", {}, " Pauses after this data set.") : now.wish === "abort" ? h("strong", {}, " Stops now.") : null);
    const wanted = now.state === "paused" || now.wish === "pause" ? "resume" : "pause";
    if (wanted !== mode) fill(acts, wanted === "resume" ? resumeButton(now.id) : pauseButton(now.id));
    mode = wanted;
  };
  return element;
}

/** What is not as it should be; nothing where all is well. */
function troubles(now) {
  const listed = (found, text) => Object.entries(found).map(([name, why]) => notice("warn", h("strong", {}, `${name} `), `${text}: ${why}`));
  return [...listed(now.links, "does not answer as it should"), ...listed(now.dropped, "takes no further part"),
    now.state === "paused" ? notice("warn", `Paused: ${now.reason || "no reason given"}.`) : null,
    now.last_error ? notice("bad", h("strong", {}, "Last fault: "), now.last_error) : null].filter(Boolean);
}
