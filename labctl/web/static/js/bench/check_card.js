// The last check of the bench as a picture: each port, the wire from it, the instrument at its end, and what was found.

import { post } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { count, instant } from "../core/format.js";
import { actButton, cardWithHeader, chip } from "../core/components.js";
import { STATE_KINDS, STATE_WORDS, summaryOf } from "./check_text.js";

/** @import { Bench, BenchCheck, DeviceCheck } from "../../../types/api.js" */

/**
 * @param {Bench} bench
 * @param {boolean} free whether it may be checked now
 * @param {() => void} again shows the page again
 */
export function checkCard(bench, free, again) {
  const act = actButton(
    "Check the bench",
    async () => {
      await post("/api/benches/{bench}/check", { path: { bench: bench.name }, body: {} });
      again();
    },
    { done: "Checked" },
  );
  act.disabled = !free;
  return cardWithHeader(
    "Check of the bench",
    h("span", { class: "row" }, act),
    bench.check
      ? checkPicture(bench.check)
      : h(
          "p",
          { class: "muted" },
          "The bench was not checked since the service was started. A check queries every port and instrument; nothing moves.",
        ),
  );
}

/** @param {BenchCheck} check */
export function checkPicture(check) {
  return h(
    "div",
    { class: "stack" },
    h("p", {}, summaryOf(check), " ", h("span", { class: "muted" }, `Checked ${instant(check.checked_at)}.`)),
    h("ul", { class: "plain wiring", "aria-label": "What was found on each port" }, check.devices.map(device)),
  );
}

/** @param {DeviceCheck} each */
function device(each) {
  const said = Object.entries(each.reported).map(([name, value]) => `${name.replaceAll("_", " ")} ${value}`);
  return h(
    "li",
    { class: `wiring-row ${STATE_KINDS[each.state]}`, "data-device": each.device, "data-state": each.state },
    h("span", { class: "wiring-port small" }, each.address, each.reported.adapter ? ` · ${each.reported.adapter}` : ""),
    h("span", { class: "wiring-wire", "aria-hidden": "true" }),
    h(
      "div",
      { class: "wiring-device" },
      h(
        "div",
        { class: "row space-between" },
        h("strong", {}, each.device),
        chip(STATE_WORDS[each.state], STATE_KINDS[each.state]),
      ),
      h("div", { class: "muted small" }, [each.driver, ...said].join(" · ")),
      h(
        "ul",
        { class: "plain small" },
        each.findings
          .filter((finding) => finding.state !== "good")
          .map((finding) => h("li", { class: `finding ${STATE_KINDS[finding.state]}` }, finding.text)),
      ),
      h(
        "details",
        {},
        h("summary", { class: "small" }, `${count(each.findings.filter(isGood).length)} things found in order`),
        h(
          "ul",
          { class: "plain small" },
          each.findings.filter(isGood).map((finding) => h("li", { class: "finding good" }, finding.text)),
        ),
      ),
    ),
  );
}

/** @param {{ state: string }} finding */
const isGood = (finding) => finding.state === "good";
