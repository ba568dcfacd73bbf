// Tells cells of tables with many columns the name of their column, which phones show (site.css).
document.addEventListener("DOMContentLoaded", () => {
  for (const table of document.querySelectorAll("article table.docutils")) {
    const names = [...table.querySelectorAll("thead th")].map((cell) => cell.textContent.trim());
    if (names.length < 4) continue;
    table.classList.add("many-columns");
    for (const row of table.querySelectorAll("tbody tr"))
      [...row.cells].forEach((cell, at) => {
        cell.dataset.column = names[at] || "";
        cell.classList.toggle("empty", !cell.textContent.trim());
      });
  }
});
