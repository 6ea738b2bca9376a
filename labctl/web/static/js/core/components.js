// User interface components that several pages use.

import { Problem, Unreachable } from "./api.js";
import { setChildren, uniqueId, h } from "./elements.js";

/** A card with a heading. */
export function card(title, ...children) {
  return h("section", { class: "card stack", "aria-label": title }, h("h2", {}, title), ...children);
}

export function cardWithHeader(title, beside, ...children) {
  return h(
    "section",
    { class: "card stack", "aria-label": title },
    h("div", { class: "card-header" }, h("h2", {}, title), beside),
    ...children,
  );
}

/** Header of a page: its h1, a line below, and actions at the right. */
export function pageHeader(title, line, ...acts) {
  return h(
    "header",
    { class: "page-header" },
    h("div", {}, h("h1", {}, title), line ? h("p", { class: "muted" }, line) : null),
    acts.length ? h("div", { class: "row" }, ...acts) : null,
  );
}

/** A description list: [name, value, unit, secondary text]. */
export function factList(rows) {
  return h(
    "dl",
    { class: "facts" },
    rows
      .filter(Boolean)
      .map(([name, value, unit, beside]) =>
        h(
          "div",
          { class: "fact" },
          h("dt", {}, name),
          h(
            "dd",
            {},
            value,
            unit ? [" ", h("span", { class: "unit" }, unit)] : null,
            beside ? h("span", { class: "secondary" }, beside) : null,
          ),
        ),
      ),
  );
}

export const chip = (text, kind = "") => h("span", { class: `chip ${kind}` }, text);
/** A model's name, which may break after each part: yang2018+ scale_factor_asymmetry. */
export const modelName = (name) => (name ?? "").split(/(?<=\+)/).flatMap((part, k) => (k ? [h("wbr"), part] : [part]));
export const notice = (kind, ...children) =>
  h("div", { class: `notice ${kind}`, role: kind === "bad" ? "alert" : "status" }, ...children);
/** The warnings of a fit or of a change, null without any. */
export const fitWarnings = (answer) =>
  answer.warnings?.length
    ? notice(
        "bad",
        answer.warnings.map((each) => h("p", {}, `${each.severity === "certain" ? "Wrong" : "Check"}: ${each.text}`)),
      )
    : null;
export const emptyState = (...children) => h("div", { class: "empty stack" }, ...children);
export const busyIndicator = (text) => h("p", { class: "busy muted", role: "status" }, text);

/** A table: columns are {title, number?, prose?, cell(row)}. On a phone its rows become cards, unless they are `dense`. */
export function table(columns, rows, { label, selected, onrow, first, dense } = {}) {
  return h(
    "div",
    { class: "table-scroll", tabindex: "0", role: "region", "aria-label": label },
    h(
      "table",
      { class: dense ? "data" : "data cards", style: first ? `--first-column: ${first}` : null },
      h(
        "thead",
        {},
        h(
          "tr",
          {},
          columns.map((c) => h("th", { class: c.number ? "number" : null, scope: "col" }, c.title)),
        ),
      ),
      h(
        "tbody",
        {},
        rows.map((row) =>
          h(
            "tr",
            { "aria-selected": selected?.(row) ? "true" : null, onclick: onrow ? () => onrow(row) : null },
            columns.map((c) =>
              h(
                "td",
                {
                  class: c.number ? "number" : c.prose ? "prose" : null,
                  "data-title": typeof c.title === "string" && c.title ? c.title : null,
                },
                h("div", {}, c.cell(row)),
              ),
            ),
          ),
        ),
      ),
    ),
  );
}

/** Labelled select: options are [value, text]. */
export function selectField(label, options, value, onchange) {
  const id = uniqueId("choice");
  return h(
    "div",
    { class: "field" },
    h("label", { for: id }, label),
    h(
      "select",
      { id, onchange: (event) => onchange(event.target.value) },
      options.map(([each, text]) => h("option", { value: each, selected: String(each) === String(value) }, text)),
    ),
  );
}

export function labelledField(label, input, hint) {
  const id = uniqueId("field");
  input.id = id;
  if (hint) input.setAttribute("aria-describedby", `${id}-hint`);
  return h(
    "div",
    { class: "field" },
    h("label", { for: id }, label),
    input,
    hint ? h("span", { class: "hint", id: `${id}-hint` }, hint) : null,
  );
}

