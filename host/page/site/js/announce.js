// What a screen reader is told: changes, once each.

import { at, say } from "./dom.js";

const last = new Map();

/** Says `text` when it differs from what was said before of the same `topic`. */
export function announce(text, { topic = text, urgent = false } = {}) {
  if (last.get(topic) === text) return;
  last.set(topic, text);
  if (topic === text) forgetOthers(text);
  say(at(urgent ? "warns" : "says"), text);
}

/** A text without a topic may be said again once another one came between. */
function forgetOthers(text) {
  for (const topic of [...last.keys()]) if (topic === last.get(topic) && topic !== text) last.delete(topic);
}
