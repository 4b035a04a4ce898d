// <table data-sortable> in a .table-wrap: headers sort by a click, and above a long table stands a field that filters its rows.
//
//   data-filter="…"   the label of that field; it appears from LONG rows on
//   th[data-fixed]    a column that is not sorted
//   td[data-value]    what is sorted by in place of the text
//
//   data-sort="…"     the label of the choice that sorts it where its rows are cards and have no heads (components.css)
//   data-listed="…"   what that choice shows while the rows are in the order of no column
//
// Numbers sort as numbers (−12.5, 1,234.5 µm), times of <time-ago> by their moment, words as people sort them, a choice by what is
// chosen. A second click turns the order. Without script the table is as the server made it. A live part that is fetched again keeps order and filter.

const LONG = 12; // rows; about a screen
const collator = new Intl.Collator(document.documentElement.lang || "en", { numeric: true, sensitivity: "base" });
const kept = new Map(); // of each table: {column, descending, filter}

function textOf(cell) {
  const choice = cell.querySelector("select");
  return (choice ? choice.selectedOptions[0]?.text ?? "" : cell.textContent).trim();
}

function valueOf(cell) {
  if (!cell) return "";
  if (cell.dataset.value) return cell.dataset.value;
  const at = cell.querySelector("time, time-ago");
  const moment = at?.getAttribute("datetime") ?? at?.getAttribute("at");
  return moment ?? textOf(cell);
}

function numberOf(text) {
  const found = /^[^\d+\-−]{0,3}([+\-−]?\d[\d,]*(?:\.\d+)?)(?!\d*[-:])/.exec(text);
  return found ? Number(found[1].replace("−", "-").replaceAll(",", "")) : NaN;
}

function compare(one, other) {
  if (!one || !other) return one ? -1 : other ? 1 : 0; // what is empty comes last
  const a = numberOf(one);
  const b = numberOf(other);
  return Number.isNaN(a) || Number.isNaN(b) ? collator.compare(one, other) : a - b;
}

const nameOf = (table) => table.id || table.closest("[id]")?.id || "";

function sort(table, column, descending) {
  const heads = [...table.tHead.rows[0].cells];
  for (const [at, head] of heads.entries()) {
    if (at === column) head.setAttribute("aria-sort", descending ? "descending" : "ascending");
    else head.removeAttribute("aria-sort");
  }
  const body = table.tBodies[0];
  const rows = [...body.rows].map((row) => [valueOf(row.cells[column]), row]);
  rows.sort(([a], [b]) => (descending && a && b ? -compare(a, b) : compare(a, b)));
  body.append(...rows.map(([, row]) => row));
}

function filter(table, text) {
  const words = text.toLowerCase().split(/\s+/).filter(Boolean);
  for (const row of table.tBodies[0].rows) {
    const own = [...row.cells].map(textOf).join(" ").toLowerCase();
    row.hidden = !words.every((word) => own.includes(word));
  }
}

function found(table) {
  const rows = [...table.tBodies[0].rows];
  for (const [column, head] of [...table.tHead.rows[0].cells].entries()) {
    const values = rows.map((row) => valueOf(row.cells[column]));
    const steps = values.slice(1).map((value, at) => compare(values[at], value));
    if (!head.dataset.words || steps.filter((step) => step === 0).length > steps.length / 2) continue; // a few words that chance put in order
    if (steps.every((step) => step <= 0)) return { column };
    if (steps.every((step) => step >= 0) && values.every(Boolean)) return { column, descending: true };
  }
  return {};
}

function sortBy(table) {
  const label = document.createElement("label");
  label.className = "sort-by";
  const select = document.createElement("select");
  select.id = `${nameOf(table)}-sort`;
  const { column, descending } = kept.get(nameOf(table))?.column === undefined ? found(table) : kept.get(nameOf(table));
  if (column === undefined) select.append(new Option(table.dataset.listed, ""));
  for (const [column, head] of [...table.tHead.rows[0].cells].entries())
    if (head.dataset.words)
      for (const way of ["ascending", "descending"])
        select.append(new Option(`${head.dataset.words} ${way === "ascending" ? "▴" : "▾"}`, `${column} ${way}`));
  if (column !== undefined) select.value = `${column} ${descending ? "descending" : "ascending"}`;
  select.addEventListener("change", () => {
    if (!select.value) return;
    const [chosen, way] = select.value.split(" ");
    sort(table, Number(chosen), way === "descending");
    remember(table, { column: Number(chosen), descending: way === "descending" });
  });
  label.append(table.dataset.sort, " ", select);
  table.closest(".table-wrap").before(label);
}

function remember(table, changes) {
  kept.set(nameOf(table), { ...kept.get(nameOf(table)), ...changes });
}

function equip(table) {
  if (table.dataset.equipped || !table.tHead) return;
  table.dataset.equipped = "yes";
  const before = kept.get(nameOf(table)) ?? {};
  for (const [column, head] of [...table.tHead.rows[0].cells].entries()) {
    if (!head.textContent.trim() || head.hasAttribute("data-fixed")) continue;
    const button = document.createElement("button");
    button.type = "button";
    button.className = "sorts";
    head.dataset.words = wordsOf(head); // for paper
    const term = head.querySelector("[data-term]"); // a link beside the button, not in it
    button.append(...[...head.childNodes].filter((node) => node !== term));
    button.addEventListener("click", () => {
      const descending = head.getAttribute("aria-sort") === "ascending";
      sort(table, column, descending);
      remember(table, { column, descending });
    });
    head.prepend(button);
  }
  if (before.column !== undefined) sort(table, before.column, before.descending);
  if (table.dataset.sort && table.tBodies[0].rows.length > 1) sortBy(table);
  if (table.dataset.filter && table.tBodies[0].rows.length >= LONG) {
    const label = document.createElement("label");
    label.className = "table-filter";
    const field = document.createElement("input");
    field.type = "search";
    field.id = `${nameOf(table)}-filter`; // a live part keeps the focus by it
    field.value = before.filter ?? "";
    field.addEventListener("input", () => {
      filter(table, field.value);
      remember(table, { filter: field.value });
    });
    label.append(table.dataset.filter, " ", field);
    table.closest(".table-wrap").before(label);
    if (field.value) filter(table, field.value);
  }
}

const wordsOf = (head) =>
  [...head.childNodes].filter((node) => !node.matches?.("[data-term]")).map((node) => node.textContent).join("").trim();

const equipAll = () => document.querySelectorAll("table[data-sortable]").forEach(equip);
equipAll();
document.addEventListener("livepart", equipAll);
