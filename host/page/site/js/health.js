// How link, clock, tracker, latency and recording fare; and the devices of the first step.

import { announce } from "./announce.js";
import { at, children, facts, make, number, say, show } from "./dom.js";
import { lamp } from "./muscles.js";
import { givePasskey } from "./program.js";

/** A scan that is older holds the robot, ms (the gate's first limit). */
const LATE_MS = 60;

export function health(view) {
  const { link, clock, tracker, latency, file } = view;
  const total = link.received + link.lost;
  facts(at("health"), [
    ["Link", link.up ? `${link.link}, newest ${number(link.age_ms)} ms` : `${link.link || "none"} is down`, !link.up || link.age_ms > LATE_MS],
    ["Frames", `${link.received} · ${link.lost} lost (${number(total ? (100 * link.lost) / total : null, 1)} %) · ${link.refused} refused`, link.refused > 0],
    ["Clock", clock ? `${number(clock.rate_ppm, 1)} ppm ± ${number(clock.uncertainty_us / 1000, 2)} ms${clock.settled ? "" : ", settling"}` : "–", clock && !clock.settled],
    ["Ping", clock ? there(clock) : "–", Boolean(clock?.late_us >= 1000)],
    ["Tracker", tracker.up ? `picture ${number(tracker.age_ms)} ms old` : "down", !tracker.up],
    ["Latency", latency ? `median ${number(latency.p50_ms)}, 99 % ${number(latency.p99_ms)} ms` : "–", latency && latency.p99_ms > LATE_MS],
    ["Recording", file ? file.problem ?? `${size(file.bytes)} in ${name(file.path)}` : "not to a file", Boolean(file?.problem)],
  ]);
  at("health").lastElementChild.title = file?.problem ?? file?.path ?? "";
  announce(link.up ? "The wearable is connected." : "The wearable is not connected.", { topic: "link" });
}

/** How long a ping takes, and how much later than at first everything comes. */
function there({ round_trip_us, late_us }) {
  const trip = round_trip_us === null ? "no answer yet" : `there and back ${number(round_trip_us / 1000)} ms`;
  return late_us >= 1000 ? `${trip} · late by ${number(late_us / 1000)} ms` : trip;
}

const name = (path) => path.split(/[\\/]/).at(-1);

function size(bytes) {
  if (bytes < 1e6) return number(bytes / 1e3, 0, "kB");
  return number(bytes / 1e6, 1, "MB");
}

function device(row, state, title, text, more) {
  const [light, words] = row.children;
  lamp(light, state);
  const [name, what, warnings] = words.children;
  say(name, title);
  say(what, text);
  say(warnings, more);
}

export function setUpConnect() {
  at("passkey-form").addEventListener("submit", (event) => {
    event.preventDefault();
    givePasskey(at("passkey").value);
    at("passkey").value = "";
  });
}

/** The passkey that a wearable shows and pairing waits for. */
function passkey(wanted) {
  const news = Boolean(wanted) && at("passkey-form").hidden;
  show(at("passkey-form"), Boolean(wanted));
  if (!wanted) {
    at("passkey").value = "";
    return;
  }
  say(at("passkey-what"), `Six digits that ${wanted.wanted_by} shows, ${number(Math.ceil(wanted.left_s))} s left`);
  if (!news) return;
  announce(`${wanted.wanted_by} shows a passkey: type its six digits in the step Connect.`, { topic: "passkey", urgent: true });
}

/** The step "Connect": each device, how it is, what to do. */
export function connect(view) {
  const { link, tracker, robot, file } = view;
  const make_row = () => make("li", {}, make("span", { class: "lamp", role: "img" }), make("div", {}, make("b"), make("p"), make("small")));
  const rows = children(at("devices"), 4, make_row);
  const details = [];
  if (link.mtu !== null) details.push(`MTU ${link.mtu}`);
  if (link.interval_ms !== null) details.push(`interval ${number(link.interval_ms, 1)} ms`);
  if (link.battery_mv !== null) details.push(`battery ${number(link.battery_mv / 1000, 2)} V`);
  details.push(...link.warnings);
  const warned = link.warnings.length > 0;
  device(rows[0], !link.up ? "bad" : warned ? "warn" : "good", `Wearable (${link.link || "none"})`, link.text, details.join(" · "));
  device(rows[1], !tracker.up ? "bad" : tracker.age_ms === null ? "warn" : "good", "Hand tracker", tracker.text,
    tracker.taught ? "shares a frame with the robot" : "shares no frame with the robot yet: teach it below by touching three points");
  device(rows[2], robot.robot ? "good" : "off", `Robot (${robot.robot || "none"})`, robot.reason, "");
  device(rows[3], file ? (file.problem ? "bad" : "good") : "off", "Recording", file ? file.problem ?? name(file.path) : "This run is not recorded.", "");
  rows[3].title = file?.path ?? "";
  passkey(link.passkey);
  say(at("connect-next"), link.passkey ? "The wearable pairs with whoever knows its passkey: here or at the terminal." : link.up && tracker.up ? "All are there. Next: Calibrate." : "Waiting for what is red; each line says what to do.");
}
