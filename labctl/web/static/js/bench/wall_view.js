// The bench for a wall: nothing but state, readings and limits, large; with a sound while something needs a person.

import { h, setChildren } from "../core/elements.js";

/** @import { Campaign, WatchedLimit } from "../../../types/api.js" */

const SOUND_KEY = "labctl.wall.sound";
const [EVERY_MS, TONE_S, TONE_HZ, LOUDNESS] = [2000, 0.25, 880, 0.2];

/**
 * Why a person is needed now; "" where none is.
 * @param {{ limits?: readonly WatchedLimit[], prompt: object | null, state: string }} now
 * @param {boolean} stale
 */
export function needsPerson(now, stale) {
  if (now.limits?.some((limit) => limit.is_beyond)) return "a limit is passed";
  if (stale) return "the values may be out of date";
  if (now.prompt) return "a question waits for an answer";
  return now.state === "paused" || now.state === "failed" ? `the campaign is ${now.state}` : "";
}

/** Show the page without its frame while `signal` is not aborted.
 * @param {AbortSignal} signal */
export function enterWall(signal) {
  document.documentElement.dataset.wall = "yes";
  signal.addEventListener("abort", () => delete document.documentElement.dataset.wall);
}

/**
 * A button that switches the sound on; `onStatus(now, stale)` lets it sound while a person is needed.
 * @param {AbortSignal} signal
 */
export function alarmSound(signal) {
  let [on, why] = [localStorage.getItem(SOUND_KEY) === "on", ""];
  /** @type {AudioContext | null} */
  let audio = null;
  const button = h("button", { type: "button", class: "button tiny", onclick: swap });
  const reason = h("strong", { class: "wall-reason", role: "status" });
  function name() {
    setChildren(button, on ? "Sound is on" : "Sound is off");
    button.setAttribute("aria-pressed", String(on));
  }
  function swap() {
    on = !on;
    localStorage.setItem(SOUND_KEY, on ? "on" : "off");
    name();
    if (on) sound(); // a press of a button is what browsers ask for before a page may sound
  }
  function sound() {
    audio ??= new AudioContext();
    const [tone, loudness] = [audio.createOscillator(), audio.createGain()];
    [tone.frequency.value, loudness.gain.value] = [TONE_HZ, LOUDNESS];
    tone.connect(loudness).connect(audio.destination);
    tone.start();
    tone.stop(audio.currentTime + TONE_S);
  }
  name();
  const timer = setInterval(() => on && why && sound(), EVERY_MS);
  signal.addEventListener("abort", () => {
    clearInterval(timer);
    audio?.close();
  });
  /**
   * @param {Pick<Campaign, "limits" | "prompt" | "state">} now
   * @param {boolean} stale
   */
  const onStatus = (now, stale) => {
    why = needsPerson(now, stale);
    reason.textContent = why;
    reason.hidden = !why;
  };
  return Object.assign(h("span", { class: "row tight" }, reason, button), { onStatus });
}