/** A group of buttons of which one is pressed: options are [value, text]. */
export function toggleGroup(label, options, value, onchange) {
  const buttons = options.map(([each, text]) =>
    h(
      "button",
      {
        type: "button",
        "aria-pressed": String(each === value),
        onclick: () => {
          buttons.forEach((button, k) => button.setAttribute("aria-pressed", String(options[k][0] === each)));
          onchange(each);
        },
      },
      text,
    ),
  );
  return h("div", { class: "tabs", role: "group", "aria-label": label }, buttons);
}

/** A button with an asynchronous action: disabled and marked busy until the action ends. */
export function button(text, act, { kind = "", done } = {}) {
  const element = h(
    "button",
    {
      type: "button",
      class: `button ${kind}`,
      onclick: async () => {
        element.disabled = true;
        element.classList.add("busy");
        try {
          await act();
          if (done) toast("good", done);
        } catch (error) {
          if (error.name !== "AbortError") toast("bad", error.message);
        } finally {
          element.disabled = false;
          element.classList.remove("busy");
        }
      },
    },
    text,
  );
  return element;
}

/** Error page: title, message, and a button to try again. */
export function errorPage(error, again) {
  const what =
    error instanceof Problem
      ? error.title
      : error instanceof Unreachable
        ? "No answer"
        : "Something went wrong on this page";
  if (!(error instanceof Problem || error instanceof Unreachable)) console.error(error);
  return h(
    "div",
    { class: "page" },
    h("h1", {}, what),
    notice("bad", h("p", {}, error.message)),
    again
      ? h("div", { class: "row" }, h("button", { class: "button", type: "button", onclick: again }, "Try again"))
      : null,
  );
}

/** Show a toast; an error stays until it is closed. */
export function toast(kind, text) {
  const corner = document.querySelector(".toasts");
  const element = notice(
    kind,
    h("span", {}, text),
    h(
      "button",
      { class: "button quiet tiny", type: "button", "aria-label": "Close", onclick: () => element.remove() },
      "✕",
    ),
  );
  corner.append(element);
  if (kind !== "bad") setTimeout(() => element.remove(), 6000);
}

/** Modal dialog with a form: resolves to {name: value}, or null when cancelled. `fields`: [{name, label, value, hint, type, required, minlength}].
 * A checkbox resolves to true or false. `body`: an element above the fields. */
export function dialog(title, fields, { text, body, confirm = "Go on", kind = "primary" } = {}) {
  return new Promise((resolve) => {
    const inputs = fields.map((f) =>
      h("input", {
        name: f.name,
        type: f.type ?? "text",
        value: f.value ?? "",
        minlength: f.minlength ?? null,
        required: f.required !== false,
        autocomplete: "off",
      }),
    );
    const name = uniqueId("dialog");
    const box = h(
      "dialog",
      { "aria-labelledby": name },
      h(
        "form",
        {
          method: "dialog",
          onsubmit: (event) => {
            event.preventDefault();
            box.close("yes");
          },
        },
        h("h2", { id: name }, title),
        text ? h("p", { class: "muted" }, text) : null,
        body ?? null,
        fields.map((f, k) => labelledField(f.label, inputs[k], f.hint)),
        h(
          "div",
          { class: "row", style: "justify-content: flex-end" },
          h("button", { class: "button quiet", type: "button", onclick: () => box.close() }, "Cancel"),
          h("button", { class: `button ${kind}`, type: "submit" }, confirm),
        ),
      ),
    );
    box.addEventListener("close", () => {
      box.remove();
      resolve(
        box.returnValue === "yes"
          ? Object.fromEntries(
              inputs.map((input) => [input.name, input.type === "checkbox" ? input.checked : input.value]),
            )
          : null,
      );
    });
    document.body.append(box);
    box.showModal();
    inputs[0]?.focus();
  });
}

/** Show a busy indicator in `place`, then the element that `make()` resolves to, or its error. */
export async function loadInto(place, text, make) {
  setChildren(place, busyIndicator(text));
  try {
    setChildren(place, await make());
  } catch (error) {
    if (error.name !== "AbortError") setChildren(place, notice("bad", error.message));
  }
  return place;
}
