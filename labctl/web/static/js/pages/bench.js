// The bench page: the running campaign, or what ran last and what comes next.

import { get } from "../core/api.js";
import { h } from "../core/elements.js";
import { instant } from "../core/format.js";
import { chip, pageHeader, notice } from "../core/components.js";
import { show } from "../core/router.js";
import { clearButton } from "../bench/actions.js";
import { idleBench, noBenchCard } from "../bench/idle_bench.js";
import { runningCampaign } from "../bench/running_campaign.js";
import { isRunning } from "../campaigns/states.js";

const POLL_MS = 5000;
const AFTER_END_MS = 1500;

export async function page({ signal }) {
  const [benches, states, campaigns, schedule] = await Promise.all(["/api/benches", "/api/benches/status", "/api/campaigns", "/api/schedule"].map((path) => get(path, { signal })));
  const bench = benches[0];
  if (!bench) return h("div", { class: "page" }, pageHeader("Bench"), noBenchCard());
  const now = campaigns.find((campaign) => campaign.id === bench.campaign) ?? campaigns.find((campaign) => campaign.bench === bench.name && isRunning(campaign));
  const unit = (each) => h("a", { href: `/units/${encodeURIComponent(each.serial)}` }, each.serial);
  const element = h("div", { class: "page bench" },
    pageHeader("Bench", h("span", { class: "row" }, h("strong", {}, bench.name), bench.simulated ? chip("simulated", "accent") : null, h("span", {}, "with ", bench.units.flatMap((each, k) => (k ? [", ", unit(each)] : [unit(each)]))), now ? h("span", {}, "runs ", h("a", { href: `/campaigns/${now.id}` }, `campaign ${now.id}`), `, ${now.recipe}`) : null)));
  const unsafe = states.filter((each) => each.unconfirmed);
  for (const each of unsafe) element.append(unconfirmedNotice(each));
  if (now) {
    const plan = await get(`/api/campaigns/${now.id}/plan`, { signal });
    element.append(...runningCampaign(now, plan, bench, { signal, over: () => setTimeout(() => signal.aborted || show(), AFTER_END_MS) }));
  } else {
    element.append(idleBench(bench, campaigns.find((campaign) => campaign.bench === bench.name), schedule.find((each) => each.bench === bench.name)));
    watchForStart(signal);
  }
  return element;
}

/** While no campaign runs, poll for one that the schedule or another person has started. */
function watchForStart(signal) {
  const looking = setInterval(async () => {
    try {
      const [bench] = await get("/api/benches", { signal });
      if (bench?.campaign) show();
    } catch {
      // polled again soon; the page shows nothing that could be out of date
    }
  }, POLL_MS);
  signal.addEventListener("abort", () => clearInterval(looking));
}

function unconfirmedNotice(bench) {
  return notice("bad", h("p", { class: "lead" }, `Bench ${bench.name} was not confirmed safe`),
    h("p", {}, `${bench.unconfirmed}${bench.unconfirmed_at ? ` (${instant(bench.unconfirmed_at)})` : ""}. Go and look at it; no campaign starts before somebody has.`),
    bench.attempts ? h("p", {}, bench.confirmed_at ? `labctl confirmed the safe state at ${instant(bench.confirmed_at)}, at attempt ${bench.attempts}. Look all the same before you clear it.` : `The safe state was tried again ${bench.attempts} times, last at ${instant(bench.attempted_at)}; it is tried every 30 s.`) : null,
    h("div", { class: "row" }, clearButton(bench.name, show)));
}
