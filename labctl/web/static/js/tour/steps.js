// The steps of the tour on the page Explore: which part of the page each is about, and what it says.

/**
 * A step of the tour: `anchor` selects the part of the page.
 * @typedef {{ anchor: string, title: string, text: string }} Step
 */

/** @type {readonly Step[]} */
export const STEPS = [
  {
    anchor: ".verdict",
    title: "What the measurements say of the model",
    text: "labctl has fitted the model and compared it with every data set. The verdict says whether something is missing, and how the error that is left compares with the noise.",
  },
  {
    anchor: "#fails",
    title: "Where the model fails",
    text: "Each cell is a rate and a temperature; its colour is what the model leaves, in units of the noise. A pattern means that something physical is missing. Select cells, and they are marked in all figures.",
  },
  {
    anchor: "#learn",
    title: "Which physical effect is missing",
    text: "The effects of the catalogue that explain the residual, each with its evidence and the size it would have. “Draw” shows the part that an effect explains; its name leads to its equation and its source.",
  },
  {
    anchor: "#add",
    title: "Add it",
    text: "Press “Add” beside a suspect: the changed model is fitted, and nothing is stored. Then press “Make version” here: the tour goes on with the new version, and the present one stays as it is.",
  },
  {
    anchor: "#finish, #watch",
    title: "Watch the error fall",
    text: "The error of each version on the data it was fitted to, and on temperatures left out of the fit, down to the noise. When nothing is missing any more, “Certify” at the top of this page puts the version in force.",
  },
];
