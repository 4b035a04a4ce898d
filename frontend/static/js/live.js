// One shared connection to the server's live events (SSE, /api/v1/events) for everything on the page.
//
//   subscribe(on, callback) -> unsubscribe
//     on: words such as "reading:shaft-d40 alarm". Each is a kind (of KINDS below; * for all), optionally with :key, which
//     must be the event's machine or characteristic.
//     callback(event) gets {kind, machine, characteristic, tool, …}; after a break it is called once with {kind: "resync"},
//     because something may have been missed.
//   watch(callback) -> unwatch
//     callback({state, since}) once a second and at every change; state: "connecting" | "live" | "lost";
//     since: milliseconds since the server was last heard.
//
// The server says "heartbeat" every few seconds, so a pulled cable is noticed as well: TCP itself says nothing for minutes.

import { here } from "./root.js";

const URL_OF_EVENTS = document.querySelector("meta[name=events]")?.content ?? here("/api/v1/events"); // of a station its own
const KINDS = [
  "reading", "correction", "alarm", "tool", "average", "calibration", "characteristic", "machine",
  "form", "work_zero", "alignment", "kinematics", "gauge_study", "baseline", "signal", "report", "proposal", "job",
  "note", "connection", "touch_test", "quarantine", "delivery", "notifications",
];
const SILENCE = 15_000; // ms; three heartbeats missed
const RETRY = 3_000;

const subscribers = new Set();
const watchers = new Set();
let source = null;
let state = "connecting";
let heard = performance.now();
let hasHeartbeat = false;
let wasLost = false;
let retry = 0;
// Number of the last event: at first of one that the page was made after, so that what happened since then arrives as well.
let newest = document.querySelector("meta[name=event]")?.content ?? "";

function hear() {
  heard = performance.now();
  if (state === "live") return;
  state = "live";
  tell();
  if (wasLost) for (const { callback } of [...subscribers]) callback({ kind: "resync" });
  wasLost = false;
}

function lose() {
  if (state !== "lost") {
    state = "lost";
    wasLost = true;
    tell();
  }
}

function tell() {
  for (const callback of [...watchers]) callback({ state, since: performance.now() - heard });
}

function matches(words, event) {
  return words.some(({ kind, key }) =>
    (kind === "*" || kind === event.kind) && (!key || key === event.machine || key === event.characteristic));
}

// For what is fetched because of an event: a copy of the database that lacks it must not answer.
export const afterEvent = () => (newest ? { "X-Inband-Event": newest } : {});

function deliver(kind, message) {
  hear();
  newest = message.lastEventId || newest;
  let data = {};
  try {
    data = JSON.parse(message.data);
  } catch {
    // an event without data still says that something of its kind changed
  }
  const event = { ...data, kind };
  for (const { words, callback } of [...subscribers]) if (matches(words, event)) callback(event);
}

function connect() {
  clearTimeout(retry);
  source?.close();
  source = new EventSource(newest ? `${URL_OF_EVENTS}?after=${newest}` : URL_OF_EVENTS);
  source.onopen = hear;
  // Who greets sends heartbeats too. On a busy plant none may ever come: events take their place.
  for (const sign of ["hello", "heartbeat"]) {
    source.addEventListener(sign, () => {
      hasHeartbeat = true;
      hear();
    });
  }
  for (const kind of KINDS) source.addEventListener(kind, (message) => deliver(kind, message));
  source.onerror = () => {
    lose();
    // The browser tries again by itself unless the server refused; then we do.
    if (source.readyState === EventSource.CLOSED) retry = setTimeout(connect, RETRY);
  };
}

function start() {
  if (source) return;
  connect();
  setInterval(() => {
    if (hasHeartbeat && state === "live" && performance.now() - heard > SILENCE) {
      lose();
      connect();
    }
    tell();
  }, 1_000);
  window.addEventListener("pagehide", () => source.close());
  window.addEventListener("pageshow", (event) => event.persisted && connect());
}

export function subscribe(on, callback) {
  const words = (on ?? "").split(/\s+/).filter(Boolean).map((word) => {
    const [kind, key] = word.split(/:(.*)/s);
    return { kind, key };
  });
  if (!words.length) return () => {};
  const subscriber = { words, callback };
  subscribers.add(subscriber);
  start();
  return () => subscribers.delete(subscriber);
}

export function watch(callback) {
  watchers.add(callback);
  start();
  callback({ state, since: performance.now() - heard });
  return () => watchers.delete(callback);
}
