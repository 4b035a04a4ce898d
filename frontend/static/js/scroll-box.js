// A box that scrolls, such as a wide table, can be reached and scrolled by keyboard: it gets a stop of the Tab key
// while it is too narrow for what is in it, and none where everything is seen.

const BOXES = ".table-wrap, .sheet-table, .sheet figure, .secret, pre, .flaws, .strings";
const watched = new WeakSet();

const look = (box) => {
  const scrolls = box.scrollWidth > box.clientWidth + 1 || box.scrollHeight > box.clientHeight + 1;
  if (scrolls) box.tabIndex = 0;
  else box.removeAttribute("tabindex");
};
const sizes = new ResizeObserver((entries) => entries.forEach(({ target }) => look(target)));

function watchAll() {
  for (const box of document.querySelectorAll(BOXES)) {
    look(box);
    if (!watched.has(box)) sizes.observe(box);
    watched.add(box);
  }
}

watchAll();
document.addEventListener("livepart", watchAll);
