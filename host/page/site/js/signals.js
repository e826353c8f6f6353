// Signals over time: envelopes, raw sEMG, the arm's stiffness, the robot's stiffness and what is expected of it.

import uPlot from "/vendor/uPlot.esm.js";
import { at, colour, flag, number, say, show } from "./dom.js";
import { act } from "./program.js";

/** How far back charts reach, and how far the robot's goes ahead, s. */
const BACK_S = 10;
const RAW_BACK_S = 4;
const AHEAD_S = 2;
/** A longer pause between two samples is a gap, s. */
const GAP_S = 0.08;
const RAW_GAP_S = 0.02;
const FONT = "11px system-ui, sans-serif";

/** Samples of the last seconds: times and rows, oldest first. */
class Track {
  constructor(back_s, gap_s) {
    this.back_s = back_s;
    this.gap_s = gap_s;
    this.t = [];
    this.rows = [];
  }

  push(t, rows) {
    if (rows.length > this.rows.length) {
      this.rows = rows.map((_, i) => this.rows[i] ?? new Array(this.t.length).fill(null));
    }
    for (let i = 0; i < t.length; i += 1) {
      const last = this.t.at(-1);
      // A program that was started anew begins its time anew.
      if (last !== undefined && t[i] < last) this.clear();
      else if (last !== undefined && t[i] - last > this.gap_s) this.sample(last + this.gap_s / 2, () => null);
      this.sample(t[i], (row) => rows[row]?.[i] ?? null);
    }
  }

  sample(t, value) {
    this.t.push(t);
    this.rows.forEach((row, i) => row.push(value(i)));
  }

  clear() {
    this.t.length = 0;
    for (const row of this.rows) row.length = 0;
  }

  /** Forgets what is too old at `now_s`. */
  forget(now_s) {
    const old = this.t.findIndex((t) => t >= now_s - this.back_s);
    const drop = old < 0 ? this.t.length : old;
    if (drop === 0) return;
    this.t.splice(0, drop);
    for (const row of this.rows) row.splice(0, drop);
  }

  /** For a chart: seconds from now, and rows by `scale`. */
  data(now_s, scale = (value) => value) {
    return [this.t.map((t) => t - now_s), ...this.rows.map((row, i) => row.map((value) => (value === null ? null : scale(value, i))))];
  }
}

const envelopes = new Track(BACK_S, GAP_S);
const stiffness = new Track(BACK_S, GAP_S);
const raw = new Track(RAW_BACK_S, RAW_GAP_S);
const firmness = new Track(BACK_S, 0.5);
const charts = new Map();
let turn = 0;

function axis(values) {
  return {
    stroke: colour("--quiet"), font: FONT, labelFont: FONT, labelSize: 15, labelGap: 0, gap: 3,
    grid: { stroke: colour("--grid"), width: 1 }, ticks: { show: false }, ...values,
  };
}

function line(index, name, extra = {}) {
  return { label: name, stroke: colour(`--c${index}`), width: 1.5, points: { show: false }, spanGaps: false, ...extra };
}

/** Charts keep to their room also while no view comes. */
const rooms = new ResizeObserver((changes) => {
  for (const { target } of changes) fit(charts.get(target.dataset.testid), target);
});

function fit(chart, room) {
  const size = { width: room.clientWidth, height: room.clientHeight };
  if (!chart || size.width === 0 || (chart.plot.width === size.width && chart.plot.height === size.height)) return;
  chart.plot.setSize(size);
}

/** Makes a chart anew where its lines, its room or the theme changed, and gives it data. */
function draw(id, lines, options, data) {
  const room = at(id);
  const key = JSON.stringify([lines.map((each) => [each.label, each.stroke, each.dash]), document.documentElement.dataset.drawn]);
  const size = { width: room.clientWidth, height: room.clientHeight };
  if (size.width === 0 || size.height < 40) return;
  const chart = charts.get(id);
  if (chart?.key === key) {
    chart.plot.setData(data);
    return;
  }
  chart?.plot.destroy();
  const plot = new uPlot({ ...size, ...options(), cursor: { show: false }, legend: { show: false }, padding: [6, 8, 0, 0], series: [{}, ...lines] }, data, room);
  charts.set(id, { key, plot });
  rooms.observe(room);
}

function seconds(from, to) {
  return { scales: { x: { time: false, range: [from, to] } }, x: axis({ size: 20, gap: 5, space: 50, incrs: [1, 2, 5], label: "s from now", values: (_, ticks) => ticks.map(signed) }) };
}

/** A whole number of seconds with its sign. */
function signed(t) {
  return t > 0 ? `+${number(t)}` : number(t).replace("-", "\u2212");
}

function upwards(least, label, from = -BACK_S, to = 0) {
  return () => {
    const { scales, x } = seconds(from, to);
    return { scales: { ...scales, y: { range: (_, __, most) => [0, Math.max(least, 1.1 * (most ?? 0))] } }, axes: [x, axis({ size: 42, space: 18, label })] };
  };
}

const AXES = ["x", "y", "z"];

