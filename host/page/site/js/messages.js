// What the program tells, newest first.

import { announce } from "./announce.js";
import { at, children, flag, make, number, say, sayIfAny, show } from "./dom.js";

let newest = 0;

export function messages(view) {
  const all = [...view.messages].reverse();
  const rows = children(at("messages"), all.length, () => make("li", {}, make("time"), make("span")));
  all.forEach((message, i) => {
    say(rows[i].firstChild, number(message.at_us / 1e6, 1, "s"));
    say(rows[i].lastChild, message.text);
    flag(rows[i], "warn", message.problem);
  });
  show(at("messages"), all.length > 0);
  show(at("messages-empty"), all.length === 0);
  if (all.length > 0 && all[0].at_us !== newest) {
    newest = all[0].at_us;
    announce(all[0].text, { topic: "message", urgent: all[0].problem });
  }
}

/** An act that the program did not understand. */
export function refused(reason) {
  sayIfAny(at("refused"), reason && `Not done: ${reason}`);
}
