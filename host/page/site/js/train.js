// Learning: what there is to learn from, what was learnt, how well demonstrations left out are recognised.

import { announce } from "./announce.js";
import { at, children, enable, make, say, sayIfAny, show } from "./dom.js";
import { act } from "./program.js";

export function setUpTrain() {
  at("train").addEventListener("click", () => act("train"));
}

export function train(view) {
  const { demonstrations, library, recording } = view;
  const usable = demonstrations.filter((each) => !each.problem);
  const counts = new Map();
  const row = (label) => counts.get(label) ?? counts.set(label, [0, 0]).get(label);
  for (const { label } of usable) row(label)[0] += 1;
  for (const [label, count] of library.skills) row(label)[1] = count;
  const labels = [...counts.keys()].sort();
  const cells = () => make("tr", {}, make("th", { scope: "row" }), make("td"), make("td"));
  children(at("counts").tBodies[0], labels.length, cells).forEach((line, i) => {
    const [recorded, learnt] = counts.get(labels[i]);
    [labels[i], recorded, learnt].forEach((value, k) => say(line.children[k], String(value)));
  });
  show(at("counts"), labels.length > 0);
  show(at("train-empty"), labels.length === 0);
  const bad = demonstrations.length - usable.length;
  say(at("train-status"), status(library, bad));
  sayIfAny(at("train-problem"), library.problem);
  const held = library.held_out;
  sayIfAny(at("held-out"), held && `Left out in turn, ${held[0]} of ${held[1]} demonstrations are recognised.`);
  const button = at("train");
  say(button, library.learning ? "Learning …" : library.skills.length > 0 ? "Train again" : "Train");
  enable(button, usable.length > 0 && !library.learning && !recording);
}

function status(library, bad) {
  const left = bad === 0 ? "" : ` ${bad} with a problem ${bad === 1 ? "is" : "are"} left out: see Record.`;
  if (library.learning) return `Learning from the demonstrations …${left}`;
  if (library.skills.length > 0) {
    announce(`Learnt ${library.skills.length} skills.`, { topic: "learnt" });
    return `${library.skills.length} skills are in use.${left}`;
  }
  return left.trim();
}
