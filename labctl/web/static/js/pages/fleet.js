// The page of all types of units, and of one type.

import { busyIndicator, emptyState, notice, pageHeader } from "../core/components.js";
import { h } from "../core/elements.js";
import { count } from "../core/format.js";
import { get } from "../core/http/api.js";
import { isAbort, messageOf } from "../core/http/errors.js";
import { chartCard } from "../fleet/chart.js";
import { jobsCard } from "../fleet/jobs.js";
import { reportCards } from "../fleet/report_card.js";
import { typeCard } from "../fleet/type_card.js";

/** @import { FleetType } from "../../../types/api.js" */
/** @import { PageContext } from "../../../types/pages.js" */

/** Types that are shown at first, those with the most units. */
const SHOWN = 24;

/** @param {PageContext} context */
export async function page({ query, signal }) {
  const types = await get("/api/fleet/types", { query: { type: query.type ?? "" }, signal });
  if (!types.length)
    return h(
      "div",
      { class: "page" },
      pageHeader("Fleet"),
      emptyState(
        h("p", {}, query.type ? `No unit is of type ${query.type}.` : "No unit has been measured or imported yet."),
        h("p", {}, h("a", { class: "button primary", href: query.type ? "/fleet" : "/start" }, "Begin")),
      ),
    );
  if (query.type !== undefined || types.length === 1) return typePage(types[0], signal);
  return allTypes(types, signal);
}

/**
 * @param {readonly FleetType[]} types
 * @param {AbortSignal} signal
 */
async function allTypes(types, signal) {
  const most = [...types].sort((a, b) => b.units - a.units).slice(0, SHOWN);
  return h(
    "div",
    { class: "page" },
    pageHeader("Fleet", "Units by type: how good, how judged, when due."),
    most.map((each) => typeCard(each, true)),
    await jobsCard(signal),
    types.length > SHOWN
      ? h(
          "p",
          { class: "muted" },
          `The ${SHOWN} types with the most units of ${count(types.length)}; add ?type=NAME to the address for another.`,
        )
      : null,
  );
}

/**
 * @param {FleetType} figures
 * @param {AbortSignal} signal
 */
async function typePage(figures, signal) {
  const report = h("div", { class: "page" }, busyIndicator("Comparing the units …"));
  loadReport(figures.type, report, signal);
  return h(
    "div",
    { class: "page", "data-source": `units of type ${figures.type}` },
    pageHeader(
      "Fleet",
      "What the units of a type have in common, and which differ.",
      h("a", { class: "button", href: `/units?search=${encodeURIComponent(figures.type)}` }, "List the units"),
    ),
    typeCard(figures, false),
    await chartCard(figures.type, signal),
    report,
    await jobsCard(signal),
  );
}

/**
 * @param {string} type
 * @param {HTMLElement} place
 * @param {AbortSignal} signal
 */
async function loadReport(type, place, signal) {
  try {
    const found = await get("/api/fleet/report", { query: { type }, signal });
    place.replaceChildren(...reportCards(found).filter((each) => each !== null));
  } catch (error) {
    if (!isAbort(error)) place.replaceChildren(notice("bad", messageOf(error)));
  }
}
