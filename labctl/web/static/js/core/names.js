// Names that people have given, as the answers of the service have them: a page shows them as they stand.

/** Fields of answers that hold such a name, or several. */
const FIELDS = new Set(["serial", "serials", "recipe", "bench", "name", "file", "files", "batch", "supplier", "by"]);
/** What a page would write otherwise (`typeset`): signs of mathematics in a name. */
const MATHEMATICS = /\+-\s*\d|(?<![\w-])-\d|\de[+-]?\d/;
/** So many of these names are known at a time; the oldest are forgotten first. */
const MAX_KNOWN = 500;

/** @type {Set<string>} */
const known = new Set();
/** @type {RegExp | null} */
let pattern = null;

/**
 * Learn the names in an answer, and return it.
 * @template T
 * @param {T} answer
 * @returns {T}
 */
export function withNames(answer) {
  learn(answer, "");
  return answer;
}

/**
 * @param {unknown} value
 * @param {string} field
 */
function learn(value, field) {
  if (typeof value === "string") {
    if (FIELDS.has(field) && MATHEMATICS.test(value)) add(value);
  } else if (Array.isArray(value)) {
    if (typeof value[0] !== "number") for (const each of value) learn(each, field);
  } else if (value !== null && typeof value === "object") {
    for (const [own, each] of Object.entries(value)) learn(each, own);
  }
}

/** @param {string} name */
function add(name) {
  if (known.has(name)) return;
  known.add(name);
  if (known.size > MAX_KNOWN) known.delete([...known][0]);
  const longestFirst = [...known].sort((a, b) => b.length - a.length);
  const literal = longestFirst.map((each) => each.replace(/[\\^$.*+?()[\]{}|]/g, "\\$&"));
  pattern = new RegExp(`(?<!\\w)(${literal.join("|")})(?!\\w)`);
}

/**
 * The parts of a text; every second one, from the second on, is a name.
 * @param {string} text
 */
export const splitAtNames = (text) => (pattern ? text.split(pattern) : [text]);
