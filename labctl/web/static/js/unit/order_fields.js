// The fields of a certificate's form: where the order states each, which are asked for, and what is wrong with entries.

/** @import { MissingFact } from "../../../types/api.js" */
/** @import { Answers, Field } from "../../../types/pages.js" */

/**
 * A field and the place in the request that states it; `ifMissing`: asked for only where the service misses it.
 * @typedef {Field & { place: string, ifMissing?: "fact" | "table", most?: number }} OrderField
 */

/** Most characters of one line, and of a text of several, in an order. */
const MAX_LINE = 300;
const MAX_TEXT = 2000;
const COUNTRY = "Two letters, such as DE (ISO 3166-1).";

/** Asked for where the measurement does not state it: all fields of the laboratory together. @type {readonly OrderField[]} */
const MEASUREMENT_FIELDS = [
  { name: "laboratory_name", place: "order.laboratory.name", label: "Laboratory", ifMissing: "table" },
  {
    name: "laboratory_street",
    place: "order.laboratory.street",
    label: "Street and number of the laboratory",
    ifMissing: "table",
  },
  {
    name: "laboratory_post_code",
    place: "order.laboratory.post_code",
    label: "Post code of the laboratory",
    ifMissing: "table",
  },
  { name: "laboratory_city", place: "order.laboratory.city", label: "City of the laboratory", ifMissing: "table" },
  {
    name: "laboratory_country",
    place: "order.laboratory.country",
    label: "Country of the laboratory",
    hint: COUNTRY,
    ifMissing: "table",
  },
  {
    name: "laboratory_email",
    place: "order.laboratory.email",
    label: "E-mail of the laboratory",
    type: "email",
    ifMissing: "table",
  },
  {
    name: "method_name",
    place: "order.method.name",
    label: "Name of the method",
    hint: "How the rates were generated and measured, such as: rate steps on a rate table.",
    ifMissing: "fact",
  },
  {
    name: "performed_from",
    place: "order.method.performed_from",
    label: "First day of the measurements",
    type: "date",
    ifMissing: "fact",
  },
  {
    name: "performed_until",
    place: "order.method.performed_until",
    label: "Last day of the measurements",
    type: "date",
    ifMissing: "fact",
  },
];

/** Asked for in every form. @type {readonly OrderField[]} */
const ORDER_FIELDS = [
  { name: "by", place: "by", label: "Issued by", most: 120 },
  { name: "name", place: "order.customer.name", label: "Customer" },
  { name: "street", place: "order.customer.street", label: "Street and number" },
  { name: "post_code", place: "order.customer.post_code", label: "Post code" },
  { name: "city", place: "order.customer.city", label: "City" },
  { name: "country", place: "order.customer.country", label: "Country", hint: COUNTRY },
  { name: "email", place: "order.customer.email", label: "E-mail", type: "email" },
  { name: "contact", place: "order.customer.contact", label: "Contact person", required: false },
  { name: "order", place: "order.customer.order", label: "Number of the order", required: false },
  { name: "manufacturer", place: "order.item.manufacturer", label: "Manufacturer of the item" },
  { name: "condition", place: "order.item.condition", label: "Condition of the item on receipt", most: MAX_TEXT },
  {
    name: "received",
    place: "order.item.received",
    label: "Received on",
    type: "date",
    hint: "At most 10 years before the measurements. Empty: not stated.",
    required: false,
  },
  {
    name: "deviations",
    place: "order.method.deviations",
    label: "Deviations from the method",
    hint: "Empty: none.",
    required: false,
    most: MAX_TEXT,
  },
  {
    name: "specification",
    place: "order.conformity.specification",
    label: "Conformity to the specification",
    hint: "Empty: no statement.",
    required: false,
  },
  {
    name: "limit_dps",
    place: "order.conformity.limit_dps",
    label: "Limit of the error in the specification, deg/s",
    hint: "Needed where a specification is stated.",
    required: false,
  },
  {
    name: "own_axis",
    place: "order.conformity.about",
    label: "The item turns about the axis of one output at a time",
    type: "checkbox",
    hint: "Needed where U is known about the axis of each output alone (“own axis”).",
    required: false,
  },
  {
    name: "guard_band",
    place: "order.conformity.rule",
    label: "With a guard band as wide as the uncertainty",
    type: "checkbox",
    required: false,
  },
];

const FIELDS = [...MEASUREMENT_FIELDS, ...ORDER_FIELDS];

