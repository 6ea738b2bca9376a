// Messages of a stream of server-sent events.

/** @typedef {{ event: string, id: number | null, data: unknown }} EventMessage */

/**
 * Split what was received so far into whole messages and the rest.
 * @param {string} text
 * @returns {{ messages: string[], rest: string }}
 */
export function splitMessages(text) {
  const messages = text.split(/\r?\n\r?\n/);
  return { rest: messages.pop() ?? "", messages };
}

/**
 * Parse one message. A comment (keep-alive) is {event: "alive"}.
 * @param {string} message
 * @returns {EventMessage}
 */
export function parseMessage(message) {
  /** @type {EventMessage} */
  const found = { event: "message", id: null, data: null };
  for (const line of message.split(/\r?\n/)) {
    const [, field, value = ""] = /^(\w*):? ?(.*)$/s.exec(line) ?? [];
    if (field === "data") found.data = JSON.parse(value);
    else if (field === "event") found.event = value;
    else if (field === "id") found.id = Number(value);
    else if (field === "" && found.data === null) found.event = "alive";
  }
  return found;
}
