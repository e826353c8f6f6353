// The document: finding, making and changing elements without work where nothing changed.

/** The element of this test id. */
export function at(id) {
  const node = document.querySelector(`[data-testid="${id}"]`);
  if (!node) throw new Error(`no element ${id}`);
  return node;
}

/** A new element: attributes, then children. */
export function make(tag, attributes = {}, ...children) {
  const node = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) node.setAttribute(name, value);
  node.append(...children);
  return node;
}

/** Says `text` in `node`. */
export function say(node, text) {
  if (node.textContent !== text) node.textContent = text;
}

/** Shows `node` or not. */
export function show(node, shown) {
  if (node.hidden === shown) node.hidden = !shown;
}

/** Shows `node` with `text`, or hides it where there is none. */
export function sayIfAny(node, text) {
  show(node, Boolean(text));
  say(node, text ?? "");
}

export function flag(node, name, on) {
  if (node.classList.contains(name) !== Boolean(on)) node.classList.toggle(name, Boolean(on));
}

export function attribute(node, name, value) {
  if (node.getAttribute(name) !== value) node.setAttribute(name, value);
}

/** Whether a button may be pressed. */
export function enable(button, enabled) {
  if (button.disabled === enabled) button.disabled = !enabled;
}

/** Gives `parent` exactly `count` children made by `child`, and returns them. */
export function children(parent, count, child) {
  while (parent.children.length < count) parent.append(child(parent.children.length));
  while (parent.children.length > count) parent.lastElementChild.remove();
  return [...parent.children];
}

/** Fills a list of facts: `[[name, text, warning?], ...]`. */
export function facts(list, all) {
  const rows = children(list, all.length, () => make("div", {}, make("dt"), make("dd")));
  all.forEach(([name, text, warning], i) => {
    say(rows[i].firstElementChild, name);
    say(rows[i].lastElementChild, text);
    flag(rows[i], "warn", warning);
  });
}

/** A number with so many decimals, or a dash for what is not known. */
export function number(value, decimals = 0, unit = "") {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  return value.toFixed(decimals) + (unit && `\u202f${unit}`);
}

/** A bar of a share, with a text over it and, if asked, a mark. */
class MeterBar extends HTMLElement {
  connectedCallback() {
    if (this.firstChild) return;
    this.setAttribute("role", "meter");
    this.setAttribute("aria-valuemin", "0");
    this.setAttribute("aria-valuemax", "1");
    this.append(make("i"), make("span"));
  }

  /** `share` of the full width, null for not known. */
  set(share, text, { mark = null, kind = "" } = {}) {
    const known = Number.isFinite(share);
    const width = `${known ? Math.round(1000 * Math.min(Math.max(share, 0), 1)) / 10 : 0}%`;
    const [bar, words] = this.children;
    if (bar.style.width !== width) bar.style.width = width;
    say(words, text);
    attribute(this, "aria-valuenow", known ? share.toFixed(2) : "0");
    attribute(this, "aria-valuetext", text);
    attribute(this, "data-kind", kind);
    const place = mark === null ? "" : `${100 * mark}%`;
    if (this.style.getPropertyValue("--mark") !== place) this.style.setProperty("--mark", place);
    flag(this, "marked", mark !== null);
  }
}
customElements.define("meter-bar", MeterBar);

/** The colour that a custom property of the style sheet stands for in the present theme. */
export function colour(name) {
  const key = `${document.documentElement.dataset.drawn} ${name}`;
  if (!colours.has(key)) {
    probe.style.color = `var(${name})`;
    colours.set(key, getComputedStyle(probe).color);
  }
  return colours.get(key);
}
const colours = new Map();
const probe = make("span", { hidden: "" });
document.documentElement.append(probe);
