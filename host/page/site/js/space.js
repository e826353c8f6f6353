// The hand and the robot in space: two scenes, each in its own frame, seen by one camera. Orthographic, so that a length
// measures the same everywhere.

import { at, colour, number, say } from "./dom.js";

/** What bands show: so many standard deviations to either side. */
const BAND = 2;
const TRAIL_S = 3;
const FONT = "11px system-ui, sans-serif";
const camera = { yaw: -2.7, pitch: 0.42 };
const trails = { person: [], robot: [] };
/** Corners of what each scene must show, metres; grows with what comes. */
const room = {
  person: { least: [0, -0.3, -0.45], most: [0.45, 0.2, 0.05] },
  robot: { least: [0, -0.25, 0], most: [0.6, 0.25, 0.5] },
};

/** Directions of the picture's right and up in the scene, for a camera that looks along the third. */
function axes() {
  const [sy, cy, sp, cp] = [Math.sin(camera.yaw), Math.cos(camera.yaw), Math.sin(camera.pitch), Math.cos(camera.pitch)];
  return { right: [-sy, cy, 0], up: [-sp * cy, -sp * sy, cp] };
}

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

class Scene {
  constructor(id, kind) {
    this.canvas = at(id);
    this.kind = kind;
    this.canvas.addEventListener("pointerdown", (event) => this.canvas.setPointerCapture(event.pointerId));
    this.canvas.addEventListener("pointermove", (event) => {
      if (event.buttons & 1) turn(-event.movementX / 120, event.movementY / 120);
    });
    this.canvas.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: [0.1, 0], ArrowRight: [-0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
      if (!step) return;
      event.preventDefault();
      turn(...step);
    });
  }

  begin() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    const density = window.devicePixelRatio || 1;
    if (this.canvas.width !== Math.round(width * density)) this.canvas.width = Math.round(width * density);
    if (this.canvas.height !== Math.round(height * density)) this.canvas.height = Math.round(height * density);
    this.pen = this.canvas.getContext("2d");
    this.pen.setTransform(density, 0, 0, density, 0, 0);
    this.pen.clearRect(0, 0, width, height);
    Object.assign(this, axes());
    this.fit(width, height);
    this.floor();
  }

  /** Scale and shift that bring the whole room into the picture. */
  fit(width, height) {
    const { least, most } = room[this.kind];
    const low = [Infinity, Infinity], high = [-Infinity, -Infinity];
    for (let corner = 0; corner < 8; corner += 1) {
      const point = [0, 1, 2].map((k) => ((corner >> k) & 1 ? most[k] : least[k]));
      [dot(point, this.right), dot(point, this.up)].forEach((v, k) => {
        low[k] = Math.min(low[k], v);
        high[k] = Math.max(high[k], v);
      });
    }
    this.scale = Math.min((width - 48) / (high[0] - low[0]), (height - 40) / (high[1] - low[1]));
    this.shift = [width / 2 + 12 - this.scale * (low[0] + high[0]) / 2, height / 2 + this.scale * (low[1] + high[1]) / 2];
  }

  place(point) {
    return [this.shift[0] + this.scale * dot(point, this.right), this.shift[1] - this.scale * dot(point, this.up)];
  }

  line(points, ink, width, dash = []) {
    if (points.length < 2) return;
    const { pen } = this;
    pen.beginPath();
    points.forEach((point, i) => pen[i ? "lineTo" : "moveTo"](...this.place(point)));
    pen.strokeStyle = ink;
    pen.lineWidth = width;
    pen.lineJoin = "round";
    pen.lineCap = "round";
    pen.setLineDash(dash);
    pen.stroke();
    pen.setLineDash([]);
  }

  dot(point, ink, radius, hollow = false) {
    const { pen } = this;
    pen.beginPath();
    pen.arc(...this.place(point), radius, 0, 2 * Math.PI);
    pen.lineWidth = 2;
    pen.strokeStyle = ink;
    pen.fillStyle = hollow ? colour("--panel") : ink;
    pen.fill();
    pen.stroke();
  }

  label(text, point, ink, dx = 6, dy = -6) {
    const [x, y] = this.place(point);
    this.pen.font = FONT;
    this.pen.fillStyle = ink;
    this.pen.fillText(text, x + dx, y + dy);
  }

  /** A grid of 0.2 m on the room's floor, and the frame's axes. */
  floor() {
    const { least, most } = room[this.kind];
    const [grid, quiet] = [colour("--grid"), colour("--quiet")];
    const step = 0.2;
    const ticks = (k) => {
      const all = [];
      for (let i = Math.ceil(least[k] / step - 1e-9); i * step <= most[k] + 1e-9; i += 1) all.push(i * step);
      return all;
    };
    for (const x of ticks(0)) this.line([[x, least[1], least[2]], [x, most[1], least[2]]], grid, 1);
    for (const y of ticks(1)) this.line([[least[0], y, least[2]], [most[0], y, least[2]]], grid, 1);
    this.pen.font = FONT;
    for (const x of ticks(0)) this.label(number(x, 1), [x, least[1], least[2]], quiet, -8, 13);
    const up = (z) => [least[0], most[1], z];
    this.line([up(least[2]), up(most[2])], grid, 1);
    for (const z of ticks(2)) this.label(number(z, 1), up(z), quiet, -26, 4);
    [["x", [0.12, 0, 0]], ["y", [0, 0.12, 0]], ["z", [0, 0, 0.12]]].forEach(([name, tip]) => {
      this.line([[0, 0, 0], tip], quiet, 2);
      this.label(name, tip, quiet, 3, -3);
    });
    this.label(this.kind === "person" ? "shoulder" : "base", [0, 0, 0], quiet, 5, 14);
  }

  /** An expected path with a band of `BAND` standard deviations, as seen from here. */
  path(points, ink) {
    if (points.length < 2) return;
    const { pen } = this;
    const band = new Path2D();
    for (const { mean, std } of dense(points)) {
      const [x, y] = this.place(mean);
      // The ellipse that a diagonal covariance throws on the picture.
      const sum = (a, b) => std.reduce((all, s, k) => all + a[k] * b[k] * s * s, 0);
      const [p, q, r] = [sum(this.right, this.right), -sum(this.right, this.up), sum(this.up, this.up)];
      const [half, root] = [(p + r) / 2, Math.hypot((p - r) / 2, q)];
      const size = (v) => Math.max(BAND * Math.sqrt(Math.max(v, 0)) * this.scale, 1);
      const ellipse = new Path2D();
      ellipse.ellipse(x, y, size(half + root), size(half - root), Math.atan2(2 * q, p - r) / 2, 0, 2 * Math.PI);
      band.addPath(ellipse);
    }
    pen.globalAlpha = 0.2;
    pen.fillStyle = ink;
    pen.fill(band);
    pen.globalAlpha = 1;
    this.line(points.map((point) => point.mean_m), ink, 2.5);
  }
}

