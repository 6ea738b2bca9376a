// The page of live calibration: begin one, follow it, and where it led.

import { get } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { card, chip, notice, pageHeader } from "../core/components.js";
import { personText } from "../core/format.js";
import { setTrouble } from "../core/freshness/line.js";
import { show } from "../core/router.js";
import { followLive, goesOn } from "../live/live_stream.js";
import { coefficientTable, runningLive } from "../live/running.js";
import { startForm } from "../live/start_form.js";

/** @import { LiveState } from "../../../types/api.js" */
/** @import { PageContext } from "../../../types/pages.js" */

/** @param {PageContext} context */
export async function page({ query, signal }) {
  const [state, benches] = await Promise.all([get("/api/live", { signal }), get("/api/benches", { signal })]);
  const runs = goesOn(state);
  const element = h(
    "div",
    { class: "page live" },
    pageHeader(
      "Live",
      runs
        ? h(
            "span",
            { class: "row" },
            unitLink(state.serial),
            h("span", {}, state.stream),
            chip(`by ${personText(state.by)}`),
          )
        : "Calibrate a unit while you turn it.",
    ),
  );
  for (const folder of state.kept)
    element.append(
      notice(
        "warn",
        "Readings that are in no database yet: ",
        h("code", {}, `labctl import ${folder}`),
        " stores them.",
      ),
    );
  if (!runs) {
    if (state.stage !== "idle") element.append(resultCard(state));
    element.append(startForm(benches[0], query.unit));
    return element;
  }
  const { element: cards, update } = runningLive(state, signal);
  element.append(cards);
  followLive((next) => (goesOn(next) ? update(next) : show()), setTrouble, signal);
  return element;
}

/** @param {string} serial */
const unitLink = (serial) => h("a", { href: `/units/${encodeURIComponent(serial)}` }, serial);

/** @param {LiveState} state */
function resultCard({ stage, text, serial, result }) {
  const unit = encodeURIComponent(serial);
  return card(
    `Last: ${serial}`,
    h("p", { class: "row" }, chip(stage, stage === "done" ? "good" : stage === "failed" ? "bad" : "warn"), text),
    result
      ? [
          h(
            "div",
            { class: "row" },
            result.fit
              ? h(
                  "a",
                  { class: "button primary", href: `/units/${unit}` },
                  `Version ${result.fit.version} of ${serial}`,
                )
              : null,
            h("a", { class: "button", href: `/recordings/${result.recording}` }, `Recording ${result.recording}`),
          ),
          result.refused ? notice("warn", result.refused) : null,
          result.missing.length
            ? h(
                "ul",
                {},
                result.missing.map((each) => h("li", {}, each)),
              )
            : null,
          result.coefficients.length ? coefficientTable(result.coefficients) : null,
        ]
      : null,
  );
}
