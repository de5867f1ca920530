// The table: sorts by its headers, filters by status and words, unfolds a row at a time.
document.documentElement.classList.add("js");
const table = document.getElementById("table");
const bodies = table ? [...table.tBodies] : [];
const search = document.getElementById("search");

function unfold(body, open) {
  const button = body.querySelector(".open"), fold = body.querySelector(".fold");
  button.setAttribute("aria-expanded", String(open));
  fold.classList.toggle("unfolded", open);
  const root = fold.querySelector(".viewer");
  if (open && root && !root.dataset.begun) {
    root.dataset.begun = "yes";
    new Viewer(root).load().catch((error) => { root.querySelector(".value").textContent = `The images cannot be shown: ${error.message}`; });
  }
}

function filter() {
  const wanted = document.querySelector("#filter input:checked").value, words = search.value.toLowerCase().split(/\s+/);
  let shown = 0;
  for (const body of bodies) {
    const text = body.querySelector(".line").textContent.toLowerCase();
    const fits = (wanted === "all" || body.dataset.status === wanted) && words.every((word) => text.includes(word));
    body.hidden = !fits;
    shown += fits;
  }
  document.getElementById("shown").textContent = `${shown} of ${bodies.length} shown`;
  const none = document.getElementById("none");
  if (none) none.hidden = shown > 0;
}

function sort(header) {
  const headers = [...header.parentElement.cells], column = headers.indexOf(header);
  const direction = header.getAttribute("aria-sort") === "ascending" ? -1 : 1;
  for (const other of headers) if (other.hasAttribute("aria-sort")) other.setAttribute("aria-sort", "none");
  header.setAttribute("aria-sort", direction > 0 ? "ascending" : "descending");
  const numeric = header.classList.contains("n");
  const value = (body) => {
    const cell = body.rows[0].cells[column], text = cell.dataset.value ?? cell.textContent;
    return numeric ? (text === "" ? null : Number(text)) : text;
  };
  const order = (a, b) => (numeric ? a - b : a.localeCompare(b, undefined, { numeric: true }));
  const keyed = bodies.map((body) => [value(body), body]);
  keyed.sort(([a, p], [b, q]) => {
    if (a === null || b === null) return (a === null) - (b === null); // nothing measured: last either way
    return direction * order(a, b) || p.dataset.index - q.dataset.index;
  });
  table.append(...keyed.map(([, body]) => body));
}

function fromAddress() {
  const body = document.getElementById(location.hash.slice(1));
  if (body && bodies.includes(body)) { unfold(body, true); body.scrollIntoView(); }
}

if (table) {
  document.getElementById("filter").addEventListener("change", filter);
  search.addEventListener("input", filter);
  table.tHead.addEventListener("click", ({ target }) => { const th = target.closest("th"); if (th && th.hasAttribute("aria-sort")) sort(th); });
  for (const body of bodies) {
    body.querySelector(".line").addEventListener("click", () => unfold(body, body.querySelector(".open").getAttribute("aria-expanded") !== "true"));
  }
  filter();
  fromAddress();
  window.addEventListener("hashchange", fromAddress);
  if (!location.hash && bodies.length && bodies[0].dataset.status === "failing") unfold(bodies[0], true);
}
