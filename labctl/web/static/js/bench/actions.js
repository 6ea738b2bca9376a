// Buttons that act on a campaign or a bench. Each asks for the operator's name, and for a reason where one is recorded.

import { get, post } from "../core/api.js";
import { h } from "../core/elements.js";
import { button, dialog, toast } from "../core/components.js";
import { navigate } from "../core/router.js";
import { canResume } from "../campaigns/states.js";

const OPERATOR_NAME_KEY = "labctl.who";
const operatorNameField = () => ({
  name: "by",
  label: "Your name",
  value: localStorage.getItem(OPERATOR_NAME_KEY) ?? "",
});

async function askOperator(title, fields, options) {
  const answers = await dialog(title, fields, options);
  if (answers?.by) localStorage.setItem(OPERATOR_NAME_KEY, answers.by);
  return answers;
}

const postAction = (id, name, body) => post(`/api/campaigns/${id}/${name}`, body);

/** Safe stop: the campaign ends now, table at rest, chamber at its safe set point. */
export const stopButton = (id) =>
  Object.assign(
    button(
      "Safe stop",
      async () => {
        const answers = await askOperator(
          "Stop now and leave the bench safe?",
          [
            { ...operatorNameField(), required: false },
            { name: "reason", label: "Why", value: "stopped by hand", hint: "It is written beside the campaign." },
          ],
          {
            text: "The table comes to rest, the chamber goes to its safe set point, the campaign ends. What was measured is kept, and the campaign can be resumed.",
            confirm: "Stop now",
            kind: "danger",
          },
        );
        if (!answers) return;
        const answer = await postAction(id, "abort", answers);
        const unsafe = (await get("/api/benches")).find((bench) => bench.unconfirmed);
        if (answer.state !== "aborted") toast("bad", `The campaign is ${answer.state}: ${answer.reason}`);
        else if (unsafe) toast("bad", `Stopped, but the safe state was not confirmed: ${unsafe.unconfirmed}`);
        else toast("good", "Stopped. The bench is in its safe state.");
      },
      { kind: "danger large" },
    ),
    { title: "End the campaign now, in the safe state" },
  );

export const pauseButton = (id) =>
  button("Pause", async () => {
    const answers = await askOperator(
      "Pause after the present data set?",
      [operatorNameField(), { name: "reason", label: "Why" }],
      { confirm: "Pause" },
    );
    if (answers) await postAction(id, "pause", answers);
  });

/**
 * Ask who confirms that a real bench is clear; with `later` that it will be when the campaign begins. Returns the keys of
 * the request, nothing for a simulated bench, and null when the dialog was cancelled.
 */
export async function askBenchClear(bench, { later = false } = {}) {
  const questions = Object.entries(bench.start_questions ?? {});
  if (!questions.length) return {};
  const answers = await askOperator(
    `${bench.name} is a real bench: ${later ? "will it be clear then" : "is it clear"}?`,
    [operatorNameField(), ...questions.map(([name, label]) => ({ name, label, type: "checkbox" }))],
    {
      text: later
        ? "The table turns and the chamber heats and cools when the campaign begins, without asking again. Tick what you make sure of for that time."
        : "The table turns and the chamber heats and cools as soon as you start. Look at the bench, then tick what you have seen.",
      confirm: later ? "I make sure of it" : "Start now",
    },
  );
  return (
    answers && { confirmed_by: answers.by, checks: questions.map(([name]) => name).filter((name) => answers[name]) }
  );
}

/** The button that resumes an ended or interrupted campaign, and beside it why it may not, or what speaks against it. */
export function resumeControl(campaign) {
  if (!canResume(campaign)) return [];
  const { resumable, resume_reason: reason } = campaign;
  if (resumable === false)
    return [
      h("button", { type: "button", class: "button", disabled: true, title: reason }, "Resume where it was"),
      h("span", { class: "small muted" }, `Cannot be resumed now: ${reason}.`),
    ];
  return [
    resumeButton(campaign.id, { whole: true, kind: reason ? "" : "primary" }),
    reason ? h("span", { class: "small warn-text" }, `Look first: ${reason}.`) : null,
  ];
}

/** Continue a paused campaign, or with `whole` resume one that had ended or was interrupted. */
export const resumeButton = (id, { whole = false, kind = "primary" } = {}) =>
  button(
    whole ? "Resume where it was" : "Go on",
    async () => {
      const answers = await askOperator(
        whole ? "Take the campaign up where it was?" : "Go on with the campaign?",
        [operatorNameField(), { name: "reason", label: "Why", required: false }],
        {
          text: whole
            ? "First the safe state, then home, temperature and soak again; the first incomplete data set is measured anew."
            : null,
          confirm: whole ? "Resume" : "Go on",
        },
      );
      if (!answers) return;
      await postAction(id, "resume", { by: answers.by, reason: answers.reason });
      toast("good", whole ? `Campaign ${id} is taken up.` : "It goes on.");
      if (whole) await navigate("/bench");
    },
    { kind },
  );

/** Buttons that answer the open prompt: done, or cannot be done. */
export const answerButtons = (id, prompt) => [
  button(
    "Done",
    async () => {
      const answers = await askOperator("Is it done?", [operatorNameField()], {
        text: prompt.text,
        confirm: "It is done",
      });
      if (answers) await postAction(id, "confirm", { prompt: prompt.id, by: answers.by, confirmed: true });
    },
    { kind: "primary" },
  ),
  button("Cannot be done", async () => {
    const answers = await askOperator("It cannot be done?", [operatorNameField(), { name: "reason", label: "Why" }], {
      text: "The campaign ends, in the safe state.",
      confirm: "It cannot be done",
      kind: "danger",
    });
    if (answers)
      await postAction(id, "confirm", { prompt: prompt.id, by: answers.by, reason: answers.reason, confirmed: false });
  }),
];

/** Confirm by inspection that a bench is safe whose safe state was not confirmed. */
export const clearButton = (bench, then) =>
  button(
    "I have looked, it is safe",
    async () => {
      const answers = await askOperator(
        `Is bench ${bench} safe?`,
        [operatorNameField(), { name: "reason", label: "What you saw", value: "looked at the bench" }],
        { confirm: "It is safe" },
      );
      if (!answers) return;
      await post(`/api/benches/${encodeURIComponent(bench)}/clear`, answers);
      toast("good", `Bench ${bench} may be used again.`);
      then();
    },
    { kind: "primary" },
  );

export const linkButton = (text, href, kind = "") => h("a", { class: `button ${kind}`, href }, text);
