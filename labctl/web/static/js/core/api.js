// Client of the HTTP interface: keys, problem documents, event streams.

const KEY = "labctl.key";

/** A problem document of the service (RFC 9457): `status`, `type`, `title`, `detail`. */
export class Problem extends Error {
  constructor(document) {
    super(document.detail || document.title || "the service gave no reason");
    Object.assign(this, document);
  }
}

/** The service did not answer. */
export class Unreachable extends Error {
  constructor() {
    super("The service does not answer. Nothing on this page is newer than what you see.");
  }
}

export const accessKey = () => sessionStorage.getItem(KEY);
export const setAccessKey = (value) => (value ? sessionStorage.setItem(KEY, value) : sessionStorage.removeItem(KEY));

function headers(more = {}) {
  return accessKey() ? { ...more, Authorization: `Bearer ${accessKey()}` } : more;
}

async function request(path, options) {
  let response;
  try {
    response = await fetch(path, options);
  } catch (error) {
    if (error.name === "AbortError") throw error;
    throw new Unreachable();
  }
  if (response.ok) return response;
  const document = await response.json().catch(() => ({ title: response.statusText, status: response.status }));
  if (response.status === 401) window.dispatchEvent(new CustomEvent("labctl:key", { detail: document.detail }));
  throw new Problem({ status: response.status, ...document });
}

/** Path and query: `withQuery("/api/x", {recording: 3, formula: ["a", "b"]})`; null is left out. */
export function withQuery(path, query = {}) {
  const search = new URLSearchParams();
  for (const [name, value] of Object.entries(query)) {
    for (const one of Array.isArray(value) ? value : [value])
      if (one !== null && one !== undefined && one !== "") search.append(name, one);
  }
  const text = search.toString();
  return text ? `${path}?${text}` : path;
}

export async function get(path, { query, signal } = {}) {
  return (await request(withQuery(path, query), { headers: headers(), signal })).json();
}

export async function post(path, body = {}, { signal } = {}) {
  const options = {
    method: "POST",
    headers: headers({ "Content-Type": "application/json" }),
    body: JSON.stringify(body),
    signal,
  };
  return (await request(path, options)).json();
}

export async function remove(path) {
  return (await request(path, { method: "DELETE", headers: headers() })).json();
}

/** Send files as one form. */
export async function upload(path, files) {
  const form = new FormData();
  for (const file of files) form.append("files", file, file.name);
  return (await request(path, { method: "POST", headers: headers(), body: form })).json();
}

/** Fetch a file with the access key and save it. */
export async function download(path, name) {
  const blob = await (await request(path, { headers: headers() })).blob();
  saveBlob(blob, name);
}

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
 */
export async function* eventStream(path, { after, query, signal } = {}) {
  const response = await request(withQuery(path, query), {
    headers: headers(after ? { "Last-Event-ID": String(after) } : {}),
    signal,
  });
  const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
  let text = "";
  try {
    for (;;) {
      const { done, value } = await reader.read();
      if (done) return;
      text += value;
      const messages = text.split(/\r?\n\r?\n/);
      text = messages.pop();
      for (const message of messages) yield parseMessage(message);
    }
  } finally {
    reader.cancel().catch(() => {});
  }
}

/**
 * The answer of a long computation, followed to its end: `onstage` is called with each stage, in words. Leaving the
 * page (`signal`) cancels the computation in the service.
 */
export async function getFollowed(path, { query, signal, onstage }) {
  for await (const { event, data } of eventStream(path, { query, signal })) {
    if (event === "stage") onstage(data.stage);
    else if (event === "answer") return data;
    else if (event === "problem") throw new Problem(data);
  }
  throw new Unreachable();
}

function parseMessage(message) {
  const found = { event: "message", id: null, data: null };
  for (const line of message.split(/\r?\n/)) {
    const [, field, value] = /^(\w*):? ?(.*)$/s.exec(line) ?? [];
    if (field === "data") found.data = JSON.parse(value);
    else if (field === "event") found.event = value;
    else if (field === "id") found.id = Number(value);
    else if (field === "" && found.data === null) found.event = "alive";
  }
  return found;
}