/** Between the points of a path, so that a band has no teeth. */
function dense(points) {
  const all = [];
  const between = (a, b, share) => a.map((v, k) => v + share * (b[k] - v));
  for (let i = 0; i + 1 < points.length; i += 1) {
    const [a, b] = [points[i], points[i + 1]];
    for (let k = 0; k < 4; k += 1) all.push({ mean: between(a.mean_m, b.mean_m, k / 4), std: between(a.std_m, b.std_m, k / 4) });
  }
  all.push({ mean: points.at(-1).mean_m, std: points.at(-1).std_m });
  return all;
}

const scenes = { person: new Scene("scene-person", "person"), robot: new Scene("scene-robot", "robot") };
let newest = null;

function turn(yaw, pitch) {
  camera.yaw += yaw;
  camera.pitch = Math.min(Math.max(camera.pitch + pitch, -0.2), 1.5);
  if (newest) drawBoth(newest);
}

function grow(kind, points) {
  const { least, most } = room[kind];
  for (const point of points) {
    for (let k = 0; k < 3; k += 1) {
      // No further than 2 m, so that one wild value does not shrink everything for ever.
      least[k] = Math.max(Math.min(least[k], point[k] - 0.03), -2);
      most[k] = Math.min(Math.max(most[k], point[k] + 0.03), 2);
    }
  }
}

function trail(kind, at_us, point) {
  const all = trails[kind];
  if (all.length > 0 && at_us < all.at(-1)[0]) all.length = 0;
  if (point) all.push([at_us, point]);
  while (all.length > 0 && all[0][0] < at_us - TRAIL_S * 1e6) all.shift();
  return all.map(([, each]) => each);
}

/** A picture of the hand that is older does not look live, ms. */
const OLD_MS = 150;

function drawBoth(view) {
  const { hand, recognition, robot } = view;
  const [person, machine, quiet] = [colour("--person"), colour("--robot"), colour("--quiet")];
  const scene = scenes.person;
  scene.begin();
  scene.line(trails.person.map(([, point]) => point), person, 1, [2, 3]);
  scene.path(recognition?.human_path ?? [], person);
  if (hand) scene.dot(hand.position_m, person, 6, hand.age_ms > OLD_MS);
  const other = scenes.robot;
  other.begin();
  other.line(robot.joints_m, quiet, 5);
  for (const joint of robot.joints_m) other.dot(joint, quiet, 3, true);
  other.line(trails.robot.map(([, point]) => point), machine, 1, [2, 3]);
  other.path(recognition?.robot_path ?? [], machine);
  if (robot.robot) {
    other.dot(robot.setpoint_m, machine, 7, true);
    other.dot(robot.position_m, machine, 5);
  }
}

export function space(view) {
  newest = view;
  const { hand, recognition, robot } = view;
  const means = (path) => (path ?? []).map((point) => point.mean_m);
  trail("person", view.at_us, hand?.position_m);
  trail("robot", view.at_us, robot.robot ? robot.position_m : null);
  grow("person", [...means(recognition?.human_path), ...(hand ? [hand.position_m] : [])]);
  grow("robot", [...means(recognition?.robot_path), ...robot.joints_m, ...(robot.robot ? [robot.position_m, robot.setpoint_m] : [])]);
  drawBoth(view);
  const spot = (point) => `${point.map((v) => number(v, 2)).join(", ")} m`;
  say(at("hand-now"), hand ? `${spot(hand.position_m)}${hand.age_ms > OLD_MS ? ` · ${number(hand.age_ms)} ms old` : ""}` : "not seen");
  say(at("robot-now"), robot.robot ? spot(robot.position_m) : "none");
}
