// The guided calibration: who, step by step, what was found, use or not; and the check of the fit.

import { announce } from "./announce.js";
import { at, attribute, children, enable, flag, make, number, say, sayIfAny, show } from "./dom.js";
import { lamp } from "./muscles.js";
import { act } from "./program.js";

/** Whose calibration was in use: the form opens and folds when that changes, and when somebody wants. */
let inUse;
/** Whether the result was there to be used. */
let wasResult = false;
const WAITING = "Waiting for the wearable …";
const JOINTS = ["shoulder flexion", "shoulder sideways", "upper arm turn", "elbow flexion"];

export function setUpCalibration() {
  at("person").addEventListener("submit", (event) => {
    event.preventDefault();
    const mains = at("person-mains").value;
    act("calibrate", {
      name: at("person-name").value.trim(),
      body_mass_kg: at("person-mass").valueAsNumber,
      body_height_m: at("person-height").valueAsNumber,
      mains_hz: mains ? Number(mains) : null,
    });
  });
  at("calibration-step-go").addEventListener("click", () => act("calibration_step"));
  at("calibration-next").addEventListener("click", () => act("calibration_next"));
  at("calibration-back").addEventListener("click", () => act("calibration_back"));
  at("calibration-again").addEventListener("click", () => act("calibration_step"));
  at("calibration-use").addEventListener("click", () => act("calibration_use"));
  at("calibration-cancel").addEventListener("click", () => act("calibration_cancel"));
  at("check-fit").addEventListener("click", () => act("check_fit"));
}

export function calibration(view) {
  const { calibration: it } = view;
  const { step } = it;
  say(at("calibration-in-use"), it.in_use === null ? "in use: nobody's, illustrative" : `in use: ${it.in_use}`);
  show(at("who"), !step);
  if (it.in_use !== inUse) at("who").open = it.in_use === null;
  inUse = it.in_use;
  show(at("calibration-step"), Boolean(step));
  show(at("calibration-buttons"), Boolean(step));
  show(at("fit-check"), !step && it.in_use !== null);
  enable(at("calibrate"), !it.waiting);
  say(at("calibrate"), it.waiting ? WAITING : "Begin calibration");
  enable(at("check-fit"), !it.waiting);
  if (step) stepUnderWay(step, it.waiting);
  const atResult = step?.name === "result";
  // At the end of a calibration what was found is read; of the one in use it is there to be looked up.
  const found = Boolean(it.result) && (atResult || !step);
  show(at("found"), found);
  show(at("found-head"), !step);
  if (atResult) at("found").open = true;
  else if (wasResult) at("found").open = false;
  wasResult = atResult;
  if (found) result(it.result, view.semg?.channels ?? []);
  fit(step ? null : it.fit);
}

function stepUnderWay(step, waiting) {
  const atResult = step.name === "result";
  children(at("step-dots"), step.of, () => make("li")).forEach((dot, i) => {
    attribute(dot, "data-state", i + 1 < step.number ? "past" : i + 1 === step.number ? "now" : "ahead");
  });
  say(at("step-count"), `Step ${step.number} of ${step.of}`);
  say(at("step-instruction"), step.instruction);
  at("step-progress").set(step.progress, `${number(100 * step.progress)} %`, { kind: step.done ? "good" : "person" });
  show(at("step-progress"), !atResult);
  say(at("step-status"), waiting ? WAITING : status(step));
  sayIfAny(at("step-problem"), step.problem);
  const go = at("calibration-step-go");
  show(go, !atResult && !step.done);
  say(go, step.problem ? "Do it again" : step.measuring ? "Measuring …" : "Start");
  enable(go, !step.measuring && !waiting);
  show(at("calibration-next"), !atResult && step.done);
  show(at("calibration-again"), !atResult && step.done);
  enable(at("calibration-again"), !waiting);
  enable(at("calibration-back"), step.number > 1 && !waiting);
  show(at("calibration-use"), atResult);
  enable(at("calibration-use"), step.done && !waiting);
  announce(`Step ${step.number} of ${step.of}. ${step.instruction}`, { topic: "step" });
}

function status(step) {
  if (step.name === "result") return "";
  if (step.measuring) return "Measuring: keep on.";
  return step.done ? "Measured." : "Press Start when you are ready.";
}

function fit(found) {
  const node = at("fit");
  show(node, Boolean(found));
  if (!found) return;
  if (!node.firstChild) node.append(make("span", { class: "lamp", role: "img" }), make("p"));
  lamp(node.firstChild, found.lamp);
  say(node.lastChild, found.text);
  flag(node, "warn", found.lamp !== "good");
}

const give = (estimate, decimals) => `${number(estimate.value, decimals)} ± ${number(estimate.std, decimals)}`;

/** Tables of what was measured, each number with its standard deviation. */
function result(found, channels) {
  const node = at("result");
  const text = JSON.stringify(found);
  if (node.dataset.text === text) return;
  node.dataset.text = text;
  const name = (i) => channels[i]?.muscle ?? `channel ${i + 1}`;
  const levels = table(["Muscle", "Rest, µV", "Maximum, µV"], found.rest_uv.map((rest, i) => [name(i), give(rest, 1), found.mvc_uv[i] ? give(found.mvc_uv[i], 0) : "–"]));
  const arm = table(["Stiffness at rest, gain", "Value ± s.d."], [
    ["gain l1", give(found.l1, 2)],
    ["slope l2", give(found.l2, 2)],
    ...found.rest_stiffness_nm_per_rad.map((joint, i) => [`${JOINTS[i]}, N m/rad`, give(joint, 1)]),
    ["left over, mm", number(found.residual_mm, 1)],
  ]);
  const notes = found.notes.map((note) => make("p", { class: "note" }, note));
  node.replaceChildren(levels, arm, ...notes);
}

function table(heads, rows) {
  const head = make("tr", {}, ...heads.map((text) => make("th", { scope: "col" }, text)));
  const body = rows.map(([first, ...rest]) => make("tr", {}, make("th", { scope: "row" }, first), ...rest.map((text) => make("td", {}, text))));
  return make("table", {}, make("thead", {}, head), make("tbody", {}, ...body));
}
