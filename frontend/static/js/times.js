// How long ago something was; moments themselves are written by the server, in the time zone of the plant.
//
//   <time-ago datetime="ISO">12 s ago</time-ago>   keeps counting
//
// Without script the server's words stay.

// One unit, no more: read from two metres away. The symbols are those of app/language/formatting.py.
export function age(seconds) {
  if (seconds < 60) return `${Math.max(0, Math.floor(seconds))} s`;
  if (seconds < 3600) return `${Math.floor(seconds / 60)} min`;
  if (seconds < 2 * 86400) return `${Math.floor(seconds / 3600)} h`;
  return `${Math.floor(seconds / 86400)} d`;
}

const clocks = new Set();

class TimeAgo extends HTMLElement {
  connectedCallback() {
    this.moment = Date.parse(this.getAttribute("datetime"));
    if (Number.isNaN(this.moment)) return;
    this.frame = this.textContent.replace(/\d+\s*[^\s\d]+/, "{}"); // "12 s ago", in the words of the page
    clocks.add(this);
    this.tick();
  }

  disconnectedCallback() {
    clocks.delete(this);
  }

  tick() {
    const text = this.frame.replace("{}", age((Date.now() - this.moment) / 1000));
    if (text !== this.textContent) this.textContent = text;
  }
}

setInterval(() => clocks.forEach((clock) => clock.tick()), 1_000);
customElements.define("time-ago", TimeAgo);
