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

export function age(seconds) {
  const format = (value, unit) =>
    new Intl.NumberFormat(language, { style: "unit", unit, unitDisplay: "short" }).format(Math.floor(value));
  if (seconds < 60) return format(Math.max(0, seconds), "second").replace("sec", "s");
  if (seconds < 3600) return format(seconds / 60, "minute");
  if (seconds < 2 * 86400) return format(seconds / 3600, "hour");
  return format(seconds / 86400, "day");
}

const clocks = new Set();

class TimeAgo extends HTMLElement {
  connectedCallback() {
    this.moment = Date.parse(this.getAttribute("datetime"));
    if (Number.isNaN(this.moment)) return;
    // The server's wording, with its number replaced: "12 s ago" in any language.
    this.frame = /\d+\s*\S+/.test(this.textContent) ? this.textContent.replace(/\d+\s*[^\s\d]+/, "{}") : "{}";
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
