// Client of the HTTP interface: keys, problem documents, event streams. Paths, parameters, bodies and answers have the
// types of the OpenAPI document; tsc checks every call.

import { address } from "./address.js";
import { Problem, Unreachable, isAbort } from "./errors.js";
import { parseMessage, splitMessages } from "./event_message.js";
import { withNames } from "../names.js";
import { tracked } from "./pending.js";

/** @import { AnswerOf, Options, PathOf, PostOptions, Streams } from "../../../../types/api.js" */
/** @import { EventMessage } from "./event_message.js" */
/**
 * @template {PathOf<"get">} P
 * @typedef {Options<"get", P> extends { path: unknown } ? [options: Options<"get", P>] : [options?: Options<"get", P>]} GetOptions
 */

const KEY = "labctl.key";

export const accessKey = () => sessionStorage.getItem(KEY);
/** @param {string | null} value */
export const setAccessKey = (value) => (value ? sessionStorage.setItem(KEY, value) : sessionStorage.removeItem(KEY));

/** @param {Record<string, string>} [more] */
function headers(more = {}) {
  return accessKey() ? { ...more, Authorization: `Bearer ${accessKey()}` } : more;
}

/**
 * @param {string} path
 * @param {RequestInit} options
 */
async function request(path, options) {
  let response;
  try {
    response = await tracked(`${options.method ?? "GET"} ${path}`, fetch(path, options));
  } catch (error) {
    if (isAbort(error)) throw error;
    throw new Unreachable();
  }
  if (response.ok) return response;
  const document = await response.json().catch(() => ({ title: response.statusText, status: response.status }));
  if (response.status === 401) window.dispatchEvent(new CustomEvent("labctl:key", { detail: document.detail }));
  throw new Problem({ status: response.status, ...document }, Number(response.headers.get("Retry-After")) || 0);
}

/**
 * The answer as JSON; names in it are shown as they are from now on.
 * @param {Response} response
 */
const answerOf = async (response) => withNames(await response.json());

/**
 * Read: `get("/api/units/{serial}", { path: { serial }, query, signal })`.
 * @template {PathOf<"get">} P
 * @param {P} path
 * @param {GetOptions<P>} options
 * @returns {Promise<AnswerOf<"get", P>>}
 */
export async function get(path, ...[{ path: parameters, query, signal } = /** @type {any} */ ({})]) {
  return answerOf(await request(address(path, parameters, query), { headers: headers(), signal }));
}

/**
 * Read one part of a long list: its rows, how many match in all, and the query of the next part, null at the end.
 * @template {PathOf<"get">} P
 * @param {P} path
 * @param {Options<"get", P>} options
 * @returns {Promise<{ rows: AnswerOf<"get", P>, total: number, next: Record<string, string> | null }>}
 */
export async function getPart(path, { path: parameters, query, signal } = /** @type {any} */ ({})) {
  const response = await request(address(path, parameters, query), { headers: headers(), signal });
  const rows = await answerOf(response);
  const next = /<[^>?]*\?([^>]*)>; rel="next"/.exec(response.headers.get("Link") ?? "")?.[1];
  return {
    rows,
    total: Number(response.headers.get("X-Total-Count") ?? rows.length),
    next: next === undefined ? null : Object.fromEntries(new URLSearchParams(next)),
  };
}

/**
 * Act: `post("/api/campaigns/{campaign}/pause", { path: { campaign }, body, signal })`.
 * @template {PathOf<"post">} P
 * @param {P} path
 * @param {PostOptions<P>} options
 * @returns {Promise<AnswerOf<"post", P>>}
 */
export async function post(path, { path: parameters, body, signal }) {
  const options = {
    method: "POST",
    headers: headers({ "Content-Type": "application/json" }),
    body: JSON.stringify(body),
    signal,
  };
  return answerOf(await request(address(path, parameters), options));
}

/**
 * @template {PathOf<"delete">} P
 * @param {P} path
 * @param {Options<"delete", P>} options
 * @returns {Promise<AnswerOf<"delete", P>>}
 */
export async function remove(path, { path: parameters }) {
  return answerOf(await request(address(path, parameters), { method: "DELETE", headers: headers() }));
}

