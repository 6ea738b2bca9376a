// Start form: start now, at a time, on a cron line, or in simulation alone.

import { post } from "../core/http/api.js";
import { isAbort, messageOf } from "../core/http/errors.js";
import { setChildren, h } from "../core/elements.js";
import { instant } from "../core/format.js";
import { actButton, card, notice, readOnlyNote, toast } from "../core/components.js";
import { labelledField, toggleGroup } from "../core/fields.js";
import { NO_BENCH } from "../core/no_bench.js";
import { navigate } from "../core/router.js";
import { askBenchClear } from "../bench/actions.js";
import { attendanceNotice, wallText } from "./attendance.js";

/** @import { Child } from "../../../types/pages.js" */

/** @import { Attendance, Bench } from "../../../types/api.js" */

const LOCAL_TIME_ZONE = Intl.DateTimeFormat().resolvedOptions().timeZone;
/** @typedef {"now" | "at" | "cron" | "simulation"} When */
/** @typedef {{ recipe: string, clip: boolean, hide: string[] }} Order */

const HOUR_S = 3600;

/**
 * `order()` returns the chosen {recipe, clip, hide}; `bench` is the bench of the service, or null. `look()` of the element
 * says again when the plan needs a person.
 * @param {Bench | null} bench
 * @param {() => Order} order
 */
export function startForm(bench, order) {
  /** @type {[When, string][]} */
  const onBench = [
    ["now", "Now"],
    ["at", "At a time"],
    ["cron", "Repeatedly"],
  ];
  /** @type {[When, string][]} */
  const when = [...(bench ? onBench : []), ["simulation", "In simulation, without a bench"]];
  const place = h("div", { class: "stack" });
  let chosen = when[0][0];
  const at = h("input", { type: "datetime-local" });
  const cron = h("input", { type: "text", value: "0 20 * * FRI", spellcheck: "false" });
  const zone = h("input", { type: "text", value: LOCAL_TIME_ZONE, spellcheck: "false", list: "zones" });
  const zones = h(
    "datalist",
    { id: "zones" },
    (Intl.supportedValuesOf?.("timeZone") ?? []).map((value) => h("option", { value })),
  );
  const priority = h("input", { type: "number", value: "0", min: "-100", max: "100", step: "1" });
  const late = h("input", {
    type: "number",
    min: "0",
    step: "any",
    placeholder: bench?.simulated === false ? "1" : "any time",
  });
  const seed = h("input", { type: "number", value: "1", min: "0", step: "1" });

  const attended = h("div", { "aria-live": "polite" });
  let asked = new AbortController();
  const timeOfStart = () => (chosen === "at" ? { at: at.value } : chosen === "cron" ? { cron: cron.value } : {});

  /** Ask when this start would need a person; only a bench without a unit handler needs one. */
  async function look() {
    asked.abort();
    asked = new AbortController();
    setChildren(attended);
    if (!bench || bench.simulated || chosen === "simulation" || (chosen === "at" && !at.value)) return;
    const { hide, ...rest } = order();
    try {
      const answer = await post("/api/plans", {
        body: { ...rest, ...timeOfStart(), ...(chosen === "now" ? {} : { time_zone: zone.value || null }) },
        signal: asked.signal,
      });
      setChildren(attended, attendanceNotice(answer.attendance, propose));
    } catch (error) {
      if (!isAbort(error)) setChildren(attended, notice("", messageOf(error)));
    }
  }
  /** @param {Attendance} attendance */
  function propose(attendance) {
    [at.value, zone.value] = [wallText(attendance.better_start ?? ""), attendance.time_zone];
    group.querySelectorAll("button")[when.findIndex(([each]) => each === "at")].click();
  }
  for (const input of [at, cron, zone]) input.addEventListener("change", look);

  /** @param {Bench} there */
  async function now(there) {
    const clear = await askBenchClear(there);
    if (!clear) return;
    const made = await post("/api/campaigns", { body: { ...order(), ...clear } });
    toast("good", `Campaign ${made.id} begins.`);
    await navigate("/bench");
  }
  async function later() {
    if (chosen === "at" && !at.value) throw new Error("Enter a time or a cron line.");
    const clear = bench && (await askBenchClear(bench, { later: true }));
    if (!clear) return;
    const made = await post("/api/campaigns", {
      body: {
        ...order(),
        ...clear,
        ...timeOfStart(),
        time_zone: zone.value || null,
        priority: Number(priority.value),
        ...(late.value === "" ? {} : { late_limit_s: Number(late.value) * HOUR_S }),
      },
    });
    toast("good", `It begins ${instant("due_at" in made ? made.due_at : null)}, your time.`);
    await navigate("/campaigns");
  }
  async function simulated() {
    const made = await post("/api/recordings/simulated", { body: { ...order(), seed: Number(seed.value) } });
    toast("good", `Recording ${made.recording} of the simulated unit ${made.serial}: ${made.datasets} data sets.`);
    await navigate(`/explore?unit=${encodeURIComponent(made.serial)}&recording=${made.recording}`);
  }
  /** @param {Bench} there */
  const startNow = (there) => [
    there.unconfirmed
      ? notice("bad", "The bench was not confirmed safe: ", h("a", { href: "/bench" }, "inspect it first"), ".")
      : there.campaign
        ? notice(
            "warn",
            `Campaign ${there.campaign} is running on ${there.name} and must end first. A scheduled start waits for the end of that campaign.`,
          )
        : null,
    h(
      "div",
      { class: "row" },
      actButton(`Start on ${there.name}`, () => now(there), { kind: "primary large" }),
    ),
  ];
  /** @param {Child} time the field of when it begins */
  const scheduled = (time) => [
    h(
      "div",
      { class: "row", style: "align-items: start" },
      time,
      labelledField("Time zone", zone),
      labelledField(
        "Priority",
        priority,
        "When several starts are due, the one with the highest priority begins first.",
      ),
      labelledField(
        "May be late by, h",
        late,
        "If the campaign cannot begin within this time, the start is skipped. Empty: no limit; after any number of missed starts, one campaign begins as soon as it can.",
      ),
      zones,
    ),
    h("div", { class: "row" }, actButton("Add to the schedule", later, { kind: "primary large" })),
  ];
  /** @type {Record<When, () => Child>} */
  const FORMS = {
    now: () => (bench ? startNow(bench) : null),
    at: () => scheduled(labelledField("Begin at", at)),
    cron: () => scheduled(labelledField("Cron line", cron, "minute hour day month weekday")),
    simulation: () => [
      h(
        "p",
        { class: "muted" },
        "Simulates a recording of this plan by a simulated unit, and imports it immediately. No bench moves, no real unit is measured, and no campaign is stored.",
      ),
      labelledField("Seed", seed, "Seed of the random numbers; the same seed gives the same recording."),
      h("div", { class: "row" }, actButton("Simulate the recording", simulated, { kind: "primary large" })),
    ],
  };
  const show = () => setChildren(place, FORMS[chosen]());
  show();
  const group = toggleGroup("When", when, chosen, (value) => {
    chosen = value;
    show();
    look();
  });
  const element = card(
    "Begin",
    readOnlyNote("A campaign is planned here and begun elsewhere"),
    h(
      "div",
      { class: "stack act" },
      bench ? null : notice("", `${NO_BENCH}; a campaign that is planned here can be simulated.`),
      h("div", {}, group),
      attended,
      place,
    ),
  );
  element.classList.add("screen-only");
  return Object.assign(element, { id: "begin", look });
}
