// Sets the theme before the first paint, so that a dark page never flashes white. Not a module for that reason.
(() => {
  const wanted = localStorage.getItem("labctl.theme");
  const dark = wanted ? wanted === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
  document.documentElement.dataset.theme = dark ? "dark" : "light";
})();
