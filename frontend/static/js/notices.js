// Notifications of the browser. An open page fetches what is for the person who is signed in, shows it and says so.
//
// Loaded only where the browser permits notifications. Of several open pages one shows a message: they take turns by a lock and
// keep in common which messages were shown. The tag of an alarm lets a reminder take the place of the first notification.

import { subscribe } from "./live.js";
import { here } from "./root.js";

const meta = (name) => document.querySelector(`meta[name=${name}]`)?.content;
const PERSON = Number(meta("person"));
const KEPT = `inband-shown:${here("")}:${PERSON}`;
const FORGET = 120_000; // ms; the server hands out messages of the last minute
const PATIENCE = 5_000; // ms for the browser to show one

/** The messages that this browser has shown lately, and when. */
function shownLately() {
  try {
    const all = Object.entries(JSON.parse(localStorage.getItem(KEPT)) ?? {});
    return new Map(all.map(([id, at]) => [Number(id), at]).filter(([, at]) => Math.abs(Date.now() - at) < FORGET));
  } catch {
    return new Map(); // the tag is still there
  }
}

function keep(shown) {
  try {
    localStorage.setItem(KEPT, JSON.stringify(Object.fromEntries(shown)));
  } catch {
    // a browser that stores nothing
  }
}

async function take(shown) {
  const answer = await fetch(here("/api/v1/notifications/me/browser/messages"), {
    method: "POST",
    headers: { "Content-Type": "application/json", "X-CSRF-Token": meta("csrf") },
    body: JSON.stringify({ shown }),
    signal: AbortSignal.timeout(10_000),
  });
  return answer.ok ? (await answer.json()).items : [];
}

/** True once the browser has shown it. */
function show({ subject, words, about, alarms, path }) {
  return new Promise((resolve) => {
    try {
      const tag = `inband${here("")}-${alarms.length === 1 ? alarms[0] : about}`;
      const notice = new Notification(subject, { body: words, tag, renotify: true });
      notice.onshow = () => resolve(true);
      notice.onerror = () => resolve(false);
      notice.onclick = () => {
        window.focus();
        if (!window.open(here(path))) location.assign(here(path)); // in a page of its own: this one may hold a form half filled in
        notice.close();
      };
    } catch {
      resolve(false); // a telephone that shows only those of a service worker
    }
    setTimeout(() => resolve(false), PATIENCE);
  });
}

async function look() {
  let waiting = await take([]);
  for (let lately = shownLately(); (waiting = waiting.filter(({ id }) => !lately.has(id))).length; lately = shownLately()) {
    const done = [];
    for (const message of waiting) if (await show(message)) done.push(message.id);
    if (!done.length) return;
    keep(new Map([...shownLately(), ...done.map((id) => [id, Date.now()])]));
    waiting = (await take(done)).filter(({ id }) => !waiting.some((message) => message.id === id));
  }
}

const inTurn = () => (navigator.locks ? navigator.locks.request(KEPT, look) : look()).catch(() => {}); // it counts as failed; the route goes on

subscribe("delivery", (event) => (event.kind === "resync" || event.person === PERSON) && inTurn());
inTurn();
