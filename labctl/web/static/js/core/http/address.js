// Addresses of requests: a path of the HTTP interface with its parameters, and a query.

/**
 * The path with its parameters filled in, and the query: `address("/api/units/{serial}", {serial: "A 1"}, {formula: ["a", "b"]})`.
 * Null, undefined and "" are left out of the query.
 * @param {string} path
 * @param {Record<string, string | number>} [parameters]
 * @param {Record<string, unknown>} [query]
 */
export function address(path, parameters = {}, query = {}) {
  const filled = path.replace(/\{(\w+)\}/g, (_, name) => {
    if (!(name in parameters)) throw new Error(`${path} lacks its ${name}`);
    return encodeURIComponent(parameters[name]);
  });
  const search = new URLSearchParams();
  for (const [name, value] of Object.entries(query)) {
    for (const one of Array.isArray(value) ? value : [value])
      if (one !== null && one !== undefined && one !== "") search.append(name, one);
  }
  const text = search.toString();
  return text ? `${filled}?${text}` : filled;
}
