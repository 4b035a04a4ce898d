// <a data-confirm href="PAGE">: the #confirm of that page opens in <dialog id="confirm-dialog">, in place of going there.
//
//   data-trouble on the dialog   what it says when the server does not answer
//   data-close                   what its button to close is called then
//
// A dialog whose reason is neither picked nor written is not sent: its [data-unchosen] says so.
// Without script, or with a page that has no #confirm (signed out, done meanwhile), the link is simply followed.
// What the page before has done (?done=, ?late=) leaves the address, so that loading it again does not say it again.

import "./photo-box.js";

const dialog = document.getElementById("confirm-dialog");
let asking = false;

async function ask(link) {
  asking = true;
  link.setAttribute("aria-busy", "true");
  try {
    const answer = await fetch(link.href, { signal: AbortSignal.timeout(15_000) });
    const page = new DOMParser().parseFromString(await answer.text(), "text/html");
    const part = page.getElementById("confirm");
    if (!answer.ok || !part) return void location.assign(link.href);
    dialog.replaceChildren(document.adoptNode(part));
  } catch {
    const head = Object.assign(document.createElement("div"), { className: "dialog-body" });
    const close = Object.assign(document.createElement("button"), { className: "button big", textContent: dialog.dataset.close });
    close.dataset.closes = "";
    head.append(Object.assign(document.createElement("p"), { textContent: dialog.dataset.trouble }), close);
    dialog.replaceChildren(head);
  } finally {
    asking = false;
    link.removeAttribute("aria-busy");
  }
  dialog.showModal();
  dialog.querySelector("[autofocus], .button.primary")?.focus({ preventScroll: true });
}

document.addEventListener("click", (event) => {
  if (event.target.closest("dialog a[data-closes]")) event.preventDefault();
  const link = event.target.closest("a[data-confirm]");
  if (!link || !dialog || event.button || event.ctrlKey || event.metaKey || event.shiftKey) return;
  event.preventDefault();
  if (!asking) ask(link);
});

dialog?.addEventListener(
  "submit",
  (event) => {
    const form = event.target;
    const unchosen = form.querySelector("[data-unchosen]");
    const chips = unchosen?.closest("fieldset");
    if (!chips || chips.querySelector(":checked") || form.elements.more?.value.trim()) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    unchosen.hidden = false;
    chips.querySelector("input").focus();
    chips.scrollIntoView({ block: "nearest" });
    form.addEventListener("input", () => (unchosen.hidden = true), { once: true });
  },
  true,
);

const here = new URL(location.href);
if (here.searchParams.has("done") || here.searchParams.has("late")) {
  here.searchParams.delete("done");
  here.searchParams.delete("late");
  history.replaceState(null, "", here);
}
