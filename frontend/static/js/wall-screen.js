// <wall-screen src="/wall/now" every="5" version="0.1.0" data-lost data-none data-refused data-nokey>
// The wall screen. Asks again and again, for as long as it hangs there, with the key that stands behind the # of the address: no
// server writes that into a log. Without an answer for some seconds it says since when, and what was shown stays, paler; it goes on
// by itself. After an update of the server it loads itself again. `.wall-trouble` says what is wrong, `.wall-now` holds what the server says.

import { age } from "./times.js";

const PATIENCE = 15_000; // ms for one answer
const CALM = 5_000; // ms without an answer before it is said in red
const SMALLEST = 0.4; // share of their usual size that letters have at least
const PHONE = 1_000; // px; one scrolls on narrower screens
const URGENT = ["waiting", "attention", "wear", "stop"]; // tones, the calmest of them first
const urgency = (machine) => URGENT.indexOf(machine.dataset.tone);
const REFUSED = 60_000; // ms between two looks with a key that was refused

class WallScreen extends HTMLElement {
  connectedCallback() {
    this.trouble = this.querySelector(".wall-trouble");
    this.now = this.querySelector(".wall-now");
    this.full = this.querySelector(".wall-full");
    this.full.hidden = !document.fullscreenEnabled;
    this.full.addEventListener("click", () => document.documentElement.requestFullscreen().catch(() => {}));
    addEventListener("resize", () => this.fit());
    addEventListener("hashchange", () => location.reload());
    setInterval(() => this.show(), 1_000);
    if (location.hash.length > 1) this.look();
    else this.say("refused", this.dataset.nokey);
  }

  async look() {
    let pause = Number(this.getAttribute("every")) * 1_000;
    this.unanswered ??= Date.now();
    try {
      const answer = await fetch(this.getAttribute("src"), {
        headers: { Authorization: `Bearer ${decodeURIComponent(location.hash.slice(1))}` },
        cache: "no-store",
        credentials: "omit",
        signal: AbortSignal.timeout(PATIENCE),
      });
      if (answer.status === 401) {
        this.now.replaceChildren();
        this.say("refused", this.dataset.refused);
        pause = REFUSED;
      } else if (answer.ok) await this.take(await answer.text());
    } catch {
      // without an answer: show() says so in time
    }
    this.show();
    setTimeout(() => this.look(), pause);
  }

  take(text) {
    const made = new DOMParser().parseFromString(text, "text/html").querySelector(".wall-page");
    if (!made) return;
    if (made.dataset.version !== this.getAttribute("version")) return this.renew();
    this.now.replaceChildren(made);
    this.seen = Date.now();
    this.unanswered = null;
    this.clock = made.querySelector("time")?.textContent;
    this.say("live", "");
    this.fit();
  }

  // Nobody scrolls a screen on the wall: where there is more than it holds, the letters are smaller, and then machines are counted
  // in place of shown, the calm ones first.
  fit() {
    const fits = () => innerWidth <= PHONE || document.documentElement.scrollHeight <= innerHeight;
    for (let share = 1; share >= SMALLEST; share -= 0.05) {
      document.body.style.setProperty("--fit", share.toFixed(2));
      if (fits()) return;
    }
    const notShown = this.querySelector("#not-shown");
    const machines = [...this.querySelectorAll(".wall-machines li")].reverse();
    for (const machine of machines.sort((one, other) => urgency(one) - urgency(other)).slice(0, -1)) {
      if (fits()) return;
      machine.remove();
      notShown.hidden = false;
      notShown.lastElementChild.textContent = Number(notShown.lastElementChild.textContent) + 1;
    }
  }

  // Never before the server has answered: a browser's own page of what it could not load would hang there for good.
  async renew() {
    const answer = await fetch(location.pathname, { cache: "no-store", credentials: "omit", signal: AbortSignal.timeout(PATIENCE) });
    if (answer.ok) location.reload();
  }

  show() {
    if (this.getAttribute("state") === "refused" || !this.unanswered || Date.now() - this.unanswered < CALM) return;
    const words = this.seen
      ? this.dataset.lost.replace("{since}", this.clock).replace("{age}", age((Date.now() - this.seen) / 1000))
      : this.dataset.none;
    this.say("lost", words);
  }

  say(state, words) {
    this.setAttribute("state", state);
    this.trouble.hidden = !words;
    if (this.trouble.textContent !== words) this.trouble.textContent = words;
  }
}

customElements.define("wall-screen", WallScreen);
