// One card for each channel: lamp, muscle, envelope; and a line of what is wrong.

import { announce } from "./announce.js";
import { at, attribute, children, make, number, say, sayIfAny } from "./dom.js";

/** Lamps differ by shape and word, not by colour alone. */
export const LAMPS = {
  good: ["●", "good"],
  warn: ["▲", "usable, with a warning"],
  bad: ["■", "not usable"],
  off: ["○", "nothing known"],
};

/** Makes `node` the lamp of this state. */
export function lamp(node, state) {
  const [shape, words] = LAMPS[state] ?? LAMPS.off;
  say(node, shape);
  attribute(node, "data-lamp", state);
  attribute(node, "aria-label", words);
  attribute(node, "title", words);
}

function card(index) {
  const node = make("div", { class: "channel", "data-testid": `channel-${index}` },
    make("span", { class: "lamp", role: "img", "data-testid": `lamp-${index}` }),
    make("b", {}, make("i", { class: `swatch c${index}` }), make("span")),
    make("meter-bar"));
  return node;
}

export function muscles(view) {
  const channels = view.semg?.channels ?? [];
  const cards = children(at("channels"), channels.length, card);
  channels.forEach((channel, i) => {
    const [light, name, bar] = cards[i].children;
    lamp(light, channel.lamp);
    say(name.lastElementChild, `${i + 1} ${channel.muscle}`);
    bar.set(channel.envelope, `${number(100 * channel.envelope)} %`, { kind: `c${i}` });
    attribute(cards[i], "title", channel.warnings.join(", "));
  });
  const warned = channels.flatMap((channel, i) => (channel.warnings.length ? [`${i + 1} ${channel.warnings.join(", ")}`] : [])).join(" · ");
  say(at("muscle-warnings"), warned && `▲ ${warned}`);
  attribute(at("muscle-warnings"), "title", warned);
  announce(warned ? `Electrodes: ${warned}` : "Electrodes are well.", { topic: "electrodes" });
  const empty = channels.length === 0;
  sayIfAny(at("muscles-empty"), empty ? nothing(view.link) : null);
  say(at("activation"), empty ? "" : `activation ${number(view.semg.activation, 2)} · co-contraction ${number(view.semg.co_contraction, 2)}`);
}

function nothing(link) {
  return link.up ? "The wearable is connected and has sent no signal yet." : `No signal: ${link.text}`;
}
