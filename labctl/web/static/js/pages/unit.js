// The page of one unit: its calibrations, certifications, error ladder, coefficients and uncertainty in use.

import { download, get } from "../core/api.js";
import { h, setChildren } from "../core/elements.js";
import { day, instant, number } from "../core/format.js";
import {
  button,
  card,
  chip,
  emptyState,
  factList,
  pageHeader,
  cardWithHeader,
  loadInto,
  modelName,
  notice,
  table,
} from "../core/components.js";
import { query, updateQuery } from "../core/router.js";
import { ladderFigure } from "../explore/error_ladder.js";
import { askCertification, askRevocation, certificationTable, overridden, verdictChip } from "../unit/certification.js";
import { coefficients, comparison } from "../unit/coefficients.js";
import { uncertaintyInUse } from "../unit/uncertainty.js";

export async function page({ params, signal }) {
  const base = `/api/units/${encodeURIComponent(params.serial)}`;
  const [unit, rows, history] = await Promise.all([
    get(base, { signal }),
    get(`${base}/calibrations`, { signal }),
    get(`${base}/certifications`, { signal }),
  ]);
  const force = history.find((act) => act.version === unit.certified_version && act.act === "certify");
  const explore = `/explore?unit=${encodeURIComponent(unit.serial)}`;
  return h(
    "div",
    { class: "page" },
    pageHeader(
      unit.serial,
      [unit.model, unit.technology?.toUpperCase()].filter(Boolean).join(" · "),
      h("a", { class: "button primary", href: explore }, "Explore"),
    ),
    h("section", { class: "card", "aria-label": "In force" }, inForce(unit, rows, force, base)),
    rows.length
      ? [versions(unit, rows, base, explore), ladder(base, signal), versionCards(base, rows, signal)]
      : emptyState(
          h("p", {}, "No calibration yet."),
          h("p", {}, h("a", { class: "button primary", href: explore }, "Fit a model")),
        ),
    h(
      "div",
      { class: "columns" },
      card(
        "Recordings",
        h(
          "ul",
          { class: "plain" },
          unit.recordings.map((id) => h("li", {}, h("a", { href: `/recordings/${id}` }, `Recording ${id}`))),
        ),
      ),
      card(
        "Certifications",
        history.length ? certificationTable(history) : h("p", { class: "muted" }, "Nothing has been certified yet."),
      ),
    ),
  );
}

function inForce(unit, rows, force, base) {
  if (!unit.certified_version) {
    return notice(
      "warn",
      h(
        "p",
        {},
        h("strong", {}, "No calibration is in force. "),
        "Robots that ask for this unit's calibration get none until a version is certified.",
      ),
    );
  }
  const row = rows.find((each) => each.version === unit.certified_version);
  const left = force?.due ? Math.ceil((new Date(force.due) - Date.now()) / 86_400_000) : null;
  return h(
    "div",
    { class: "stack" },
    factList([
      ["In force", `version ${unit.certified_version}`, null, row ? modelName(row.model) : null],
      ["Certified by", force?.by ?? "–", null, force ? instant(force.at) : null],
      [
        "Due",
        force?.due ? day(force.due) : "no date",
        null,
        left === null ? null : left < 0 ? `${-left} days ago` : `in ${left} days`,
      ],
      !force || force.override === null
        ? null
        : [
            "Verdict when certified",
            verdictChip(force),
            null,
            force.verdict_recording ? `recording ${force.verdict_recording}` : null,
          ],
      ["RMS error", number(row?.rms_dps), "deg/s"],
      ["At unseen temperatures", number(row?.heldout_rms_dps), "deg/s"],
    ]),
    force?.override ? overridden(force) : null,
    left !== null && left < 0 ? notice("bad", "This calibration is overdue.") : null,
    h(
      "div",
      { class: "row" },
      unit.formats.map(({ id, title, suffix }) =>
        button(`Download ${title}`, () =>
          download(`${base}/calibration?format=${encodeURIComponent(id)}`, `${unit.serial}.${suffix}`),
        ),
      ),
    ),
  );
}

