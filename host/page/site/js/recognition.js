// What the person does: probabilities, the decision, novelty, what was before.

import { announce } from "./announce.js";
import { at, attribute, children, flag, make, number, say } from "./dom.js";

const HISTORY = 6;

function bar(index) {
  return make("div", { class: "skill", "data-testid": `skill-${index}` }, make("span"), make("meter-bar"));
}

export function recognition(view) {
  const it = view.recognition;
  const labels = it?.labels ?? [];
  const rows = children(at("posterior"), labels.length, bar);
  labels.forEach((label, i) => {
    const [name, meter] = rows[i].children;
    const decided = it.decision?.[0] === label && !it.unknown;
    say(name, label);
    attribute(name, "title", label);
    flag(rows[i], "decided", decided);
    const p = it.posterior[i];
    meter.set(p, `${number(100 * p)} %${decided ? " ◆" : ""}`, { kind: it.unknown ? "quiet" : "person" });
  });
  const said = verdict(view);
  say(at("verdict"), said);
  attribute(at("verdict"), "title", said);
  attribute(at("verdict"), "data-kind", kind(it));
  if (it?.decision || it?.unknown || it?.unjudged) announce(said);
  at("phase").set(it?.phase, it?.phase === null || !it ? "–" : `${number(100 * it.phase)} % over`, { kind: "person" });
  novelty(it);
  history(it);
}

function kind(it) {
  if (it?.unknown || it?.unjudged) return "unknown";
  return it?.under_way ? (it.decision ? "decided" : "open") : "still";
}

function verdict(view) {
  const it = view.recognition;
  if (!it) return view.library.skills.length === 0 ? "No skill is learnt yet: record demonstrations, then train." : "Waiting for hand and signals.";
  if (it.unknown) return `None of the skills${it.nearest ? `; nearest: ${it.nearest}` : ""}`;
  if (it.unjudged) return "Not judged: too much of this movement was not seen. The robot holds until it ends.";
  if (!it.under_way) return "No movement is under way.";
  if (it.decision) return `${it.decision[0]}, decided after ${number(it.decision[1], 1, "s")}`;
  return "A movement is under way, not decided yet.";
}

/** The score over its threshold: the mark in the middle is the threshold. */
function novelty(it) {
  const ratio = it?.novelty;
  const known = Number.isFinite(ratio);
  at("novelty").set(known ? ratio / 2 : null, known ? `${number(ratio, 2)} of the threshold` : "–", { mark: 0.5, kind: ratio > 1 ? "bad" : "good" });
}

function history(it) {
  const newestFirst = (it?.history ?? []).slice(-HISTORY).reverse();
  const text = newestFirst.map((label) => label ?? "unknown").join(" · ");
  say(at("history"), text || "nothing yet");
  attribute(at("history"), "title", text);
}
