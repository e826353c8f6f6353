// Who was measured before: their calibration is used again without measuring.

import { at, enable, make, show } from "./dom.js";
import { act } from "./program.js";

export function setUpPeople() {
  at("known").addEventListener("submit", (event) => {
    event.preventDefault();
    act("recall", { name: at("known-name").value });
  });
}

export function people(view) {
  const { people, in_use, step } = view.calibration;
  show(at("known"), people.length > 0);
  enable(at("recall"), !step && view.link.up);
  const list = at("known-name");
  const text = JSON.stringify(people);
  if (list.dataset.text === text) return;
  list.dataset.text = text;
  const chosen = list.value || in_use;
  list.replaceChildren(...people.map((name) => make("option", { value: name }, name)));
  if (people.includes(chosen)) list.value = chosen;
}