function versions(unit, rows, base, explore) {
  const act = (row) =>
    row.certified
      ? button("Revoke", () => askRevocation(base, row.version), { kind: "tiny" })
      : button("Certify", () => askCertification(base, row.version), { kind: "tiny" });
  return cardWithHeader(
    "Calibrations",
    null,
    table(
      [
        {
          title: "Version",
          cell: (row) =>
            h(
              "span",
              { class: "row tight" },
              h("a", { href: `${explore}&version=${row.version}` }, `${row.version}`),
              row.certified ? chip("in force", "good") : null,
            ),
        },
        {
          title: "Model",
          cell: (row) =>
            h(
              "span",
              {},
              modelName(row.model),
              row.parent ? h("span", { class: "muted small" }, ` from ${row.parent}`) : null,
            ),
        },
        {
          title: "Made",
          cell: (row) =>
            h(
              "div",
              { class: "nowrap" },
              instant(row.created_at),
              h("div", { class: "muted small" }, h("code", { title: `hash ${row.hash}` }, row.hash.slice(0, 10))),
            ),
        },
        { title: "RMS, deg/s", number: true, cell: (row) => number(row.rms_dps) },
        { title: "Unseen, deg/s", number: true, cell: (row) => number(row.heldout_rms_dps) },
        {
          title: "",
          cell: (row) =>
            h(
              "div",
              { class: "row tight", style: "gap: .2rem" },
              act(row),
              unit.formats.map(({ id, title, suffix }) =>
                button(
                  title,
                  () =>
                    download(
                      `${base}/calibration?version=${row.version}&format=${encodeURIComponent(id)}`,
                      `${unit.serial}-v${row.version}.${suffix}`,
                    ),
                  { kind: "tiny quiet" },
                ),
              ),
            ),
        },
      ],
      rows,
      { label: "Calibrations", selected: (row) => row.certified },
    ),
  );
}

function ladder(base, signal) {
  const place = h("div", { style: "min-height: 20rem" });
  loadInto(place, "Climbing down the ladder", async () => ladderFigure(await get(`${base}/ladder`, { signal })));
  return cardWithHeader("How the error fell", null, place);
}

/** Coefficients of one version, or of two side by side, and the uncertainty in use of the first. */
function versionCards(base, rows, signal) {
  const newest = rows[0].version;
  let [one, other] = [Number(query().version) || newest, Number(query().beside) || null];
  const place = h("div");
  const uncertainty = uncertaintyInUse(base, signal);
  const select = (label, value, none, onchange) =>
    h(
      "label",
      { class: "row small" },
      label,
      h(
        "select",
        { onchange: (event) => onchange(Number(event.target.value) || null) },
        none ? h("option", { value: "" }, "none") : null,
        rows.map((row) =>
          h("option", { value: row.version, selected: row.version === value }, `version ${row.version}`),
        ),
      ),
    );
  const ofOne = [0, 1].map(() =>
    select("of", one, false, (value) => {
      one = value;
      draw();
    }),
  );
  const draw = () => {
    updateQuery({ version: one === newest ? null : one, beside: other });
    for (const label of ofOne) label.querySelector("select").value = one;
    const asked = Promise.all(
      [one, other].map((version) => (version ? get(`${base}/calibrations/${version}`, { signal }) : null)),
    );
    loadInto(place, "Reading the coefficients", async () => {
      const [first, second] = await asked;
      return h("div", { class: "stack" }, second ? comparison(first, second) : null, coefficients(first, second));
    });
    asked.then(
      ([first]) => first.version === one && uncertainty.show(first),
      () => setChildren(uncertainty.element),
    );
  };
  draw();
  return [
    cardWithHeader(
      "Coefficients",
      h(
        "div",
        { class: "row" },
        ofOne[0],
        select("beside", other, true, (value) => {
          other = value;
          draw();
        }),
      ),
      place,
    ),
    cardWithHeader("Uncertainty in use (k = 2)", ofOne[1], uncertainty.element),
  ];
}