function drawRaw(now_s) {
  const present = raw.t.length > 0;
  say(at("raw"), present ? "Stop" : "Show");
  at("raw").setAttribute("aria-label", present ? "Stop raw sEMG" : "Show raw sEMG");
  flag(at("raw-panel"), "many", raw.rows.length > 4 && present);
  show(at("raw-empty"), !present);
  show(at("chart-raw"), present);
  if (!present) {
    say(at("raw-scale"), "");
    return;
  }
  const offsets = raw.rows.map(mean);
  const lane_uv = lane(raw.rows, offsets);
  say(at("raw-scale"), `without offsets, each lane ${number(lane_uv)} µV high`);
  const lanes = raw.rows.length;
  const middle = (i) => lanes - 1 - i;
  const lines = raw.rows.map((_, i) => line(i, `${i + 1}`, { width: 1 }));
  const options = () => {
    const { scales, x } = seconds(-RAW_BACK_S, 0);
    return {
      scales: { ...scales, y: { range: [-0.6, lanes - 0.4] } },
      axes: [x, axis({ size: 42, label: "channel", splits: lines.map((_, i) => middle(i)), values: lines.map((_, i) => `${i + 1}`) })],
    };
  };
  draw("chart-raw", lines, options, raw.data(now_s, (value, i) => middle(i) + Math.min(Math.max((value - offsets[i]) / lane_uv, -0.5), 0.5)));
}

/** Electrodes have offsets a hundred times as large as muscles: a lane is drawn around the mean of what it shows. */
function mean(row) {
  let [sum, count] = [0, 0];
  for (const value of row) {
    if (value === null) continue;
    sum += value;
    count += 1;
  }
  return count > 0 ? sum / count : 0;
}

/** A round height of a lane, in which all samples of all channels fit, microvolts. */
function lane(rows, offsets) {
  let most = 0;
  rows.forEach((row, i) => {
    for (const value of row) if (value !== null) most = Math.max(most, Math.abs(value - offsets[i]));
  });
  const decade = 10 ** Math.floor(Math.log10(Math.max(2 * most, 10)));
  return [1, 2, 5, 10].map((step) => step * decade).find((height) => height >= 2 * most) ?? 10 * decade;
}

function drawFirmness(view, now_s) {
  firmness.push([now_s], view.robot.stiffness_n_per_m.map((value) => [value]));
  firmness.forget(now_s);
  const now = firmness.data(now_s);
  const path = view.recognition?.robot_path ?? [];
  const ahead = view.recognition?.robot_stiffness_n_per_m ?? [];
  const t = [...now[0], ...path.map((point) => point.in_s)];
  const gap = new Array(path.length).fill(null);
  const past = new Array(now[0].length).fill(null);
  const solid = AXES.map((_, i) => [...(now[i + 1] ?? past), ...gap]);
  const dashed = AXES.map((_, i) => [...past, ...path.map((_, k) => ahead[k]?.[i] ?? null)]);
  const lines = [...AXES.map((name, i) => line(i, name)), ...AXES.map((name, i) => line(i, `${name} expected`, { dash: [4, 4] }))];
  draw("chart-firmness", lines, upwards(500, "N/m", -BACK_S, AHEAD_S), [t, ...solid, ...dashed]);
  const [x, y, z] = view.robot.stiffness_n_per_m;
  legend(at("firmness-now"), [["x", x], ["y", y], ["z", z]]);
}

function legend(node, values) {
  const text = values.map(([name, value]) => `${name} ${number(value)}`).join("|");
  if (node.dataset.text === text) return;
  node.dataset.text = text;
  node.replaceChildren();
  values.forEach(([name, value], i) => {
    const swatch = document.createElement("i");
    swatch.className = `swatch c${i}`;
    node.append(swatch, `${name} ${number(value)} `);
  });
  node.append("N/m");
}

/** Raw sEMG is sent when somebody wants to see it: it takes most of a link's room. */
export function setUpSignals() {
  at("raw").addEventListener("click", () => act("raw", { on: raw.t.length === 0 }));
}

/** Takes every view's signals; draws every other time, which is ten times a second. */
export function signals(view) {
  for (const trace of view.traces) {
    envelopes.push(trace.t_s, trace.envelopes);
    stiffness.push(trace.t_s, trace.stiffness_n_per_m);
    raw.push(trace.raw_t_s, trace.raw_uv);
  }
  turn += 1;
  if (turn % 2 !== 0) return;
  const now_s = view.at_us / 1e6;
  for (const track of [envelopes, stiffness, raw]) track.forget(now_s);
  draw("chart-envelopes", envelopes.rows.map((_, i) => line(i, `${i + 1}`)), upwards(30, "%"), envelopes.data(now_s, (share) => 100 * share));
  draw("chart-stiffness", AXES.map((name, i) => line(i, name)), upwards(500, "N/m"), pad(stiffness.data(now_s), 4));
  drawRaw(now_s);
  drawFirmness(view, now_s);
  const [x, y, z] = view.semg?.stiffness_n_per_m ?? [null, null, null];
  legend(at("stiffness-now"), [["x", x], ["y", y], ["z", z]]);
  at("stiffness-note").textContent = stiffnessNote(view.semg);
}

function stiffnessNote(semg) {
  if (!semg) return "";
  if (semg.held) return "held: the last stiffness that could be trusted";
  return semg.hand_seen ? "" : "elbow assumed: the hand is not seen";
}

/** A chart has as many rows as lines, also before the first sample. */
function pad(data, count) {
  while (data.length < count) data.push(new Array(data[0].length).fill(null));
  return data;
}
