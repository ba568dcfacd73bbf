// Sphinx's search asks for pages to show excerpts of them; the answer is in page_texts.js, so that nothing is fetched.
window.fetch = (address) => {
  const page = new URL(address, location.href).pathname;
  const name = Object.keys(PAGE_TEXTS)
    .filter((name) => page.endsWith(`/${name}.html`))
    .sort((one, other) => other.length - one.length)[0];
  const text = `<div role="main">${PAGE_TEXTS[name] || ""}</div>`;
  return Promise.resolve({ text: () => Promise.resolve(text) });
};

// Sphinx looks for stems ("batteri"), which no text has: an excerpt begins at the first word of the query that is there.
document.addEventListener("DOMContentLoaded", () => {
  const ofStems = Search.makeSearchSummary;
  const words = (new URLSearchParams(location.search).get("q") || "").split(/\s+/).filter((word) => word);
  Search.makeSearchSummary = (text, stems, anchor) => ofStems(text, [...stems, ...words.reverse()], anchor);
});
