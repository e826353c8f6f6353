// The robot's state, arming by a click alone, disarming by one key at any time.

import { announce } from "./announce.js";
import { at, attribute, enable, facts, number, say, sayIfAny, show } from "./dom.js";
import { act } from "./program.js";

const STATES = {
  disarmed: ["○", "Disarmed"],
  following: ["●", "Following"],
  holding: ["▲", "Holding"],
  falling_back: ["■", "Falling back"],
};

function disarm() {
  if (!act("disarm")) announce("Disarm was not sent: no connection to the program.", { urgent: true });
}

/** Space and Escape disarm, whatever has the focus; in a text Space writes, and Escape still disarms. Space never presses
 *  a button, so that pressing it twice in haste does not arm again. */
function onKey(event) {
  if (event.ctrlKey || event.altKey || event.metaKey) return;
  const writes = event.target.matches?.("input, textarea");
  if (event.key !== "Escape" && (event.key !== " " || writes)) return;
  event.preventDefault();
  event.stopPropagation();
  if (!event.repeat) disarm();
}

export function setUpRobot() {
  at("arm").addEventListener("click", () => act("arm"));
  at("disarm").addEventListener("click", disarm);
  at("ask-form").addEventListener("submit", (event) => {
    event.preventDefault();
    act("ask", { label: at("ask-label").value.trim() });
  });
  document.addEventListener("keydown", onKey, { capture: true });
  // Browsers press a focused button when Space is let go.
  document.addEventListener("keyup", (event) => {
    if (event.key === " " && !event.target.matches?.("input, textarea")) event.preventDefault();
  }, { capture: true });
}

export function robot(view) {
  const { robot: it } = view;
  const [shape, words] = STATES[it.state] ?? ["○", it.state || "Not known"];
  const said = `${shape} ${words}`;
  say(at("robot-name"), it.robot);
  attribute(at("robot"), "data-state", it.state);
  say(at("robot-state"), said);
  say(at("robot-reason"), it.reason);
  attribute(at("robot-reason"), "title", it.reason);
  enable(at("arm"), it.can_arm && it.state === "disarmed");
  announce(`Robot: ${words}`, { topic: "robot", urgent: it.state === "falling_back" });
}

/** The last step: what comes next, what the robot is told, and in the simulation what the person is asked for. */
export function follow(view) {
  const { robot: it, library, recognition } = view;
  sayIfAny(at("follow-next"), next(it, library));
  const spot = (point) => point.map((v) => number(v, 3)).join(", ");
  facts(at("follow-facts"), [
    ["Told to be at, m", it.robot ? spot(it.setpoint_m) : "–"],
    ["Evidence is", it.age_ms === null ? "–" : `${number(it.age_ms)} ms old`],
    ["Refused commands", String(it.refused)],
    ["Recognised", recognition ? `${recognition.history.filter(Boolean).length} of ${recognition.history.length} movements named` : "–"],
  ]);
  show(at("ask-form"), view.link.link === "sim" && library.skills.length > 0);
}

function next(it, library) {
  if (it.state !== "disarmed") return "The robot is armed. Move as in a demonstration; Space or Escape disarms at any time.";
  if (it.can_arm) return "All is ready. Keep clear of the robot, then press Arm.";
  if (library.skills.length === 0) return "No skill is learnt yet: record demonstrations and train first.";
  return `It cannot be armed now: ${it.reason}`;
}
