// <live-status data-live data-connecting data-lost="No connection for {age} …">
// Says whether what is on the page is live; when the connection is gone, since when. Never a stale "live".
// The page is told as well: <html data-live="live|connecting|lost">.

import { watch } from "./live.js";
import { age } from "./times.js";

const SHAPES = {
  live: '<circle cx="7" cy="7" r="4" fill="currentColor"/>',
  connecting: '<circle cx="7" cy="7" r="4" fill="none" stroke="currentColor" stroke-width="2"/>',
  lost: '<path d="M7 0 14 13H0z" fill="currentColor"/>',
};

class LiveStatus extends HTMLElement {
  connectedCallback() {
    this.replaceChildren();
    this.shape = this.appendChild(document.createElementNS("http://www.w3.org/2000/svg", "svg"));
    this.shape.setAttribute("viewBox", "0 0 14 14");
    this.shape.setAttribute("aria-hidden", "true");
    this.words = this.appendChild(document.createElement("span"));
    this.stop = watch((status) => this.show(status));
  }

  disconnectedCallback() {
    this.stop?.();
  }

  show({ state, since }) {
    if (this.getAttribute("state") !== state) {
      this.setAttribute("state", state);
      document.documentElement.dataset.live = state;
      this.shape.innerHTML = SHAPES[state];
      // The seconds are for the eye; a screen reader is told once.
      this.setAttribute("aria-live", "polite");
    } else {
      this.setAttribute("aria-live", "off");
    }
    const words = (this.dataset[state] ?? state).replace("{age}", age(since / 1000));
    if (words !== this.words.textContent) this.words.textContent = words;
  }
}

customElements.define("live-status", LiveStatus);