/** Where the order states a missing fact. @param {MissingFact} fact */
const placeOf = ({ table, key }) => `order.${table}.${key}`;

/**
 * The fields of a form: those of every order, before them those that state what the measurement does not.
 * @param {readonly MissingFact[]} missing
 */
export function fieldsFor(missing) {
  const tables = new Set(missing.map(({ table }) => table));
  const places = new Set(missing.map(placeOf));
  const asked = MEASUREMENT_FIELDS.filter(({ place, ifMissing }) =>
    ifMissing === "table" ? [...tables].some((table) => place.startsWith(`order.${table}.`)) : places.has(place),
  );
  return [...asked, ...ORDER_FIELDS];
}

/**
 * The missing facts that no field states: a certificate cannot be issued from the form.
 * @param {readonly MissingFact[]} missing
 */
export const unstatable = (missing) =>
  missing.filter((fact) => !fact.table || !FIELDS.some(({ place }) => place === placeOf(fact)));

/**
 * The name of the field that states a place of the request; undefined: none does.
 * @param {string} place
 */
export const fieldAt = (place) => FIELDS.find((field) => field.place === place)?.name;

/** @param {string | undefined} text */
const trimmed = (text) => (text ?? "").trim();

/** @param {string} name */
const isCountry = (name) => name === "country" || name.endsWith("_country");

/**
 * What is wrong with one entry, in words; empty: nothing.
 * @param {OrderField} field
 * @param {Answers} given
 */
function problemOf({ name, type, required, most = MAX_LINE }, given) {
  const text = trimmed(given[name]);
  if (type === "checkbox") return "";
  if (!text) {
    if (name === "limit_dps" && trimmed(given.specification)) return "State the limit of the specification, in deg/s.";
    return required === false ? "" : "State it; a blank entry is not enough.";
  }
  if (text.length > most) return `It has ${text.length} characters; shorten it to ${most}.`;
  if (isCountry(name) && !/^[a-z]{2}$/i.test(text))
    return "Write the two letters of the country (ISO 3166-1), such as DE for Germany.";
  return name === "limit_dps" ? problemOfLimit(text, given) : "";
}

/**
 * @param {string} text
 * @param {Answers} given
 */
function problemOfLimit(text, given) {
  if (!Number.isFinite(Number(text))) return "Write a number with a point, such as 0.1, in deg/s.";
  if (Number(text) <= 0) return "Write a number above 0, in deg/s.";
  return trimmed(given.specification) ? "" : "State the specification as well, or leave the limit empty.";
}

/**
 * What is wrong with the entries: name of the field -> words; empty: nothing.
 * @param {readonly OrderField[]} fields
 * @param {Answers} given
 * @returns {Record<string, string>}
 */
export function problemsOf(fields, given) {
  const found = fields.map((field) => [field.name, problemOf(field, given)]).filter(([, words]) => words);
  const last = trimmed(given.performed_until);
  if (last && last < trimmed(given.performed_from)) found.push(["performed_until", "It is before the first day."]);
  return Object.fromEntries(found);
}

/** @param {string} text */
const country = (text) => trimmed(text).toUpperCase();

/**
 * The order of a request, as the entries state it.
 * @param {Answers} given
 */
export function orderOf(given) {
  const { name, street, post_code, city, email, contact, order } = given;
  return {
    ...(given.laboratory_name
      ? {
          laboratory: {
            name: given.laboratory_name,
            street: given.laboratory_street,
            post_code: given.laboratory_post_code,
            city: given.laboratory_city,
            country: country(given.laboratory_country),
            email: given.laboratory_email,
          },
        }
      : {}),
    customer: { name, street, post_code, city, country: country(given.country), email, contact, order },
    item: {
      manufacturer: given.manufacturer,
      condition: given.condition,
      ...(given.received ? { received: given.received } : {}),
    },
    method: {
      deviations: given.deviations,
      ...(given.method_name ? { name: given.method_name } : {}),
      ...(given.performed_from ? { performed_from: given.performed_from } : {}),
      ...(given.performed_until ? { performed_until: given.performed_until } : {}),
    },
    ...(trimmed(given.specification)
      ? {
          conformity: {
            specification: given.specification,
            limit_dps: Number(given.limit_dps),
            about: given.own_axis ? /** @type {const} */ ("own axis") : /** @type {const} */ ("any axis"),
            rule: given.guard_band ? /** @type {const} */ ("guard-band") : /** @type {const} */ ("simple"),
          },
        }
      : {}),
  };
}
