// Routes: which module shows an address.

/** @import { PageModule } from "../../../types/pages.js" */
/** @typedef {{ parts: string[], name: string, load: () => Promise<PageModule> }} Route */

/** @param {string} path */
const partsOf = (path) => path.split("/").filter(Boolean);

/**
 * A route of a pattern like `/units/:serial`.
 * @param {string} pattern
 * @param {string} name of the page, while it is not there yet
 * @param {Route["load"]} load
 * @returns {Route}
 */
export const routeOf = (pattern, name, load) => ({ parts: partsOf(pattern), name, load });

/**
 * A part of an address as it was before it was encoded; as it stands where that is not possible (`%E0%A4%A`).
 * @param {string} part
 */
function decoded(part) {
  try {
    return decodeURIComponent(part);
  } catch {
    return part;
  }
}

/**
 * The first route whose pattern fits a path, with the decoded values of its parameters; null where none does.
 * @param {readonly Route[]} routes
 * @param {string} path
 */
export function matchRoute(routes, path) {
  const parts = partsOf(path).map(decoded);
  for (const { parts: pattern, name, load } of routes) {
    if (pattern.length !== parts.length) continue;
    if (!pattern.every((part, k) => part.startsWith(":") || part === parts[k])) continue;
    /** @type {Record<string, string>} */
    const params = {};
    pattern.forEach((part, k) => {
      if (part.startsWith(":")) params[part.slice(1)] = parts[k];
    });
    return { load, name, params };
  }
  return null;
}

/**
 * The address of a plan of a recipe; with the serial number of the unit that it is for, which may be on no bench, and
 * the version beside whose model and recordings it is judged.
 * @param {string} toml
 * @param {string} [unit]
 * @param {number} [version]
 */
export const planAddress = (toml, unit, version) => `/campaigns/new?${changedQuery("", { toml, unit, version })}`;

/**
 * A query string with some values changed: "" , null and undefined remove one.
 * @param {string} search
 * @param {Record<string, string | number | null | undefined>} choice
 */
export function changedQuery(search, choice) {
  const query = new URLSearchParams(search);
  for (const [name, value] of Object.entries(choice)) {
    if (value === null || value === undefined || value === "") query.delete(name);
    else query.set(name, String(value));
  }
  return query.toString();
}
