// Where the shoulder and the robot are in the tracker's frame, taught by touching.

import { announce } from "./announce.js";
import { at, children, enable, make, number, say, sayIfAny, show } from "./dom.js";
import { act } from "./program.js";

const AXES = ["x", "y", "z"];

export function setUpTeach() {
  at("teach-shoulder").addEventListener("click", () => act("teach_shoulder"));
  at("teach-form").addEventListener("submit", (event) => {
    event.preventDefault();
    const typed = AXES.map((axis) => at(`teach-${axis}`));
    const given = typed.some((input) => input.value !== "");
    act("teach_point", { robot_m: given ? typed.map((input) => input.valueAsNumber) : null });
    for (const input of typed) {
      input.value = "";
      input.required = false;
    }
  });
  // One place is typed whole or not at all.
  at("teach-form").addEventListener("input", () => {
    const typed = AXES.map((axis) => at(`teach-${axis}`));
    const given = typed.some((input) => input.value !== "");
    for (const input of typed) input.required = given;
  });
  at("teach-use").addEventListener("click", () => act("teach_use"));
  at("teach-cancel").addEventListener("click", () => act("teach_cancel"));
}

const place = (point_m) => point_m.map((value) => number(value, 3)).join(", ");

export function teach(view) {
  const { teaching: it, tracker, robot } = view;
  const { touching } = it;
  say(at("teach-head"), `Teach by touching: shoulder, robot${tracker.taught ? " (taught)" : ""}`);
  show(at("teach-touching"), Boolean(touching));
  if (touching) {
    at("teach-still").set(touching.still, `still: ${number(100 * touching.still)} %`, { kind: "person" });
    say(at("teach-what"), `Touch ${touching.what} and hold still.`);
    announce(`Touch ${touching.what} and hold still.`, { topic: "touch" });
  }
  for (const id of ["teach-shoulder", "teach-point"]) enable(at(id), !touching);
  AXES.forEach((axis, i) => {
    const known = number(robot.position_m[i], 3);
    if (at(`teach-${axis}`).placeholder !== known) at(`teach-${axis}`).placeholder = known;
  });
  say(at("teach-shoulder-at"), it.shoulder_m ? `touched at ${place(it.shoulder_m)} m` : "not touched");
  points(it.points);
  sayIfAny(at("teach-problem"), it.problem);
  const left = it.residual_mm === null ? "" : `The points fit each other to ${number(it.residual_mm, 1)} mm.`;
  sayIfAny(at("teach-status"), left || (it.points.length === 0 && !it.may_use ? it.kept : ""));
  enable(at("teach-use"), it.may_use && !touching);
  enable(at("teach-cancel"), Boolean(touching) || it.points.length > 0 || it.shoulder_m !== null);
}

/** Each point by its place in the robot's frame, how far off it lies, and a way to forget it. */
function points(all) {
  const row = (i) => {
    const remove = make("button", { type: "button", class: "small", "data-testid": `teach-remove-${i + 1}`, "aria-label": `Remove point ${i + 1}` }, "Remove");
    remove.addEventListener("click", () => act("teach_remove", { point: i + 1 }));
    return make("li", {}, make("span"), remove);
  };
  children(at("teach-points"), all.length, row).forEach((node, i) => {
    const off = all[i].off_mm === null ? "" : `, ${number(all[i].off_mm, 1)} mm off`;
    say(node.firstChild, `${i + 1}: ${place(all[i].robot_m)} m${off}`);
  });
}
