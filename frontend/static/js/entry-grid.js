// <entry-grid data-too-much="…"><table>…<input>…</table><p class="too-much" hidden></p></entry-grid>: typing into a grid of fields.
//
//   Enter, arrow down/up   the cell below/above; Enter in the last line goes to the top of the next column
//   arrow left/right       the next cell, once the cursor is at that end of what is typed
//   paste                  a block with tabs or several lines fills the cells from this one on, right and down
//
// data-too-much: said where a pasted block reaches beyond the grid; what fits is filled in all the same.
// Without this script the fields are typed into one by one with Tab, and tables are pasted into the field below the grid.

class EntryGrid extends HTMLElement {
  connectedCallback() {
    this.keys = (event) => this.key(event);
    this.pasting = (event) => this.paste(event);
    this.addEventListener("keydown", this.keys);
    this.addEventListener("paste", this.pasting);
  }

  disconnectedCallback() {
    this.removeEventListener("keydown", this.keys);
    this.removeEventListener("paste", this.pasting);
  }

  /** The fields, line by line. */
  get lines() {
    return [...this.querySelectorAll("tbody tr")].map((row) => [...row.querySelectorAll("input")]);
  }

  place(input) {
    const lines = this.lines;
    const row = lines.findIndex((line) => line.includes(input));
    return { lines, row, column: row < 0 ? -1 : lines[row].indexOf(input) };
  }

  key(event) {
    const input = event.target;
    if (!(input instanceof HTMLInputElement) || event.ctrlKey || event.metaKey || event.altKey) return;
    const { lines, row, column } = this.place(input);
    if (row < 0) return;
    const atStart = input.selectionEnd === 0;
    const atEnd = input.selectionStart === input.value.length;
    let next = null;
    switch (event.key) {
      case "Enter":
      case "ArrowDown":
        next = lines[row + 1]?.[column] ?? (event.key === "Enter" ? lines[0][column + 1] : null);
        break;
      case "ArrowUp":
        next = lines[row - 1]?.[column];
        break;
      case "ArrowLeft":
        if (!atStart) return;
        next = lines[row][column - 1];
        break;
      case "ArrowRight":
        if (!atEnd) return;
        next = lines[row][column + 1];
        break;
      default:
        return;
    }
    event.preventDefault(); // Enter stores nothing: a study is stored by its button
    next?.focus();
    next?.select();
  }

  paste(event) {
    const text = event.clipboardData?.getData("text/plain") ?? "";
    const block = text.replace(/\r\n?/g, "\n").replace(/\n+$/, "").split("\n").map((line) => line.split("\t"));
    if (!(event.target instanceof HTMLInputElement) || (block.length === 1 && block[0].length === 1)) return;
    event.preventDefault();
    const { lines, row, column } = this.place(event.target);
    let beyond = false;
    let last = event.target;
    block.forEach((cells, down) => {
      cells.forEach((cell, right) => {
        const field = lines[row + down]?.[column + right];
        if (!field) {
          beyond ||= cell.trim() !== "";
          return;
        }
        field.value = cell.trim();
        field.removeAttribute("aria-invalid");
        last = field;
      });
    });
    last.focus();
    const said = this.querySelector(".too-much");
    said.textContent = beyond ? this.dataset.tooMuch : "";
    said.hidden = !beyond;
  }
}
customElements.define("entry-grid", EntryGrid);
