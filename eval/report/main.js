// Starts the page. What it made is there for scripts that test it, as `window.diorama`.
{
  const data = JSON.parse(document.getElementById("data").textContent), page = document.getElementById("page");
  const toggleTheme = setUpTheme();
  document.getElementById("help-button").addEventListener("click", () => document.getElementById("help").showModal());
  const build = { run: buildRunPage, sweep: buildSweepPage, reproduce: buildReproducePage }[data.kind];
  window.diorama = { data, ...build(page, data, toggleTheme) };
}
