// Times as the reader's clock has them.
//
//   <local-time datetime="ISO" show="seconds|minutes|date"><time>…UTC…</time></local-time>   in the reader's zone and language
//   <time-ago datetime="ISO">12 s ago</time-ago>                                             keeps counting
//
// Without script the server's words stay.

const FORMATS = {
  seconds: { day: "numeric", month: "short", year: "numeric", hour: "2-digit", minute: "2-digit", second: "2-digit", hourCycle: "h23" },
  minutes: { day: "numeric", month: "short", year: "numeric", hour: "2-digit", minute: "2-digit", hourCycle: "h23" },
  date: { day: "numeric", month: "short", year: "numeric" },
};
const language = document.documentElement.lang === "en" ? "en-GB" : document.documentElement.lang;

class LocalTime extends HTMLElement {
  connectedCallback() {
    const moment = new Date(this.getAttribute("datetime"));
    if (Number.isNaN(moment.getTime())) return;
    const time = this.querySelector("time") ?? this.appendChild(document.createElement("time"));
    time.textContent = new Intl.DateTimeFormat(language, FORMATS[this.getAttribute("show")] ?? FORMATS.seconds).format(moment);
  }
}

// One unit, no more: read from two metres away. The symbols are those of app/web/numbers.py.
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
customElements.define("local-time", LocalTime);
customElements.define("time-ago", TimeAgo);
