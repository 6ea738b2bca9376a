// The form that begins a live calibration.

import { post } from "../core/http/api.js";
import { h, setChildren } from "../core/elements.js";
import { labelledField, selectField, toggleGroup } from "../core/fields.js";
import { actButton, card, notice, readOnlyNote } from "../core/components.js";
import { show } from "../core/router.js";

/** @import { Bench } from "../../../types/api.js" */

/** @param {HTMLInputElement} input */
const numberOf = (input) => (input.value === "" ? null : Number(input.value));

/**
 * `serial`: the unit that is chosen first.
 * @param {Bench | undefined} bench
 * @param {string | undefined} serial
 */
export function startForm(bench, serial) {
  const there = bench?.units.some((unit) => unit.serial === serial) || !serial;
  let source = bench && there ? "bench" : "network";
  let unit = serial && there ? serial : (bench?.units[0]?.serial ?? "");
  const name = h("input", { type: "text", value: serial ?? "", autocomplete: "off", spellcheck: "false" });
  const address = h("input", {
    type: "text",
    placeholder: "ws://robot:9090",
    autocomplete: "off",
    spellcheck: "false",
  });
  const topic = h("input", { type: "text", value: "/imu/data", autocomplete: "off", spellcheck: "false" });
  const latitude = h("input", { type: "number", min: "-90", max: "90", step: "any" });
  const target = h("input", { type: "number", value: "0.001", min: "0", step: "any" });
  const bias = h("input", { type: "number", min: "0", step: "any", placeholder: "no limit" });
  const poses = h("input", { type: "number", value: "18", min: "12", max: "26", step: "1" });
  const rest = h("input", { type: "number", value: "2", min: "1", max: "60", step: "0.5" });
  const unwatched = h("input", { type: "checkbox" });
  const place = h("div", { class: "row live-fields" });
  const fields = () =>
    setChildren(
      place,
      source === "bench" && bench
        ? selectField(
            "Unit",
            bench.units.map((each) => [each.serial, each.serial]),
            unit,
            (value) => (unit = value),
          )
        : [
            labelledField("Serial number", name),
            labelledField("Address", address, "ws://HOST:PORT of a rosbridge server, or tcp://HOST:PORT of lines"),
            labelledField("Topic", topic, "of type sensor_msgs/Imu"),
            labelledField("Latitude, deg", latitude),
          ],
    );
  fields();
  async function begin() {
    const network =
      source === "bench"
        ? { serial: unit }
        : {
            serial: name.value.trim() || null,
            address: address.value.trim(),
            topic: topic.value.trim(),
            latitude_deg: numberOf(latitude),
          };
    await post("/api/live/start", {
      body: {
        ...network,
        target_u: Number(target.value),
        target_bias_dps: numberOf(bias),
        poses: Number(poses.value),
        rest_s: Number(rest.value),
        end_unwatched: unwatched.checked,
      },
    });
    await show();
  }
  const asked = h(
    "div",
    { class: "stack act" },
    bench
      ? toggleGroup(
          "Stream",
          [
            ["bench", `Unit on ${bench.name}`],
            ["network", "Stream of the network"],
          ],
          source,
          (value) => {
            source = value;
            fields();
          },
        )
      : null,
    bench?.campaign ? notice("warn", `Campaign ${bench.campaign} runs on ${bench.name} and must end first.`) : null,
    place,
    h(
      "div",
      { class: "row live-fields" },
      labelledField("Target U", target, "of scale factors and misalignments (rad), k = 2"),
      labelledField("Target U of biases, deg/s", bias),
      labelledField("Poses", poses, "12 to 26"),
      labelledField("Rest in each, s", rest),
    ),
    h(
      "label",
      { class: "row tight" },
      unwatched,
      "End it, and keep the recording, when it has been open in no page for 30 s",
    ),
    h("div", { class: "row" }, actButton("Begin", begin, { kind: "primary large" })),
  );
  return card(
    "Begin",
    h(
      "p",
      {},
      "Turn a unit with gyros and accelerometers by hand, from pose to pose; its turns are compared with gravity. No table moves. Its readings become a recording however this ends, and a version when the target is reached.",
    ),
    readOnlyNote("A live calibration is not begun here"),
    asked,
  );
}
