// The bench page: the running campaign, or what ran last and what comes next.

import { get } from "../core/http/api.js";
import { Problem } from "../core/http/errors.js";
import { h } from "../core/elements.js";
import { card, chip, pageHeader, notice } from "../core/components.js";
import { setTrouble } from "../core/freshness/line.js";
import { show } from "../core/router.js";
import { clearButton, linkButton } from "../bench/actions.js";
import { campaignInstant } from "../campaigns/campaign_time.js";
import { checkCard } from "../bench/check_card.js";
import { otherBenches } from "../bench/driver_text.js";
import { idleBench, noBenchCard } from "../bench/idle_bench.js";
import { runningCampaign } from "../bench/running_campaign.js";
import { enterWall } from "../bench/wall_view.js";
import { canResume, isRunning } from "../campaigns/states.js";

/** @import { BenchStatus } from "../../../types/api.js" */

/** @import { PageContext } from "../../../types/pages.js" */

const POLL_MS = 5000;
const AFTER_END_MS = 1500;
/** Campaigns among which the last one on this bench is looked for. */
const NEWEST = 50;

/** @param {PageContext} context */
export async function page({ query, signal }) {
  const [benches, states, campaigns, schedule] = await Promise.all([
    get("/api/benches", { signal }),
    get("/api/benches/status", { signal }),
    get("/api/campaigns", { query: { limit: NEWEST }, signal }),
    get("/api/schedule", { signal }),
  ]);
  const bench = benches[0];
  if (!bench)
    return h(
      "div",
      { class: "page" },
      pageHeader("Bench", null, linkButton("Reference standards", "/standards", "tiny")),
      noBenchCard(),
      othersCard(states, undefined),
    );
  const now = bench.campaign
    ? await get("/api/campaigns/{campaign}", { path: { campaign: bench.campaign }, signal })
    : campaigns.find((campaign) => campaign.bench === bench.name && isRunning(campaign));
  /** @param {{ serial: string }} each */
  const unit = (each) => h("a", { href: `/units/${encodeURIComponent(each.serial)}` }, each.serial);
  const element = h(
    "div",
    { class: "page bench", "data-source": now ? `bench ${bench.name}, campaign ${now.id}` : `bench ${bench.name}` },
    pageHeader(
      query.wall === "1" ? `Bench ${bench.name}` : "Bench", // on a wall the name is read from afar
      h(
        "span",
        { class: "row" },
        query.wall === "1" ? null : h("strong", {}, bench.name),
        bench.simulated ? chip("simulated", "accent") : null,
        h(
          "span",
          {},
          "with ",
          bench.units.flatMap((each, k) => (k ? [", ", unit(each)] : [unit(each)])),
        ),
        now
          ? h("span", {}, "runs ", h("a", { href: `/campaigns/${now.id}` }, `campaign ${now.id}`), `, ${now.recipe}`)
          : null,
      ),
      query.wall === "1" ? null : linkButton("Reference standards", "/standards", "tiny"),
      query.wall === "1" ? null : linkButton("Wall view", "/bench?wall=1", "tiny"),
    ),
  );
  const unsafe = states.filter((each) => each.unconfirmed);
  for (const each of unsafe) element.append(unconfirmedNotice(each, each.name === bench.name && bench.simulated));
  if (now) {
    const plan = await get("/api/campaigns/{campaign}/plan", { path: { campaign: now.id }, signal });
    element.append(
      ...runningCampaign(now, plan, {
        signal,
        over: () => setTimeout(() => signal.aborted || show(), AFTER_END_MS),
        wall: query.wall === "1",
      }),
    );
  } else {
    const last = campaigns.find((campaign) => campaign.bench === bench.name);
    const whole =
      last && canResume(last) ? await get("/api/campaigns/{campaign}", { path: { campaign: last.id }, signal }) : last;
    element.append(
      idleBench(
        bench,
        whole,
        schedule.find((each) => each.bench === bench.name && each.state === "waiting"),
      ),
    );
    if (query.wall === "1") {
      enterWall(signal); // it stays a wall from one campaign to the next
      element.append(h("div", { class: "row wall-actions" }, linkButton("Leave this view", "/bench", "tiny")));
    } else element.append(checkCard(bench, !bench.unconfirmed, show));
    watchForChange(Boolean(bench.unconfirmed), signal);
  }
  if (query.wall !== "1") element.append(...[othersCard(states, bench.name)].filter((each) => each !== null));
  return element;
}

/**
 * The other benches of a database that several services share, each with the service that drives it.
 * @param {BenchStatus[]} states
 * @param {string | undefined} own
 */
function othersCard(states, own) {
  const lines = otherBenches(states, own);
  if (!lines.length) return null;
  return card(
    "Other benches of this database",
    h(
      "ul",
      { class: "plain" },
      lines.map(({ name, text, isFault }) =>
        h("li", {}, h("strong", {}, name), isFault ? [" ", chip("no service", "bad")] : null, `: ${text}`),
      ),
    ),
  );
}

/**
 * While no campaign runs, poll for one that the schedule or another person has started, and for the safe state.
 * @param {boolean} unconfirmed
 * @param {AbortSignal} signal
 */
function watchForChange(unconfirmed, signal) {
  const looking = setInterval(async () => {
    try {
      const [bench] = await get("/api/benches", { signal });
      setTrouble();
      if (bench?.campaign || Boolean(bench?.unconfirmed) !== unconfirmed) show();
    } catch (error) {
      if (error instanceof Problem) setTrouble(error.message); // a silent service is seen by the head of the page
    }
  }, POLL_MS);
  signal.addEventListener("abort", () => clearInterval(looking));
  window.addEventListener("labctl:fresh", () => show(), { signal });
}

/**
 * @param {BenchStatus} bench
 * @param {boolean} simulated_time
 */
function unconfirmedNotice(bench, simulated_time) {
  return notice(
    "bad",
    h("p", { class: "lead" }, `Bench ${bench.name} was not confirmed safe`),
    h(
      "p",
      {},
      `${bench.unconfirmed}${bench.unconfirmed_at ? ` (${campaignInstant({ simulated_time }, bench.unconfirmed_at)})` : ""}. Inspect the bench and confirm it here; no campaign starts until a person has confirmed.`,
    ),
    bench.attempts
      ? h(
          "p",
          {},
          bench.confirmed_at
            ? `labctl confirmed the safe state at ${campaignInstant({ simulated_time }, bench.confirmed_at)}, at attempt ${bench.attempts}. Inspect the bench nevertheless before you clear it.`
            : `labctl tried ${bench.attempts} more times to set the safe state, last at ${campaignInstant({ simulated_time }, bench.attempted_at)}, and tries again every 30 s.`,
        )
      : null,
    h("div", { class: "row" }, clearButton(bench.name, show)),
  );
}
