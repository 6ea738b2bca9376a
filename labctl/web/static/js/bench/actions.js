// Buttons that act on a campaign or a bench. Each asks for the operator's name, and for a reason where one is recorded.

import { get, post } from "../core/http/api.js";
import { messageOf } from "../core/http/errors.js";
import { h } from "../core/elements.js";
import { actButton, toast } from "../core/components.js";
import { dialog, WHO } from "../core/dialog.js";
import { navigate } from "../core/router.js";
import { stopCampaign, tableStands, unconfirmedStop } from "../core/stop/overlay.js";
import { canResume } from "../campaigns/states.js";

/** @import { Bench, Campaign, Check, Prompt } from "../../../types/api.js" */
/** @import { Field } from "../../../types/pages.js" */

const OPERATOR_NAME_KEY = "labctl.who";
const operatorNameField = () => ({
  ...WHO,
  label: "Your name",
  value: localStorage.getItem(OPERATOR_NAME_KEY) ?? "",
});

/**
 * @param {string} title
 * @param {readonly Field[]} fields
 * @param {Parameters<typeof dialog>[2]} options
 */
async function askOperator(title, fields, options) {
  const answers = await dialog(title, fields, options);
  if (answers?.by) localStorage.setItem(OPERATOR_NAME_KEY, answers.by);
  return answers;
}

/**
 * Stop a campaign, and say how the bench was left.
 * @param {number} campaign
 * @param {{ by?: string, reason: string }} body
 */
async function stop(campaign, body) {
  const { campaign: ended, late } = await stopCampaign(campaign, body);
  const stays = late || undefined; // who has read NOT STOPPED reads that this is over
  if (ended === null) {
    toast("good", "Stopped. The table stands. The service does not answer; start it again.", { stays: true });
    return;
  }
  await tableStands(ended.bench);
  const unsafe = (await get("/api/benches")).find((bench) => bench.unconfirmed);
  if (ended.state !== "aborted") toast("bad", `The campaign is ${ended.state}: ${ended.reason}`);
  else if (unsafe) toast("bad", `Stopped, but the safe state was not confirmed: ${unsafe.unconfirmed}`);
  else toast("good", "Stopped. The table stands, and the bench is in its safe state.", { stays });
}

/** Ask again for the stop that this tab had asked for, where it was not confirmed when the page was loaded again. */
export function stopAgain() {
  const asked = unconfirmedStop();
  if (asked !== null) stop(asked.campaign, asked.body).catch((error) => toast("bad", messageOf(error)));
}

/**
 * Safe stop: the campaign ends now, table at rest, chamber at its safe set point.
 * @param {number} campaign
 */
export const stopButton = (campaign) =>
  Object.assign(
    actButton(
      "Safe stop",
      async () => {
        const answers = await askOperator(
          "End the campaign now and set the bench to its safe state?",
          [
            { ...operatorNameField(), required: false },
            {
              name: "reason",
              label: "Why",
              value: "stopped by hand",
              hint: "The answer is recorded with the campaign.",
            },
          ],
          {
            text: "The table stops, the chamber goes to its safe set point, and the campaign ends. The data measured so far are stored, and the campaign can be resumed.",
            confirm: "Stop now",
            kind: "danger",
          },
        );
        if (!answers) return;
        await stop(campaign, { by: answers.by, reason: answers.reason });
      },
      { kind: "danger large" },
    ),
    { title: "End the campaign now and bring the bench to its safe state" },
  );

/**
 * A button for an act that asks a running campaign for something: it asks who wants it and why.
 * @param {string} label
 * @param {string} question
 * @param {(body: { by: string, reason: string }) => Promise<unknown>} send
 */
export const askingButton = (label, question, send) =>
  actButton(label, async () => {
    const fields = [operatorNameField(), { name: "reason", label: "Why" }];
    await askOperator(question, fields, { confirm: label, send: ({ by, reason }) => send({ by, reason }) });
  });

/** @param {number} campaign */
export const pauseButton = (campaign) =>
  askingButton("Pause", "Pause the campaign after the present data set?", (body) =>
    post("/api/campaigns/{campaign}/pause", { path: { campaign }, body }),
  );

/**
 * Ask who confirms that a real bench is clear; with `later` that it will be when the campaign begins. Returns the keys of
 * the request, nothing for a simulated bench, and null when the dialog was cancelled.
 * @param {Pick<Bench, "name" | "start_questions">} bench
 * @param {{ later?: boolean }} [options]
 * @returns {Promise<{ confirmed_by?: string, checks?: Check[] } | null>}
 */
export async function askBenchClear(bench, { later = false } = {}) {
  const questions = Object.entries(bench.start_questions ?? {});
  if (!questions.length) return {};
  const answers = await askOperator(
    `${bench.name} is a real bench: ${later ? "will it be clear then" : "is it clear"}?`,
    [operatorNameField(), ...questions.map(([name, label]) => ({ name, label, type: "checkbox" }))],
    {
      text: later
        ? "When the campaign begins, the table turns and the chamber heats and cools, and labctl does not ask again. Tick what you confirm for that time."
        : "The table turns and the chamber heats and cools as soon as you start. Inspect the bench, then tick what you have checked.",
      confirm: later ? "I confirm these points for that time" : "Start now",
    },
  );
  if (!answers) return null;
  const ticked = questions.map(([name]) => name).filter((name) => answers[name]);
  return { confirmed_by: answers.by, checks: /** @type {Check[]} */ (ticked) };
}

