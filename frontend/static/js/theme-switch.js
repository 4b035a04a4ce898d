// <theme-switch data-auto data-light data-dark data-label>: light, dark, or as the system has it.
// The choice is kept in the cookie `inband_theme`, which the server reads to write <html data-theme>, so a page is right
// from its first paint. Everyone who draws by himself is told by the event "themechange" on document.

const ORDER = ["auto", "light", "dark"];
const SHAPES = {
  auto: '<circle cx="12" cy="12" r="9"/><path d="M12 3a9 9 0 0 1 0 18z" fill="currentColor"/>',
  light: '<circle cx="12" cy="12" r="4"/><path d="M12 2v3M12 19v3M2 12h3M19 12h3M5 5l2 2M17 17l2 2M5 19l2-2M17 7l2-2"/>',
  dark: '<path d="M20 14.5A8.5 8.5 0 0 1 9.5 4a8.5 8.5 0 1 0 10.5 10.5z"/>',
};
const system = matchMedia("(prefers-color-scheme: dark)");

export function theme() {
  return document.documentElement.dataset.theme ?? (system.matches ? "dark" : "light");
}

const changed = () => document.dispatchEvent(new CustomEvent("themechange", { detail: theme() }));
system.addEventListener("change", () => !document.documentElement.dataset.theme && changed());

class ThemeSwitch extends HTMLElement {
  connectedCallback() {
    this.button = document.createElement("button");
    this.button.type = "button";
    this.button.addEventListener("click", () => this.choose(ORDER[(ORDER.indexOf(this.chosen) + 1) % ORDER.length]));
    this.replaceChildren(this.button);
    this.show();
  }

  get chosen() {
    return document.documentElement.dataset.theme ?? "auto";
  }

  choose(name) {
    if (name === "auto") delete document.documentElement.dataset.theme;
    else document.documentElement.dataset.theme = name;
    document.cookie = `inband_theme=${name}; path=/; max-age=31536000; samesite=lax`;
    this.show();
    changed();
  }

  show() {
    const word = this.dataset[this.chosen] ?? this.chosen;
    this.button.innerHTML = `<svg class="icon line" viewBox="0 0 24 24" aria-hidden="true">${SHAPES[this.chosen]}</svg>`;
    this.button.append(word);
    this.button.setAttribute("aria-label", `${this.dataset.label ?? ""}: ${word}`);
  }
}

customElements.define("theme-switch", ThemeSwitch);
