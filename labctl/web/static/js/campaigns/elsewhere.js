// An experiment for a unit that this service cannot measure, because it drives no bench: its recipe as a file, and the
// command that runs it where the bench is.

import { saveBlob } from "../core/http/api.js";
import { h } from "../core/elements.js";
import { button, notice } from "../core/components.js";
import { copyText } from "../core/copy_text.js";
import { NO_BENCH } from "../core/no_bench.js";

/**
 * The name of the file that a recipe for a unit is kept in. Other signs than those of a usual name become a hyphen.
 * @param {string} serial
 */
const fileOf = (serial) => `${serial.replaceAll(/[^\w.-]+/g, "-")}-next.toml`;

/**
 * Say that the experiment cannot be run here, and offer what can be done with its recipe.
 * @param {string} serial
 * @param {{ toml?: string, name?: string, more?: string }} recipe its text, or the name of one that comes with labctl; and
 *   what the page says besides
 */
export function elsewhere(serial, { toml = "", name = "RECIPE", more = "" }) {
  const file = toml ? fileOf(serial) : name;
  return notice(
    "warn",
    h("p", {}, h("strong", {}, `This experiment is for ${serial}. ${NO_BENCH}. `), more),
    h("p", {}, `To measure ${serial}, run its recipe with the file of the bench that carries the unit:`),
    h("pre", { class: "command" }, `labctl campaign start ${file} --bench FILE`),
    toml
      ? h(
          "div",
          { class: "row" },
          button("Download the recipe", () => saveBlob(new Blob([toml], { type: "application/toml" }), file)),
          button("Copy the recipe", () => copyText(toml, "Recipe"), { kind: "quiet" }),
        )
      : null,
  );
}
