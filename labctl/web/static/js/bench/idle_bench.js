// A bench without a running campaign: the last campaign, the next scheduled one, and how to start.

import { h, uniqueId } from "../core/elements.js";
import { percent } from "../core/format.js";
import { card, factList, notice, readOnlyNote } from "../core/components.js";
import { NO_BENCH, WITH_BENCH } from "../core/no_bench.js";
import { presentWords } from "../core/freshness/line.js";
import { adviceNotice } from "../campaigns/advice.js";
import { attendanceNotice } from "../campaigns/attendance.js";
import { instantFact, durationTaken } from "../campaigns/campaign_time.js";
import { stateKind } from "../campaigns/states.js";
import { stateChip } from "../campaigns/state_chip.js";
import { startTime } from "../campaigns/start_time.js";
import { linkButton, resumeControl } from "./actions.js";

/** @import { Bench, Campaign, Scheduled } from "../../../types/api.js" */
/** @import { Child } from "../../../types/pages.js" */

export function noBenchCard() {
  return card(
    NO_BENCH,
    readOnlyNote("No bench is driven from here"),
    h(
      "p",
      { class: "act" },
      "The service serves calibrations and imports recordings. To run a bench, start the service with one of these commands:",
    ),
    h("pre", { class: "command act" }, `${WITH_BENCH.simulated}\n${WITH_BENCH.real}`),
    h(
      "p",
      { class: "muted act" },
      "The first command runs a simulated tri-axial bench; --speed sets its speed. The second command drives the real instruments that the bench file names.",
    ),
    h(
      "div",
      { class: "row" },
      linkButton("To the recordings", "/recordings"),
      linkButton("Calibrate live", "/live", "act"),
    ),
  );
}

/**
 * A card whose heading speaks of the present, and is another one while the page is stale.
 * @param {string} fresh
 * @param {string} stale
 * @param {...Child} children
 */
function presentCard(fresh, stale, ...children) {
  const id = uniqueId("present");
  return h(
    "section",
    { class: "card stack", "aria-labelledby": id },
    h("h2", { id }, presentWords(fresh, stale)),
    ...children,
  );
}

/**
 * `next` is the next entry of the schedule, `last` the newest campaign; either may be undefined.
 * @param {Bench} bench
 * @param {Campaign | undefined} last
 * @param {Scheduled | undefined} next
 */
export function idleBench(bench, last, next) {
  return h(
    "div",
    { class: "columns", style: "--column-min: 17rem" },
    presentCard(
      "No campaign is running",
      "State of the bench",
      h(
        "p",
        {},
        bench.unconfirmed
          ? "No campaign starts until a person has inspected the bench and confirmed that it is safe."
          : bench.live
            ? presentWords(`Unit ${bench.live} is being calibrated live.`)
            : presentWords(
                `${bench.units.map((unit) => unit.serial).join(", ")} ${bench.units.length > 1 ? "are" : "is"} on the bench and free.`,
              ),
      ),
      h(
        "div",
        { class: "buttons" },
        linkButton("Plan a campaign", "/campaigns/new", "primary"),
        linkButton("All campaigns", "/campaigns"),
        linkButton("Calibrate live", "/live"),
      ),
    ),
    card(
      "Next on the schedule",
      next
        ? [
            h("p", { class: "lead" }, startTime(next)),
            h(
              "p",
              { class: "muted" },
              `${next.recipe} on ${next.bench}`,
              next.cron ? [", repeated at ", h("code", {}, next.cron)] : null,
            ),
            attendanceNotice(next.attendance),
          ]
        : h("p", { class: "muted" }, presentWords("Nothing is scheduled.")),
    ),
    last
      ? card(
          `Last: campaign ${last.id}`,
          h("div", { class: "row" }, stateChip(last), h("a", { href: `/campaigns/${last.id}` }, last.recipe)),
          factList([
            ["Ended", ...instantFact(last, last.ended_at), durationTaken(last)],
            ["Progress", percent(last.progress)],
          ]),
          adviceNotice(last) ?? (last.reason ? notice(stateKind(last), last.reason) : null),
          h(
            "div",
            { class: "row" },
            Object.entries(last.recordings).map(([serial, recording]) =>
              linkButton(`Explore ${serial}`, `/explore?unit=${encodeURIComponent(serial)}&recording=${recording}`),
            ),
            last.bench === bench.name ? resumeControl(last) : null,
          ),
        )
      : null,
  );
}
