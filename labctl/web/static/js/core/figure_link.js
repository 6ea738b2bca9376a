// The address of one figure: that of the page, with `#figure=NAME`; a page that is opened so shows the figure.

/** Frames after which a figure that never came onto the page is no longer waited for. */
const MAX_FRAMES = 1200;

/** @param {string} slug */
export function figureAddress(slug) {
  const address = new URL(location.href);
  address.hash = `figure=${slug}`;
  return address.href;
}

/**
 * Bring a figure into view as soon as it is on the page, where the address names it.
 * @param {HTMLElement} element
 * @param {string} slug
 */
export function showIfAsked(element, slug) {
  if (location.hash !== `#figure=${slug}`) return;
  let frames = 0;
  const look = () => {
    if (element.isConnected) element.scrollIntoView({ block: "center" });
    else if ((frames += 1) < MAX_FRAMES) requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
}
