// The files of a version: a choice of format with its options, and what the chosen one does not carry.

import { download } from "../core/http/api.js";
import { h, setChildren } from "../core/elements.js";
import { labelledField, option, selectField } from "../core/fields.js";
import { button, notice } from "../core/components.js";

/** @import { Unit } from "../../../types/api.js" */

/**
 * @param {Unit} unit
 * @param {number | null} version null: the one in force
 */
export function exportFiles(unit, version) {
  const fields = h("div", { class: "stack" });
  const lost = h("div", { role: "status" });
  /** @param {string} id */
  const choose = (id) => {
    const format = unit.formats.find((each) => each.id === id) ?? unit.formats[0];
    setChildren(lost);
    if (!format) return;
    const inputs = Object.entries(format.options).map(([name, text]) => ({
      name,
      input: h("input", { type: "text" }),
      text,
    }));
    const file = `${unit.serial}${version === null ? "" : `-v${version}`}.${format.suffix}`;
    const fetchFile = async () => {
      const given = inputs.filter(({ input }) => input.value.trim());
      const query = {
        format: format.id,
        ...(version === null ? {} : { version }),
        ...(given.length ? { option: given.map(({ name, input }) => `${name}=${input.value.trim()}`) } : {}),
      };
      const said = await download("/api/units/{serial}/calibration", file, { path: { serial: unit.serial }, query });
      setChildren(lost, said ? notice("warn", `${format.title} does not carry: ${said}`) : null);
    };
    setChildren(
      fields,
      ...inputs.map(({ name, input, text }) => labelledField(name, input, text)),
      h("div", { class: "row" }, button(`Download ${format.title}`, fetchFile)),
    );
  };
  const first = unit.formats[0]?.id ?? "";
  choose(first);
  const formats = unit.formats.map(({ id, title }) => option(id, title));
  return h("div", { class: "stack" }, selectField("File format", formats, first, choose), fields, lost);
}
