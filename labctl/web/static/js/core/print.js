// Printing: every figure whole, in light colours, whether it was scrolled to or not; a line says what is printed.

import { h } from "./elements.js";
import { figuresOf } from "./figure.js";

/** Width of a figure on paper (A4 or letter, upright, with the margins of the browser and of a card), CSS px. */
const PRINT_PX = 650;

/** What is printed, from where and when. */
function sourceLine() {
  const source = document.querySelector("main [data-source]")?.getAttribute("data-source");
  const printed = `printed ${new Date().toISOString().slice(0, 19)}Z`;
  return h("p", { class: "print-line small" }, [source, location.href, printed].filter(Boolean).join("; "));
}

/** Register what a page does before and after it is printed. */
export function preparePrinting() {
  /** @type {(() => void) | null} */
  let restore = null;
  window.addEventListener("beforeprint", () => {
    restore?.();
    const root = document.documentElement;
    const theme = root.dataset.theme;
    root.dataset.theme = "light";
    const line = sourceLine();
    document.querySelector("main")?.prepend(line);
    const figures = figuresOf(document);
    for (const figure of figures) figure.drawAt(PRINT_PX);
    restore = () => {
      restore = null;
      if (theme) root.dataset.theme = theme;
      else delete root.dataset.theme;
      line.remove();
      for (const figure of figures) figure.drawAt(null);
    };
  });
  window.addEventListener("afterprint", () => restore?.());
}

/** Print the page, or save it as PDF: the figures that were not scrolled to are drawn first. */
export async function printPage() {
  for (const figure of figuresOf(document)) await figure.update();
  window.print();
}
