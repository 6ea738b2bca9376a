// Printing: every figure whole, in light colours, whether it was scrolled to or not; a line says what is printed.

import { toast } from "./components.js";
import { h } from "./elements.js";
import { figuresOf } from "./figure.js";
import { messageOf } from "./http/errors.js";

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
    const endLight = lightColours();
    const line = sourceLine();
    document.querySelector("main")?.prepend(line);
    const figures = figuresOf(document);
    for (const figure of figures) figure.drawAt(PRINT_PX);
    restore = () => {
      restore = null;
      endLight();
      line.remove();
      for (const figure of figures) figure.drawAt(null);
    };
  });
  window.addEventListener("afterprint", () => restore?.());
  window.addEventListener("keydown", (event) => {
    if (!(event.ctrlKey || event.metaKey) || event.shiftKey || event.altKey || event.key.toLowerCase() !== "p") return;
    event.preventDefault(); // the browser would print before what was not scrolled to is drawn
    printPage();
  });
}

/** Show the light colours until the function that is returned is called. */
function lightColours() {
  const root = document.documentElement;
  const theme = root.dataset.theme;
  root.dataset.theme = "light";
  return () => {
    if (theme) root.dataset.theme = theme;
    else delete root.dataset.theme;
  };
}

/**
 * Print the page, or save it as PDF: the figures that were not scrolled to are drawn first. Those in three dimensions are
 * drawn by the graphics card frame by frame, and no frame comes while a page is printed: a picture stands for each.
 */
export async function printPage() {
  const endLight = lightColours();
  /** @type {HTMLElement[]} */
  const pictures = [];
  try {
    for (const figure of figuresOf(document)) {
      await figure.update();
      const picture = await figure.solidPicture(PRINT_PX);
      if (picture) pictures.push(picture);
    }
  } catch (error) {
    toast("bad", `Not every figure is printed: ${messageOf(error)}`);
  } finally {
    endLight();
  }
  window.print();
  for (const picture of pictures) picture.remove();
}
