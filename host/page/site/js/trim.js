// The speed of the hand during a demonstration, with two handles around the part that is kept.

import { colour, number } from "./dom.js";

const MARGIN = { left: 34, right: 8, top: 8, bottom: 20 };
const FONT = "11px system-ui, sans-serif";
/** The kept part is at least so long, s. */
export const LEAST_S = 0.1;

export class Curve {
  /** `trimmed` is called with `[from_s, to_s]` when a handle is let go. */
  constructor(canvas, trimmed) {
    this.canvas = canvas;
    this.dragged = null;
    canvas.addEventListener("pointerdown", (event) => this.grab(event));
    canvas.addEventListener("pointermove", (event) => this.drag(event));
    canvas.addEventListener("pointerup", () => {
      if (this.dragged === null) return;
      this.dragged = null;
      trimmed(this.kept_s.map((t) => Math.round(t * 100) / 100));
    });
    canvas.addEventListener("pointercancel", () => { this.dragged = null; });
  }

  /** Takes hold of the nearer handle. */
  grab(event) {
    if (!this.kept_s) return;
    this.canvas.setPointerCapture(event.pointerId);
    const t = this.time(event);
    this.dragged = Math.abs(t - this.kept_s[0]) < Math.abs(t - this.kept_s[1]) ? 0 : 1;
    this.drag(event);
  }

  drag(event) {
    if (this.dragged === null) return;
    const t = this.time(event);
    const [from_s, to_s] = this.kept_s;
    this.kept_s = this.dragged === 0 ? [Math.min(t, to_s - LEAST_S), to_s] : [from_s, Math.max(t, from_s + LEAST_S)];
    this.paint();
  }

  time(event) {
    const box = this.canvas.getBoundingClientRect();
    const share = (event.clientX - box.left - MARGIN.left) / (box.width - MARGIN.left - MARGIN.right);
    return Math.min(Math.max(share, 0), 1) * this.shown.seconds;
  }

  draw(demonstration) {
    const key = `${demonstration.kept_s} ${demonstration.seconds} ${this.canvas.clientWidth} ${document.documentElement.dataset.drawn}`;
    if (this.dragged !== null || (this.shown === demonstration && this.key === key)) return;
    this.key = key;
    this.shown = demonstration;
    this.kept_s = [...demonstration.kept_s];
    this.paint();
  }

  /** Shows this part as kept, until the program says otherwise. */
  keep(kept_s) {
    this.kept_s = [...kept_s];
    this.paint();
  }

  paint() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (width === 0) return;
    const density = window.devicePixelRatio || 1;
    this.canvas.width = width * density;
    this.canvas.height = height * density;
    const pen = this.canvas.getContext("2d");
    pen.scale(density, density);
    const { seconds, speed_m_per_s: speed, speed_t_s: times } = this.shown;
    const most = Math.max(0.2, ...speed);
    const [w, h] = [width - MARGIN.left - MARGIN.right, height - MARGIN.top - MARGIN.bottom];
    const x = (t) => MARGIN.left + (w * t) / Math.max(seconds, 1e-9);
    const y = (v) => MARGIN.top + h * (1 - v / most);
    pen.font = FONT;
    pen.fillStyle = colour("--quiet");
    pen.textAlign = "right";
    pen.fillText(number(most, 1), MARGIN.left - 4, y(most) + 8);
    pen.fillText("0", MARGIN.left - 4, y(0));
    pen.fillText("m/s", MARGIN.left - 4, y(most / 2) + 4);
    pen.textAlign = "left";
    pen.fillText("0", x(0), height - 6);
    pen.textAlign = "right";
    pen.fillText(`${number(seconds, 1)} s`, x(seconds), height - 6);
    pen.strokeStyle = colour("--grid");
    pen.strokeRect(MARGIN.left, MARGIN.top, w, h);
    pen.beginPath();
    speed.forEach((v, i) => pen[i ? "lineTo" : "moveTo"](x(times[i]), y(v)));
    pen.strokeStyle = colour("--person");
    pen.lineWidth = 1.5;
    pen.stroke();
    this.handles(pen, x, h);
  }

  handles(pen, x, h) {
    const [from, to] = this.kept_s.map(x);
    pen.fillStyle = colour("--panel");
    pen.globalAlpha = 0.7;
    pen.fillRect(MARGIN.left, MARGIN.top, from - MARGIN.left, h);
    pen.fillRect(to, MARGIN.top, x(this.shown.seconds) - to, h);
    pen.globalAlpha = 1;
    pen.fillStyle = colour("--robot");
    for (const place of [from, to]) {
      pen.fillRect(place - 1, MARGIN.top, 2, h);
      pen.fillRect(place - 4, MARGIN.top + h / 2 - 9, 8, 18);
    }
  }
}
