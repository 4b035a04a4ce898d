// What every page loads: the custom elements, and the small behaviours of plain markup.
//
//   data-opens="id"     a button that opens the <dialog> with that id
//   data-closes         a button that closes the dialog it is in
//   <dialog data-open>  is open from the start (a form that came back with errors)
//
// A click on the backdrop and Escape close a dialog too. A form is sent once: its buttons rest until the answer is there.
// A form that came back with errors is shown at the first field that is wrong, however far down it stands.

import "./live-status.js";
import "./live-part.js";
import "./alarm-signal.js";
import "./search-box.js";
import "./scroll-box.js";
import "./theme-switch.js";
import "./times.js";

// What only some pages have is loaded where it stands: with the page, or with a live part that brings it.
const SOMETIMES = [
  ["plotly-chart", "./plotly-chart.js"], ["period-presets", "./period-presets.js"], ["table[data-sortable], table.as-cards", "./table-tools.js"],
  [".picker, .period-picker", "./pickers.js"], ["[data-term]", "./terms.js"], ["notify-here", "./notify-here.js"],
];
function load() {
  for (const [selector, module] of SOMETIMES) if (document.querySelector(selector)) import(module);
}
load();
document.addEventListener("livepart", load);
if (globalThis.Notification?.permission === "granted" && document.querySelector("meta[name=person]")) import("./notices.js");

document.addEventListener("click", (event) => {
  const opener = event.target.closest("[data-opens]");
  if (opener) document.getElementById(opener.dataset.opens)?.showModal();
  if (event.target.closest("[data-closes]")) event.target.closest("dialog")?.close();
  if (event.target instanceof HTMLDialogElement) {
    const box = event.target.getBoundingClientRect();
    const inside = event.clientX >= box.left && event.clientX <= box.right && event.clientY >= box.top && event.clientY <= box.bottom;
    if (!inside) event.target.close();
  }
});

document.addEventListener("submit", (event) => {
  if (event.defaultPrevented || event.target.method === "dialog") return;
  if (event.target.dataset.sent) event.preventDefault();
  event.target.dataset.sent = "yes";
});
// An address says what was asked for, and no more (app/web/page_queries.py has the forms in which an empty field says something).
document.addEventListener("formdata", ({ target: form, formData }) => {
  if (form.method !== "get" || "keepsEmpty" in form.dataset) return;
  for (const name of new Set(formData.keys())) {
    const said = formData.getAll(name).filter((value) => value !== "");
    formData.delete(name);
    for (const value of said) formData.append(name, value);
  }
});
// Going back to a page must not leave its forms dead.
window.addEventListener("pageshow", () => document.querySelectorAll("form[data-sent]").forEach((form) => delete form.dataset.sent));

for (const dialog of document.querySelectorAll("dialog[data-open]")) dialog.showModal();
for (const chosen of document.querySelectorAll(".tabs > [aria-current]")) { // on a narrow screen the tabs are one line that is swiped
  const [line, tab] = [chosen.parentElement.getBoundingClientRect(), chosen.getBoundingClientRect()];
  chosen.parentElement.scrollLeft += tab.x + tab.width / 2 - line.x - line.width / 2;
}
document.querySelector("dialog[open] [aria-invalid], main [aria-invalid]")?.focus();
