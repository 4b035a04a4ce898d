// <setting-map><table role="grid">…cells with a link…</table></setting-map> – a grid of links that is one stop of the Tab key:
// arrows go from cell to cell, Home and End along the row, with Ctrl to the corners; Enter follows the link as ever.
// The link with data-chosen is where one begins; after it was followed (…#replay) it has the focus again.
// Without script every cell is a link in its place.

class SettingMap extends HTMLElement {
  connectedCallback() {
    this.rows = [...this.querySelectorAll("tbody tr")].map((row) => [...row.querySelectorAll("td")]);
    const links = [...this.querySelectorAll("td a")];
    if (!links.length) return;
    const start = this.querySelector("[data-chosen]") ?? links[0];
    for (const link of links) link.tabIndex = link === start ? 0 : -1;
    this.addEventListener("keydown", (event) => this.move(event));
    if (location.hash !== "#replay" || start.dataset.chosen === undefined) return;
    const focus = () => start.focus({ preventScroll: true }); // after the browser has gone to #replay, which takes the focus away
    if (document.readyState === "complete") focus();
    else addEventListener("load", focus, { once: true });
  }

  move(event) {
    const cell = event.target.closest("td");
    const steps = { ArrowUp: [-1, 0], ArrowDown: [1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1] };
    if (!cell || event.altKey || event.metaKey || !(event.key in steps || event.key === "Home" || event.key === "End")) return;
    const row = this.rows.findIndex((cells) => cells.includes(cell));
    const column = this.rows[row].indexOf(cell);
    let found = null;
    if (event.key in steps) {
      const [down, right] = steps[event.key];
      for (let r = row + down, c = column + right; this.rows[r]?.[c] && !found; r += down, c += right) found = this.rows[r][c].querySelector("a");
    } else {
      const wide = event.ctrlKey ? this.rows.flat() : this.rows[row];
      const links = wide.map((each) => each.querySelector("a")).filter(Boolean);
      found = event.key === "Home" ? links[0] : links.at(-1);
    }
    event.preventDefault();
    if (!found) return;
    event.target.tabIndex = -1;
    found.tabIndex = 0;
    found.focus();
  }
}
customElements.define("setting-map", SettingMap);
