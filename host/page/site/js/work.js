// The five steps: which is shown, which are done.

import { at, attribute, say } from "./dom.js";

const STEPS = ["connect", "calibrate", "record", "train", "follow"];
let chosen = null;
/** Whether a passkey was wanted: the step with its field is shown when that begins. */
let pairing = false;

export function setUpWork() {
  for (const step of STEPS) at(`step-${step}`).addEventListener("click", () => choose(step));
}

function choose(step) {
  chosen = step;
  for (const section of document.querySelectorAll("[data-work]")) section.hidden = section.dataset.work !== step;
  for (const each of STEPS) {
    if (each === step) at(`step-${each}`).setAttribute("aria-current", "step");
    else at(`step-${each}`).removeAttribute("aria-current");
  }
}

/** Marks what is done; at first shows what comes next, later what somebody chose. */
export function work(view) {
  const done = {
    connect: view.link.up && view.tracker.up,
    calibrate: view.calibration.in_use !== null,
    record: view.demonstrations.length > 0 || view.library.skills.length > 0,
    train: view.library.skills.length > 0,
    follow: view.robot.state !== "disarmed",
  };
  if (chosen === null) choose(view.calibration.step ? "calibrate" : STEPS.find((step) => !done[step]) ?? "follow");
  if (view.link.passkey && !pairing) choose("connect");
  pairing = Boolean(view.link.passkey);
  STEPS.forEach((step, i) => {
    const button = at(`step-${step}`);
    attribute(button, "data-done", String(done[step]));
    say(button.firstElementChild, done[step] && step !== "follow" ? "✓" : String(i + 1));
  });
  say(at("story"), view.story ? `Simulation: ${view.story}` : "");
}