/**
 * The button that resumes an ended or interrupted campaign, and beside it why it may not, or what speaks against it.
 * @param {Campaign} campaign
 */
export function resumeControl(campaign) {
  if (!canResume(campaign)) return [];
  const { resumable, resume_reason: reason } = campaign;
  if (resumable === false)
    return [
      h("button", { type: "button", class: "button", disabled: true, title: reason }, "Resume where it stopped"),
      h("span", { class: "small muted" }, `Cannot be resumed now: ${reason}.`),
    ];
  return [
    resumeButton(campaign.id, { whole: true, kind: reason ? "" : "primary" }),
    reason ? h("span", { class: "small warn-text" }, `Inspect the bench first: ${reason}.`) : null,
  ];
}

/**
 * Continue a paused campaign, or with `whole` resume one that had ended or was interrupted.
 * @param {number} campaign
 * @param {{ whole?: boolean, kind?: string }} [options]
 */
export const resumeButton = (campaign, { whole = false, kind = "primary" } = {}) =>
  actButton(
    whole ? "Resume where it stopped" : "Continue",
    async () => {
      const answers = await askOperator(
        whole ? "Resume the campaign where it stopped?" : "Continue the campaign?",
        [operatorNameField(), { name: "reason", label: "Why", required: false }],
        {
          text: whole
            ? "labctl first sets the safe state, then homes the table, sets the temperature and soaks again; the first incomplete data set is measured again."
            : null,
          confirm: whole ? "Resume" : "Continue",
        },
      );
      if (!answers) return;
      const body = { by: answers.by, reason: answers.reason };
      await post("/api/campaigns/{campaign}/resume", { path: { campaign }, body });
      toast("good", whole ? `Campaign ${campaign} is resumed.` : "The campaign continues.");
      if (whole) await navigate("/bench");
    },
    { kind },
  );

/**
 * Buttons that answer the open prompt: done, or cannot be done.
 * @param {number} campaign
 * @param {Prompt} prompt
 */
export const answerButtons = (campaign, prompt) => [
  ...(prompt.kind === "turn" ? turnButtons(campaign, prompt) : [doneButton(campaign, prompt)]),
  actButton("Cannot be done", async () => {
    const answers = await askOperator(
      "Answer that this action cannot be done?",
      [operatorNameField(), { name: "reason", label: "Why" }],
      {
        text: "This ends the campaign: the table stops, and the chamber returns to its safe temperature.",
        confirm: "It cannot be done: end the campaign",
        kind: "danger",
      },
    );
    if (!answers) return;
    const body = { prompt: prompt.id, by: answers.by, reason: answers.reason, confirmed: false };
    await post("/api/campaigns/{campaign}/confirm", { path: { campaign }, body });
  }),
];

/**
 * @param {number} campaign
 * @param {Prompt} prompt
 */
const doneButton = (campaign, prompt) =>
  actButton(
    "Done",
    async () => {
      const answers = await askOperator("Is it done?", [operatorNameField()], {
        text: prompt.text,
        confirm: "It is done",
      });
      if (!answers) return;
      const body = { prompt: prompt.id, by: answers.by, confirmed: true };
      await post("/api/campaigns/{campaign}/confirm", { path: { campaign }, body });
    },
    { kind: "primary" },
  );

/**
 * A turn by hand is answered at once: a person who turns a dozen times is asked for the name only the first time.
 * @param {number} campaign
 * @param {Prompt} prompt
 */
function turnButtons(campaign, prompt) {
  /** @param {boolean} again */
  const answer = (again) => async () => {
    const by =
      localStorage.getItem(OPERATOR_NAME_KEY) ||
      (await askOperator("Who turns the unit?", [operatorNameField()], { confirm: "Answer" }))?.by;
    if (!by) return;
    const body = { prompt: prompt.id, by, confirmed: !again, again };
    await post("/api/campaigns/{campaign}/confirm", { path: { campaign }, body });
  };
  return [actButton("Done", answer(false), { kind: "primary" }), actButton("Turn again", answer(true))];
}

/**
 * Confirm by inspection that a bench is safe whose safe state was not confirmed.
 * @param {string} bench
 * @param {() => unknown} then
 */
export const clearButton = (bench, then) =>
  actButton(
    "I have inspected the bench, and it is safe",
    async () => {
      const answers = await askOperator(
        `Is bench ${bench} safe?`,
        [operatorNameField(), { name: "reason", label: "What you saw", value: "inspected the bench" }],
        { confirm: "It is safe" },
      );
      if (!answers) return;
      const body = { by: answers.by, reason: answers.reason };
      await post("/api/benches/{bench}/clear", { path: { bench }, body });
      toast("good", `Bench ${bench} may be used again.`);
      then();
    },
    { kind: "primary" },
  );

/**
 * @param {string} text
 * @param {string} href
 * @param {string} [kind]
 */
export const linkButton = (text, href, kind = "") => h("a", { class: `button ${kind}`, href }, text);