/**
 * Send files as one form.
 * @template {PathOf<"post">} P
 * @param {P} path
 * @param {File[]} files
 * @returns {Promise<AnswerOf<"post", P>>}
 */
export async function upload(path, files) {
  const form = new FormData();
  for (const file of files) form.append("files", file, file.name);
  return answerOf(await request(path, { method: "POST", headers: headers(), body: form }));
}

/**
 * Send one file with fields of a form; a list is sent as several fields of one name.
 * @template {PathOf<"post">} P
 * @param {P} path
 * @param {File} file
 * @param {Record<string, string | string[]>} fields
 * @returns {Promise<AnswerOf<"post", P>>}
 */
export async function sendFile(path, file, fields) {
  const form = new FormData();
  form.append("file", file, file.name);
  for (const [name, value] of Object.entries(fields)) for (const each of [value].flat()) form.append(name, each);
  return answerOf(await request(path, { method: "POST", headers: headers(), body: form }));
}

/**
 * Fetch a file with the access key and save it as `name`; returns what its format does not carry, in words.
 * @template {PathOf<"get">} P
 * @param {P} path
 * @param {string} name
 * @param {Options<"get", P>} options
 */
export async function download(path, name, { path: parameters, query }) {
  const response = await request(address(path, parameters, query), { headers: headers() });
  saveBlob(await response.blob(), name);
  return response.headers.get("X-Labctl-Lost") ?? "";
}

/**
 * @param {Blob} blob
 * @param {string} name
 */
export function saveBlob(blob, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

/**
 * Yield {event, id, data} of a stream of server-sent events until it ends. A comment (keep-alive) is {event: "alive"}.
 * Not an EventSource, because that cannot send a key.
 * @template {keyof Streams} P
 * @param {P} path
 * @param {Options<"get", P> & { after?: number }} options
 * @returns {AsyncGenerator<EventMessage>}
 */
export async function* eventStream(path, { path: parameters, after, query, signal }) {
  const response = await request(address(path, parameters, query), {
    headers: headers(after ? { "Last-Event-ID": String(after) } : {}),
    signal,
  });
  if (!response.body) return;
  const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
  let text = "";
  try {
    for (;;) {
      const { done, value } = await reader.read();
      if (done) return;
      const { messages, rest } = splitMessages(text + value);
      text = rest;
      for (const message of messages) yield withNames(parseMessage(message));
    }
  } finally {
    reader.cancel().catch(() => {});
  }
}

/**
 * Request an answer that was just computed once more, when the page is idle: now it has an ETag, so the browser keeps
 * it and the next view of the page does not load it again.
 * @param {FollowedPath} path
 * @param {Options<"get", FollowedPath>} options
 */
function keepAnswer(path, { path: parameters, query, signal }) {
  const again = () => fetch(address(path, parameters, query), { headers: headers(), signal }).then((r) => r.text());
  (window.requestIdleCallback ?? setTimeout)(() => again().catch(() => {}));
}

/** @typedef {"/api/units/{serial}/calibrations/{version}/criticism/events"} FollowedPath */
/** @typedef {Streams[FollowedPath]} Followed */
/**
 * The answer of a long computation, followed to its end: `onstage` is called with each stage, in words. Leaving the
 * page (`signal`) cancels the computation in the service.
 * @param {FollowedPath} path
 * @param {Options<"get", FollowedPath> & { onstage: (stage: string) => void }} options
 * @returns {Promise<Followed["answer"]>}
 */
export async function getFollowed(path, { onstage, ...options }) {
  let computed = false;
  /** @type {Followed["answer"] | null} */
  let answer = null;
  // read to its end, which follows the answer: a stream that is left before is a cancelled request
  for await (const { event, data } of eventStream(path, options)) {
    if (event === "stage") {
      computed = true;
      onstage(/** @type {Followed["stage"]} */ (data).stage);
    } else if (event === "answer") {
      answer = /** @type {Followed["answer"]} */ (data);
    } else if (event === "problem") throw new Problem(/** @type {Followed["problem"]} */ (data));
  }
  if (!answer) throw new Unreachable();
  if (computed) keepAnswer(path, options);
  return answer;
}
