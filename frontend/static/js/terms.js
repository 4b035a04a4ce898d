// <a data-term href="/help/reference/glossary#term-zero-range" title="Its sentence of the glossary">R33</a>
// A click, a touch or Enter shows the sentence in place; the link in it leads to the row of the glossary. With Ctrl, in a tab of its
// own, and without script the link leads there at once.

const note = document.createElement("div");
note.className = "term-note";
note.popover = "auto"; // Escape and a touch elsewhere close it
const sentence = document.createElement("p");
const more = document.createElement("a");
note.append(sentence, more);
document.body.append(note);

function place(term) {
  const edge = 8;
  const at = term.getBoundingClientRect();
  const left = Math.min(at.left, innerWidth - note.offsetWidth - edge);
  const below = at.bottom + 6;
  const fits = below + note.offsetHeight < innerHeight;
  note.style.left = `${Math.max(edge, left)}px`;
  note.style.top = `${fits ? below : Math.max(edge, at.top - note.offsetHeight - 6)}px`;
}

document.addEventListener("click", (event) => {
  const term = event.target.closest("[data-term]");
  if (!term || event.ctrlKey || event.metaKey || event.shiftKey) return;
  event.preventDefault();
  sentence.textContent = term.title;
  more.href = term.href;
  more.textContent = `${term.textContent.trim()} · ${document.querySelector("meta[name=glossary]").content}`;
  (term.closest("dialog[open]") ?? document.body).append(note); // what lies outside an open dialog cannot be touched
  note.showPopover({ source: term });
  place(term);
});
addEventListener("scroll", () => note.matches(":popover-open") && note.hidePopover(), { passive: true });
