// The sentences on a draft, as a page says them.

/**
 * The text with the button of the page in place of the command that puts a version in force.
 * @param {string} text
 */
export const withButtonNamed = (text) =>
  text.replace(/`labctl certify [^`]*`/g, "the button “Certify: put in force” on the page of the unit");
