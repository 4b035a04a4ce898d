// <search-box src="/api/v1/search" data-kinds='{"machine": "Machine", …}' data-none="…">
//   <form action="/search"><input type="search" name="q" …></form></search-box>
// Suggestions below the field while one types; without script the form leads to the page of results.
//
// "/" focuses the field from anywhere but another field, Escape empties the list and then leaves the field. Arrow keys
// choose a suggestion, Enter opens it; without a choice Enter sends the form. A combobox with a listbox (WAI-ARIA 1.2).

import { here } from "./root.js";

const PAUSE = 150; // ms after a key until the server is asked

class SearchBox extends HTMLElement {
  connectedCallback() {
    this.input = this.querySelector("input");
    this.list = document.createElement("ul");
    this.list.id = "search-hits";
    this.list.className = "search-hits";
    this.list.hidden = true;
    this.list.setAttribute("role", "listbox");
    this.list.setAttribute("aria-label", this.input.getAttribute("aria-label"));
    this.append(this.list);
    for (const [name, value] of Object.entries({
      role: "combobox", "aria-autocomplete": "list", "aria-expanded": "false", "aria-controls": this.list.id,
    })) this.input.setAttribute(name, value);
    this.words = JSON.parse(this.dataset.kinds);
    this.input.addEventListener("input", () => this.later());
    this.input.addEventListener("keydown", (event) => this.press(event));
    this.input.addEventListener("focus", () => this.input.value && this.later());
    this.list.addEventListener("pointerdown", (event) => event.preventDefault()); // the field keeps the focus until the click
    this.addEventListener("focusout", (event) => this.contains(event.relatedTarget) || this.close());
    this.onSlash = (event) => this.slash(event);
    document.addEventListener("keydown", this.onSlash);
  }

  disconnectedCallback() {
    document.removeEventListener("keydown", this.onSlash);
  }

  slash(event) {
    const typing = event.target.closest?.("input, textarea, select, [contenteditable]");
    if (event.key !== "/" || typing || event.ctrlKey || event.metaKey || event.altKey || document.querySelector("dialog[open]")) return;
    event.preventDefault();
    this.input.focus();
    this.input.select();
  }

  later() {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.ask(), PAUSE);
  }

  async ask() {
    const q = this.input.value.trim();
    this.asked = q;
    if (!q) return this.close();
    try {
      const answer = await fetch(`${this.getAttribute("src")}?${new URLSearchParams({ q })}`);
      if (!answer.ok) return this.close();
      const { items } = await answer.json();
      if (q === this.asked && this.contains(document.activeElement)) this.show(items);
    } catch {
      this.close(); // the form still works
    }
  }

  show(items) {
    const chosen = this.list.querySelectorAll("a")[this.chosen]?.href; // an answer that comes late takes no choice away
    this.list.replaceChildren(...items.map((item, at) => {
      const option = document.createElement("li");
      option.id = `search-hit-${at}`;
      option.setAttribute("role", "option");
      const link = document.createElement("a");
      link.href = here(item.path);
      link.tabIndex = -1;
      const kind = document.createElement("small");
      kind.textContent = this.words[item.kind] ?? item.kind;
      link.append(item.title, " ", kind);
      option.append(link);
      return option;
    }));
    if (!items.length) {
      const none = document.createElement("li");
      none.setAttribute("role", "option");
      none.setAttribute("aria-disabled", "true");
      none.textContent = this.dataset.none;
      this.list.append(none);
    }
    this.list.hidden = false;
    this.input.setAttribute("aria-expanded", "true");
    this.choose([...this.list.querySelectorAll("a")].findIndex((link) => link.href === chosen));
  }

  get options() {
    return [...this.list.querySelectorAll("[role=option]:not([aria-disabled])")];
  }

  choose(at) { // -1: none
    this.chosen = at;
    for (const [place, option] of this.options.entries()) option.setAttribute("aria-selected", place === at);
    this.options[at]?.scrollIntoView({ block: "nearest" });
    if (at < 0) this.input.removeAttribute("aria-activedescendant");
    else this.input.setAttribute("aria-activedescendant", this.options[at].id);
  }

  close() {
    clearTimeout(this.timer);
    this.asked = null;
    this.list.hidden = true;
    this.input.setAttribute("aria-expanded", "false");
    this.choose(-1);
  }

  press(event) {
    const { options } = this;
    if (event.key === "Escape") {
      event.preventDefault();
      if (this.list.hidden) this.input.blur();
      this.close();
    } else if ((event.key === "ArrowDown" || event.key === "ArrowUp") && !this.list.hidden && options.length) {
      event.preventDefault();
      const step = event.key === "ArrowDown" ? 1 : -1;
      this.choose((this.chosen + step + options.length + (this.chosen < 0 && step < 0 ? 1 : 0)) % options.length);
    } else if (event.key === "Enter" && !this.list.hidden && this.chosen >= 0) {
      event.preventDefault();
      options[this.chosen].querySelector("a").click();
    }
  }
}

customElements.define("search-box", SearchBox);
