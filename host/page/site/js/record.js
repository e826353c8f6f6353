// Demonstrations: record and label, then trim, call otherwise, discard.

import { at, attribute, children, enable, flag, make, number, say, sayIfAny, show } from "./dom.js";
import { act } from "./program.js";
import { Curve, LEAST_S } from "./trim.js";

/** So long a second press on Discard counts, ms. */
const SURE_MS = 4000;

const items = new Map();
let open = null;

export function setUpRecord() {
  at("record-form").addEventListener("submit", (event) => {
    event.preventDefault();
    act("record", { label: at("record-label").value.trim() });
  });
  at("stop").addEventListener("click", () => act("stop"));
}

export function record(view) {
  const { recording, demonstrations } = view;
  show(at("record"), !recording);
  show(at("stop"), Boolean(recording));
  enable(at("record-label"), !recording);
  sayIfAny(at("recording"), recording && `Recording ${recording.label}: ${number(recording.seconds, 1)} s, ${recording.rows} instants with hand, stiffness and robot`);
  const count = demonstrations.length;
  say(at("demonstrations-count"), count ? `${count} recorded` : "");
  show(at("demonstrations-empty"), count === 0 && !recording);
  labels([...demonstrations.map((each) => each.label), ...view.library.skills.map(([label]) => label)]);
  list(demonstrations);
}

function labels(all) {
  const each = [...new Set(all)].sort();
  children(at("labels"), each.length, () => make("option")).forEach((option, i) => attribute(option, "value", each[i]));
}

/** Newest first; each keeps its element, so that nothing typed is lost. */
function list(demonstrations) {
  const present = new Set(demonstrations.map((each) => each.id));
  for (const [id, item] of items) {
    if (present.has(id)) continue;
    item.node.remove();
    items.delete(id);
  }
  for (const each of demonstrations) {
    if (!items.has(each.id)) {
      items.set(each.id, new Item(each.id));
      at("demonstrations").prepend(items.get(each.id).node);
      choose(each.id);
    }
    items.get(each.id).update(each);
  }
}

function choose(id) {
  open = open === id ? null : id;
  for (const item of items.values()) item.unfold(item.id === open);
}

/** One demonstration. */
class Item {
  constructor(id) {
    this.id = id;
    const test = (name) => ({ "data-testid": `demonstration-${id}-${name}` });
    this.head = make("button", { type: "button", class: "fold", "aria-expanded": "false", ...test("head") }, make("b"), make("span"));
    this.problem = make("p", { class: "problem", ...test("problem") });
    this.canvas = make("canvas", { role: "img", "aria-label": "Speed of the hand over time, m/s", ...test("curve") });
    this.from = make("input", { type: "number", min: "0", step: "0.01", ...test("from") });
    this.to = make("input", { type: "number", min: "0", step: "0.01", ...test("to") });
    this.label = make("input", { maxlength: "64", list: "labels", ...test("label") });
    this.remove = make("button", { type: "button", ...test("discard") }, "Discard");
    this.body = make("div", { class: "body", hidden: "" }, this.canvas,
      make("div", { class: "fields" },
        make("label", {}, "From, s", this.from), make("label", {}, "To, s", this.to), make("label", {}, "Label", this.label), this.remove));
    this.node = make("li", { "data-testid": `demonstration-${id}` }, this.head, this.problem, this.body);
    this.curve = new Curve(this.canvas, (kept_s) => this.trim(kept_s));
    this.listen();
  }

  listen() {
    this.head.addEventListener("click", () => choose(this.id));
    for (const input of [this.from, this.to]) {
      input.addEventListener("change", () => this.trim([this.from.valueAsNumber, this.to.valueAsNumber]));
    }
    this.label.addEventListener("change", () => {
      const label = this.label.value.trim();
      if (label) act("label", { id: this.id, label });
      else this.label.value = this.shown.label;
    });
    this.remove.addEventListener("click", () => this.discard());
  }

  /** Fields and handles know hundredths of a second: the very end may lie before the last of them. */
  trim([from_s, wanted_s]) {
    const to_s = Math.min(wanted_s, this.shown.seconds);
    if (Number.isFinite(from_s) && Number.isFinite(to_s) && from_s + LEAST_S <= to_s) {
      this.curve.keep([from_s, to_s]);
      act("trim", { id: this.id, from_s, to_s });
    } else {
      this.fields(this.shown);
    }
  }

  /** Forgetting a demonstration takes two presses. */
  discard() {
    if (this.sure) {
      act("discard", { id: this.id });
      return;
    }
    this.sure = true;
    say(this.remove, "Really discard?");
    setTimeout(() => {
      this.sure = false;
      say(this.remove, "Discard");
    }, SURE_MS);
  }

  update(it) {
    const news = it !== this.shown;
    this.shown = it;
    const [from_s, to_s] = it.kept_s;
    say(this.head.firstChild, it.label);
    say(this.head.lastChild, `${number(to_s - from_s, 2)} of ${number(it.seconds, 2)} s · ${it.rows} instants`);
    sayIfAny(this.problem, it.problem);
    flag(this.node, "warn", it.problem);
    if (news) this.fields(it);
    if (!this.body.hidden) this.curve.draw(it);
  }

  /** What the program keeps, unless somebody is writing there. */
  fields(it) {
    const write = (input, text) => {
      if (document.activeElement !== input) input.value = text;
    };
    write(this.from, it.kept_s[0].toFixed(2));
    write(this.to, it.kept_s[1].toFixed(2));
    write(this.label, it.label);
  }

  unfold(unfolded) {
    this.body.hidden = !unfolded;
    attribute(this.head, "aria-expanded", String(unfolded));
  }
}
