// The diagnosis of a unit: experiments on the bench, one after the other, until one missing effect is left.

import { get, post } from "../core/http/api.js";
import { h, setChildren } from "../core/elements.js";
import { idText, inWords } from "../core/format.js";
import { actButton, cardWithHeader, chip, table, withCommands } from "../core/components.js";
import { dialog } from "../core/dialog.js";
import { NO_BENCH, WITH_BENCH } from "../core/no_bench.js";
import { visitSignal } from "../core/router.js";
import { askBenchClear, askingButton } from "../bench/actions.js";
import { diagnosisState, effectsOfRounds, lineOfRound, suspectColumns } from "./diagnosis_rounds.js";

/** @import { Bench, Diagnosis } from "../../../types/api.js" */

/** How often a diagnosis that goes on is read again, ms. */
const POLL_MS = 2000;

const NO_EXPERIMENT = `${NO_BENCH}, so it runs no experiment: start it with ${WITH_BENCH.real}, or with --simulate for a simulated bench.`;

/**
 * A card of the newest diagnosis, with the button that starts one, or why this service cannot; it is read again as long
 * as it goes on.
 * @param {string} serial
 * @param {readonly Diagnosis[]} diagnoses newest first
 * @param {readonly Bench[]} benches of this service
 * @param {AbortSignal} signal
 */
export function diagnosisCard(serial, diagnoses, benches, signal) {
  const place = h("div");
  const reason = cannotMeasure(serial, benches);
  /** @param {readonly Diagnosis[]} rows */
  const draw = (rows) => {
    const newest = rows[0];
    const isOpen = newest && !newest.ended;
    setChildren(
      place,
      newest ? rounds(newest) : explanation(),
      isOpen ? acts(newest, again) : reason ? h("p", { class: "muted" }, reason) : null,
    );
    setChildren(beside, isOpen || reason ? null : startButton(serial, again));
    if (isOpen && !signal.aborted) setTimeout(() => signal.aborted || again(), POLL_MS);
  };
  const beside = h("div");
  const again = async () => draw(await get("/api/units/{serial}/diagnoses", { path: { serial }, signal }));
  draw(diagnoses);
  return cardWithHeader("Diagnosis by experiments", beside, place);
}

const explanation = () =>
  h(
    "p",
    { class: "muted" },
    "Experiments on the bench, one after the other, until one missing effect is left. Nothing has been diagnosed yet.",
  );

/** @param {Diagnosis} diagnosis */
function rounds(diagnosis) {
  const { text, kind } = diagnosisState(diagnosis);
  const columns = suspectColumns(diagnosis.rounds);
  const ids = effectsOfRounds(diagnosis.rounds);
  const lines = diagnosis.rounds.map((round) => lineOfRound(round, columns, ids));
  return h(
    "div",
    { class: "stack" },
    h(
      "p",
      {},
      chip(text, kind),
      ` version ${diagnosis.version} on bench ${diagnosis.bench}, ${diagnosis.spent_hours.toFixed(1)} h of ${diagnosis.hours} h on the bench`,
    ),
    diagnosis.why ? h("p", { class: "strong" }, inWords(diagnosis.why, ids)) : null,
    lines.length
      ? table(
          [
            { title: "Bench h", number: true, cell: (line) => line.hours },
            { title: "Verdict", cell: (line) => line.verdict },
            ...columns.map((effect, place) => ({
              title: idText(effect),
              number: true,
              cell: (/** @type {typeof lines[number]} */ line) => line.probabilities[place] ?? "",
            })),
          ],
          lines,
          { label: "Rounds of the diagnosis, with the probability of each suspect", dense: true },
        )
      : h("p", { class: "muted" }, "The recordings so far are being judged."),
    h(
      "ul",
      { class: "plain small" },
      lines.map(({ experiment, result }, place) =>
        h(
          "li",
          {},
          h("strong", {}, `Round ${place + 1}. `),
          experiment,
          result ? h("p", { class: "muted" }, result) : null,
        ),
      ),
    ),
    diagnosis.next ? h("p", { class: "small" }, "Next: ", withCommands(diagnosis.next)) : null,
  );
}

/**
 * @param {Diagnosis} diagnosis
 * @param {() => Promise<void>} again
 */
function acts(diagnosis, again) {
  const path = { diagnosis: diagnosis.id };
  const isHalted = diagnosis.state === "stopped" || diagnosis.state === "failed";
  return h(
    "div",
    { class: "row" },
    diagnosis.state === "awaiting_confirmation" ? confirmButtons(diagnosis, again) : null,
    isHalted
      ? askingButton("Resume", "Continue the diagnosis where it stopped?", (body) =>
          post("/api/diagnoses/{diagnosis}/resume", { path, body }).then(again),
        )
      : askingButton("Stop", "Stop the diagnosis, and abort its campaign?", (body) =>
          post("/api/diagnoses/{diagnosis}/stop", { path, body }).then(again),
        ),
    askingButton("End for good", "End the diagnosis for good?", (body) =>
      post("/api/diagnoses/{diagnosis}/end", { path, body }).then(again),
    ),
  );
}

/**
 * @param {Diagnosis} diagnosis
 * @param {() => Promise<void>} again
 */
function confirmButtons(diagnosis, again) {
  const path = { diagnosis: diagnosis.id };
  const round = diagnosis.rounds.length;
  return [
    actButton(
      "Run this experiment",
      async () => {
        const left = visitSignal();
        const bench = (await get("/api/benches", { signal: left })).find((each) => each.name === diagnosis.bench);
        const clear = bench ? await askBenchClear(bench) : null;
        if (!clear) return;
        const body = { round, by: clear.confirmed_by ?? "", confirmed: true, checks: clear.checks ?? [] };
        await post("/api/diagnoses/{diagnosis}/confirm", { path, body });
        await again();
      },
      { kind: "primary" },
    ),
    askingButton("Cannot be done", "Answer that this experiment cannot be done?", (body) =>
      post("/api/diagnoses/{diagnosis}/confirm", { path, body: { ...body, round, confirmed: false } }).then(again),
    ),
  ];
}

/**
 * Why this service cannot measure a unit; empty where it can.
 * @param {string} serial
 * @param {readonly Bench[]} benches
 */
export function cannotMeasure(serial, [bench]) {
  if (!bench) return NO_EXPERIMENT;
  const carried = bench.units.map((each) => each.serial);
  if (!carried.length || carried.includes(serial)) return "";
  return `Bench ${bench.name} carries ${carried.join(", ")}, and not ${serial}: write ${serial} into the bench file in place of a unit, and start the service again.`;
}

/**
 * @param {string} serial
 * @param {() => Promise<void>} again
 */
const startButton = (serial, again) =>
  actButton("Diagnose", async () => {
    const answers = await dialog(
      "Run experiments until one missing effect is left?",
      [{ name: "hours", label: "Hours on the bench, at most", value: "24" }],
      {
        text: "The newest version is judged by all its recordings together. On a real bench each experiment waits for your confirmation.",
        confirm: "Diagnose",
        send: ({ hours }, signal) =>
          post("/api/units/{serial}/diagnoses", { path: { serial }, body: { hours: Number(hours) }, signal }),
      },
    );
    if (answers) await again();
  });
