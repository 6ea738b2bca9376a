// Addresses of files that are no modules: in the release of the pages from which this module was loaded.

/**
 * Return the address of a file below `/static/`.
 * @param {string} name
 */
export const staticUrl = (name) => new URL(`../../${name}`, import.meta.url).href;
