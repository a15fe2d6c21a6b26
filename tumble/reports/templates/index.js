/* The table of sequences: sorted, searched, and gone through with the arrow keys */

const rows = () => [...document.querySelectorAll("#index tbody tr")];
const rowsShown = () => rows().filter((row) => !row.hidden);
const pickOf = (row) => row.querySelector(".pick");

/* Numbers as numbers, words as words; a cell without a value comes last in either direction. */
function compare(one, other, falling) {
  if (one === undefined || other === undefined) return (one === undefined) - (other === undefined);
  const numbers = Number(one) - Number(other);
  const order = Number.isNaN(numbers) ? one.localeCompare(other, "en", { numeric: true }) : numbers;
  return falling ? -order : order;
}

function sortBy(column) {
  const heads = [...document.querySelectorAll("#index thead th")], head = heads[column];
  const falling = head.getAttribute("aria-sort") === "ascending";
  heads.forEach((each) => each.setAttribute("aria-sort", each === head ? (falling ? "descending" : "ascending") : "none"));
  const valueOf = (row) => (column ? row.cells[column].dataset.value : pickOf(row).textContent);
  const sorted = rows().map((row) => [valueOf(row), row]).sort(([one], [other]) => compare(one, other, falling));
  document.querySelector("#index tbody").append(...sorted.map(([, row]) => row));
}

function filter() {
  const words = byId("find").value.trim().toLowerCase(), status = byId("status-choice").value;
  rows().forEach((row) => {
    row.hidden = !(pickOf(row).textContent.toLowerCase().includes(words) && (!status || row.dataset.status === status));
  });
  tellCount();
  reachable(rowsShown().find((row) => pickOf(row).getAttribute("aria-current")) || rowsShown()[0]);
}

function tellCount() {
  const all = rows().length, some = rowsShown().length;
  byId("count").textContent = some === all ? all + (all === 1 ? " sequence" : " sequences") : some + " of " + all + " sequences";
}

/* One button of the table is a stop of the tab key; the arrow keys go on from there. */
function reachable(wanted) {
  rows().forEach((row) => { pickOf(row).tabIndex = row === wanted ? 0 : -1; });
}

function walk(event) {
  const shown = rowsShown(), here = shown.findIndex((row) => row.contains(event.target));
  const goals = { ArrowUp: here - 1, ArrowDown: here + 1, Home: 0, End: shown.length - 1 };
  if (here < 0 || !(event.key in goals)) return;
  const goal = shown[Math.max(0, Math.min(shown.length - 1, goals[event.key]))];
  reachable(goal);
  pickOf(goal).focus();
  event.preventDefault();
}

function markPicked(number) {
  rows().forEach((row) => {
    const button = pickOf(row), here = Number(button.dataset.sequence) === number;
    if (here) { button.setAttribute("aria-current", "true"); reachable(row); } else button.removeAttribute("aria-current");
  });
}

function download() {
  const name = byId("table-choice").value, link = element("a", { download: name + ".csv" });
  link.href = URL.createObjectURL(new Blob([dataOf("csv-" + name)], { type: "text/csv" }));
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}
