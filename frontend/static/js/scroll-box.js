// A box that scrolls, such as a wide table, can be reached and scrolled by keyboard: it gets a stop of the Tab key
// while it is too narrow for what is in it, and none where everything is seen.

const BOXES = ".table-wrap, .sheet-table, .sheet figure, .secret, pre, .flaws, .strings";
const watched = new WeakSet();

const scrolls = (box) => box.scrollWidth > box.clientWidth + 1 || box.scrollHeight > box.clientHeight + 1;

// All are measured before one is changed: otherwise the browser lays the page out again for each box.
const look = (boxes) => {
  const stops = boxes.filter(scrolls);
  for (const box of boxes) if (box.tabIndex === 0 && !stops.includes(box)) box.removeAttribute("tabindex");
  for (const box of stops) box.tabIndex = 0;
};
const sizes = new ResizeObserver((entries) => look(entries.map(({ target }) => target)));

function watchAll() {
  const boxes = [...document.querySelectorAll(BOXES)];
  look(boxes.filter((box) => watched.has(box))); // their content may be another one; a new box is looked at once it is laid out
  for (const box of boxes) {
    if (!watched.has(box)) sizes.observe(box);
    watched.add(box);
  }
}

watchAll();
document.addEventListener("livepart", watchAll);
