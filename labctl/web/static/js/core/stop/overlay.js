// Asks for a stop until it is confirmed, and shows over everything that the bench is not stopped while it is not.

import { h, setChildren } from "../elements.js";
import { accessKey, get, post } from "../http/api.js";
import { Problem, messageOf } from "../http/errors.js";
import { confirms, notStopped, remembered, tableUnknown, troubleOf } from "./state.js";

/** @import { Campaign } from "../../../../types/api.js" */
/** @typedef {{ by?: string, reason: string }} Body */
/** @typedef {{ campaign: Campaign | null, late: boolean }} Stopped */

/** A request that has no answer keeps the next one no longer than this, and is given up after `GIVE_UP_MS`. */
const PATIENCE_MS = 2000;
const GIVE_UP_MS = 10_000;
const AGAIN_MS = 1000;
const DRAW_MS = 250;
const STORED = "labctl.stop";

const LOOK_MS = 2000;

/** @type {{ asked: number | null, shown: boolean, trouble: string, refused: boolean, reported: string, left: string }} */
const known = { asked: null, shown: false, trouble: "", refused: false, reported: "", left: "" };
/** Called when a person says that the table stands. */
let onSeen = () => {};
/** @type {HTMLDialogElement | null} */
let box = null;

/** @param {number} ms */
const pause = (ms) => new Promise((resolve) => setTimeout(resolve, ms));

function draw() {
  const asked_ms = known.asked === null ? null : performance.now() - known.asked;
  const found = notStopped({ ...known, asked_ms });
  known.shown = asked_ms !== null && found !== null;
  if (found === null) {
    box?.remove();
    box = null;
    return;
  }
  // a modal dialog lies over every other one that was opened before
  box ??= h("dialog", {
    class: "not-stopped",
    role: "alertdialog",
    "aria-label": found.title,
    "data-not-stopped": "",
    oncancel: (event) => event.preventDefault(),
  });
  const text = `${found.title}${found.text}`;
  if (box.dataset.text !== text) {
    box.dataset.text = text;
    const act = known.left ? seenButton() : known.refused ? keyButton() : null;
    setChildren(box, h("strong", {}, found.title), h("p", {}, found.text), act);
  }
  if (box.open) return;
  for (const other of document.querySelectorAll("dialog")) other.close(); // it would be hidden below, with its question
  document.body.append(box);
  box.showModal();
}

const seenButton = () =>
  h("button", { type: "button", class: "button large", onclick: () => onSeen() }, "I have looked: the table stands");

const keyButton = () =>
  h(
    "button",
    {
      type: "button",
      class: "button large",
      onclick: () => window.dispatchEvent(new CustomEvent("labctl:key", { detail: known.trouble })),
    },
    "Use another key",
  );

/**
 * What the service reports of a stop that is late; nothing when all is well.
 * @param {string} [text]
 */
export function reportStop(text = "") {
  known.reported = text;
  draw();
}

/**
 * Ask once; resolves to the answer. A service that has `heard` of the stop is only asked how far it is.
 * @param {number} campaign
 * @param {Body} body
 * @param {boolean} heard
 */
async function ask(campaign, body, heard) {
  const [path, signal] = [{ campaign }, AbortSignal.timeout(GIVE_UP_MS)];
  try {
    if (heard) return await get("/api/campaigns/{campaign}", { path, signal });
    return await post("/api/campaigns/{campaign}/abort", { path, body, signal });
  } catch (error) {
    if (error instanceof Problem && error.status === 409)
      return await get("/api/campaigns/{campaign}", { path, signal }); // it does not run: has it ended?
    throw error;
  }
}

/** @param {unknown} error */
function fail(error) {
  const status = error instanceof Problem ? error.status : undefined;
  known.refused = status === 401 || status === 403;
  known.trouble = troubleOf({ status, detail: messageOf(error) });
  draw();
}

/**
 * Stop a campaign: asks until it is confirmed that the table stands, whatever answers, also when the page is loaded
 * again. Resolves to the campaign, null where only the page in place of the service has answered, and whether it was
 * said meanwhile that the bench is not stopped.
 * @param {number} campaign
 * @param {Body} body
 * @returns {Promise<Stopped>}
 */
export async function stopCampaign(campaign, body) {
  Object.assign(known, { asked: performance.now(), shown: false, trouble: "", refused: false });
  sessionStorage.setItem(STORED, JSON.stringify({ campaign, body, at_ms: Date.now() }));
  const drawing = setInterval(draw, DRAW_MS);
  /** @type {{ id?: number } | null} */
  let confirmed = null;
  /** @type {(done?: unknown) => void} */
  let over = () => {};
  const confirming = new Promise((resolve) => (over = resolve));
  let heard = false;
  /** @param {Awaited<ReturnType<typeof ask>>} answer */
  const take = (answer) => {
    Object.assign(known, { trouble: "", refused: false });
    heard = "wish" in answer && answer.wish === "abort";
    if (!confirms(answer)) return;
    confirmed = answer;
    over();
  };
  while (confirmed === null) {
    const key = accessKey();
    const asking = ask(campaign, body, heard).then(take, (error) => {
      heard = false;
      fail(error);
    });
    await Promise.race([confirming, pause(PATIENCE_MS), asking.then(() => pause(AGAIN_MS))]);
    // the same key is refused again
    while (known.refused && confirmed === null && accessKey() === key) await Promise.race([confirming, pause(DRAW_MS)]);
  }
  clearInterval(drawing);
  sessionStorage.removeItem(STORED);
  const late = known.shown;
  Object.assign(known, { asked: null, shown: false, trouble: "", refused: false });
  draw();
  return { campaign: "id" in confirmed ? /** @type {Campaign} */ (confirmed) : null, late };
}

/**
 * After a campaign that has ended: says that the table is not known to stand, until labctl has confirmed that it does,
 * or a person says so. Resolves at once where nothing is open.
 * @param {string} name of the bench
 */
export async function tableStands(name) {
  let seen = false;
  const looked = new Promise((resolve) => (onSeen = () => resolve((seen = true))));
  while (!seen) {
    const benches = await get("/api/benches/status", {}).catch(() => null); // a service that is silent confirms nothing
    const bench = benches?.find((each) => each.name === name);
    if (benches !== null && !tableUnknown(bench ?? {})) break;
    known.left = bench?.unconfirmed || known.left || "labctl does not answer";
    draw();
    await Promise.race([looked, pause(LOOK_MS)]);
  }
  known.left = "";
  draw();
}

/** The stop that was asked for in this tab before the page was loaded and is not confirmed; null for none. */
export const unconfirmedStop = () => remembered(sessionStorage.getItem(STORED), Date.now());
