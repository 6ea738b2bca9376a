// The column map of a log as a document, and its changes. Keys and values are those of a MAP.toml.

/** @typedef {Record<string, any>} MapDocument */
/** @typedef {{ from: string | number, unit?: string, scale?: number, [key: string]: unknown }} MappedColumn */

/**
 * The mapped column that takes a column of the file, as [column of the recording, entry]; null where none does.
 * @param {MapDocument} map
 * @param {string} name
 * @param {number} number of the column, from 1
 * @returns {[string, MappedColumn] | null}
 */
export function entryOf(map, name, number) {
  const found = Object.entries(map.columns ?? {}).find(([, entry]) => entry.from === name || entry.from === number);
  return found ? [found[0], found[1]] : null;
}

/**
 * The map with another use for a column of the file; an empty target: none. What took the target before loses it.
 * @param {MapDocument} map
 * @param {string} name
 * @param {number} number
 * @param {string} target
 */
export function withTarget(map, name, number, target) {
  const old = entryOf(map, name, number);
  const columns = Object.fromEntries(
    Object.entries(map.columns ?? {}).filter(
      ([key, entry]) => key !== target && entry.from !== name && entry.from !== number,
    ),
  );
  const sameQuantity = old && target && old[0].split("_")[0] === target.split("_")[0];
  if (target) columns[target] = sameQuantity ? old[1] : { from: name };
  return { ...map, columns };
}

/**
 * The map with another unit for a column of the recording; `scale` goes with words of a converter alone.
 * @param {MapDocument} map
 * @param {string} target
 * @param {string} unit
 * @param {number | null} scale
 */
export function withUnit(map, target, unit, scale) {
  const { from, ...rest } = map.columns[target];
  const kept = Object.fromEntries(Object.entries(rest).filter(([key]) => !["unit", "scale"].includes(key)));
  const entry =
    unit === "LSB"
      ? { from, ...kept, unit, ...(scale ? { scale } : {}) }
      : { from, ...kept, ...(unit ? { unit } : {}) };
  return { ...map, columns: { ...map.columns, [target]: entry } };
}

/**
 * The map with another value for a key; null or empty: the key is left out.
 * @param {MapDocument} map
 * @param {string} key
 * @param {unknown} value
 */
export function withKey(map, key, value) {
  const { [key]: _, ...rest } = map;
  return value === null || value === "" || value === undefined ? rest : { ...rest, [key]: value };
}

/**
 * The map with another fact of the unit, a further key of recording.toml; empty: it is not stated.
 * @param {MapDocument} map
 * @param {"model" | "technology"} key
 * @param {string} value
 */
export function withFact(map, key, value) {
  const info = withKey(map.info ?? {}, key, value);
  return withKey(map, "info", Object.keys(info).length ? info : null);
}

/**
 * What is sent with a log, to look at it and to import it alike: its map, and what is left out of it by choice.
 * @param {MapDocument | string | null} map as a document or as text; null: labctl proposes one
 * @param {{ modified_ms: number, options: readonly string[], leaveOut: Iterable<string> }} more
 */
export const logFields = (map, { modified_ms, options, leaveOut }) => ({
  column_map: typeof map === "string" ? map : map ? JSON.stringify(map) : "",
  modified_ms: String(modified_ms),
  option: [...options],
  leave_out: [...leaveOut],
});
