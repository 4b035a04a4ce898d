// What tells a person who looks elsewhere that an alarm has come: the number of things that wait for a person in the title of
// the tab (at a station, of active alarms), and a tone, where it was switched on.
//
//   [data-to-do], [data-alarms]   an element of the page that says how many there are; a live part keeps it true
//   <alarm-sound [machine] data-label data-on data-off data-touch>   the switch of the tone; remembered on this device
//
// A browser plays nothing before it was touched once. Until then the switch says so.

import { subscribe } from "./live.js";

const KEPT = "inband_alarm_sound";
const LAST = "inband_alarm_sounded"; // ms since 1970; of several tabs one sounds
const PAUSE = 1_500; // ms
const TONES = [[880, 0], [660, 0.28], [880, 0.56]]; // Hz, s
const LENGTH = 0.22; // s

let context = null;
let title = null;
const heard = new Set();

function showCount() {
  const counted = document.querySelector("[data-to-do], [data-alarms]");
  title ??= document.title;
  const number = Number(counted?.dataset.toDo ?? counted?.dataset.alarms ?? 0);
  document.title = number ? `(${number}) ${title}` : title;
}

const isOn = () => localStorage.getItem(KEPT) === "on";

function ready() {
  context ??= new AudioContext();
  return context.state === "running" ? Promise.resolve() : context.resume();
}

function sound() {
  if (context?.state !== "running") return;
  localStorage.setItem(LAST, Date.now());
  for (const [pitch, at] of TONES) {
    const tone = new OscillatorNode(context, { type: "triangle", frequency: pitch });
    const volume = new GainNode(context, { gain: 0 });
    const from = context.currentTime + at;
    volume.gain.setValueAtTime(0, from);
    volume.gain.linearRampToValueAtTime(0.6, from + 0.02);
    volume.gain.linearRampToValueAtTime(0, from + LENGTH);
    tone.connect(volume).connect(context.destination);
    tone.start(from);
    tone.stop(from + LENGTH);
  }
  document.dispatchEvent(new CustomEvent("alarmsound"));
}

class AlarmSound extends HTMLElement {
  connectedCallback() {
    this.button = document.createElement("button");
    this.button.type = "button";
    this.button.className = "button";
    this.button.addEventListener("click", () => this.choose(!isOn()));
    this.replaceChildren(this.button);
    this.show();
  }

  async choose(on) {
    localStorage.setItem(KEPT, on ? "on" : "off");
    if (on) {
      await ready();
      sound(); // so that the person knows it
    }
    this.show();
  }

  show() {
    const word = !isOn() ? this.dataset.off : context?.state === "running" ? this.dataset.on : this.dataset.touch;
    this.button.textContent = word;
    this.button.setAttribute("aria-label", `${this.dataset.label}: ${word}`);
    this.button.setAttribute("aria-pressed", isOn());
  }
}

customElements.define("alarm-sound", AlarmSound);

const showSwitches = () => document.querySelectorAll("alarm-sound").forEach((one) => one.show());

function hear(event) {
  if (event.state !== "active" || heard.has(event.id)) return;
  heard.add(event.id);
  if (isOn() && Date.now() - Number(localStorage.getItem(LAST)) > PAUSE) sound();
}

showCount();
document.addEventListener("livepart", showCount);

if (document.querySelector("[data-to-do], [data-alarms], alarm-sound")) {
  const machine = document.querySelector("alarm-sound")?.getAttribute("machine");
  subscribe(machine ? `alarm:${machine}` : "alarm", hear);
}
if (isOn()) ready().then(showSwitches, () => {});
document.addEventListener("pointerdown", () => isOn() && ready().then(showSwitches, () => {}));
