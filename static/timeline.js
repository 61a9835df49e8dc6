// The time line along the bottom of the page while a sequence is open: to play, to step, and to go where a click says.
"use strict";
import { follow, make } from "./link.js";
import { request } from "./jobs.js";

const HEIGHT_PX = 48;
const [INDEX, TIME, Z, CHANCE, STATE] = [0, 1, 2, 3, 4]; // of a point
const PREDICTED = 1;
const LOST = 2;
const LIVE_FRAMES = 600; // of a live source are drawn
const MARGIN = { left: 52, right: 10, top: 3, bottom: 2 };
const CHANCE_PX = 10; // height of the lower row
const MOST_DRAWN = 4000; // points; a longer course is thinned
const FAR = 10; // frames, with Shift

class Timeline extends HTMLElement {
  connectedCallback() {
    this.build();
    this.resizes = new ResizeObserver(() => this.resize());
    this.resizes.observe(this.canvas);
    viserPage.onScheme(() => this.draw());
    follow("frame", ({ timeline }) => this.take(timeline));
    follow("course", (course) => this.takeCourse(course));
  }

  build() {
    [this.now, this.points, this.course, this.pointer] = [null, new Map(), 0, null];
    [this.size, this.colours, this.scheme] = [[0, 0], {}, null];
    const button = (words, hint, act) => {
      const one = make("button", { type: "button", title: hint, "aria-label": words });
      one.addEventListener("click", act);
      return one;
    };
    this.play = button("Play", "Play, or pause. Key: K.", () => request({ do: "play" }));
    this.back = button("Back", "Pause, and show the frame before.", () => this.step(-1));
    this.forward = button("Forward", "Pause, and show the frame after.", () => this.step(1));
    [this.back.textContent, this.forward.textContent] = ["◀|", "|▶"];
    this.speed = make("select", { "aria-label": "Speed", title: "Times as fast as the frames were taken." });
    this.speed.addEventListener("change", () => request({ do: "speed", speed: this.speed.value }));
    this.words = make("output", { class: "now" });
    this.canvas = make("canvas", { tabindex: "0", role: "slider", "aria-label": "Frame" });
    this.canvas.addEventListener("pointerdown", (event) => this.press(event));
    this.canvas.addEventListener("pointermove", (event) => this.point(event));
    this.canvas.addEventListener("pointerleave", () => this.point(null));
    this.canvas.addEventListener("keydown", (event) => this.key(event));
    this.readout = make("output", { class: "readout", "aria-label": "frame under the pointer" });
    const steer = make("div", { class: "steer" }, this.back, this.play, this.forward, this.speed);
    this.append(make("div", { class: "left" }, steer, this.words), make("div", { class: "right" }, this.canvas, this.readout));
    this.hidden = true;
  }

  // Asked here alone, for whoever asks while a frame is shown has the page laid out once more.
  resize() {
    this.size = [this.canvas.clientWidth, this.canvas.clientHeight];
    this.draw();
  }

  take(now) {
    const isNew = now.course !== this.course;
    if (isNew) [this.course, this.points] = [now.course, new Map()];
    this.now = now;
    this.open(now.name !== null);
    if (this.hidden) return;
    for (const point of now.points) this.points.set(point[INDEX], point);
    if (isNew || this.speed.options.length === 0) {
      this.speed.replaceChildren(...now.speeds.map((one) => make("option", { value: one }, `${one} ×`)));
    }
    this.speed.value = now.speed;
    for (const one of [this.back, this.forward, this.speed]) one.hidden = now.isLive;
    if (now.isPlaying !== this.isPlaying) {
      this.isPlaying = now.isPlaying;
      this.play.textContent = now.isPlaying ? "❚❚" : "▶";
      this.play.setAttribute("aria-label", now.isPlaying ? "Pause" : "Play");
    }
    const point = this.points.get(now.at);
    const time = point?.[TIME] ?? null;
    this.words.textContent = `Frame ${now.at + 1}${now.count === null ? "" : ` of ${now.count}`}${time === null ? "" : ` · ${time.toFixed(2)} s`}`;
    this.canvas.setAttribute("aria-valuemin", "1");
    this.canvas.setAttribute("aria-valuemax", String(now.count ?? now.at + 1));
    this.canvas.setAttribute("aria-valuenow", String(now.at + 1));
    this.canvas.setAttribute("aria-valuetext", this.told(point ?? [now.at, null, null, null, LOST]));
    this.dataset.frame = now.at + 1;
    this.draw();
  }

  // What is set here has the whole page styled anew, so not with every frame.
  open(isOpen) {
    if (this.hidden === !isOpen) return;
    this.hidden = !isOpen;
    const { documentElement } = document;
    documentElement.style.setProperty("--timeline-height", isOpen ? `${HEIGHT_PX}px` : "0px");
    documentElement.toggleAttribute("data-sequence", isOpen);
  }

  takeCourse({ course, points }) {
    if (course !== this.course) [this.course, this.points] = [course, new Map()];
    for (const point of points) this.points.set(point[INDEX], point);
    this.draw();
  }

  step(by) {
    this.goTo((this.now?.at ?? 0) + by);
    if (this.now?.isPlaying) request({ do: "play" });
  }

  goTo(frame) {
    if (this.now === null || this.now.isLive) return;
    const last = this.now.count === null ? Infinity : this.now.count - 1;
    request({ do: "goto", frame: Math.min(Math.max(frame, 0), last) });
  }

  key(event) {
    const { at: frame = 0, count = 1 } = this.now ?? {};
    const far = event.shiftKey ? FAR : 1;
    const frames = { ArrowLeft: frame - far, ArrowRight: frame + far, ArrowDown: frame - far, ArrowUp: frame + far };
    Object.assign(frames, { PageDown: frame - FAR, PageUp: frame + FAR, Home: 0, End: (count ?? frame + 1) - 1 });
    if (event.key === " ") request({ do: "play" });
    else if (event.key in frames) this.goTo(frames[event.key]);
    else return;
    event.preventDefault();
    event.stopPropagation();
  }

  // First and last frame that are drawn.
  ends() {
    const { count, at: frame } = this.now;
    return count === null ? [Math.max(0, frame - LIVE_FRAMES), Math.max(frame, LIVE_FRAMES)] : [0, Math.max(1, count - 1)];
  }

  frameAt(event) {
    const [first, last] = this.ends();
    const share = (event.offsetX - MARGIN.left) / (this.canvas.clientWidth - MARGIN.left - MARGIN.right);
    return Math.round(first + Math.min(Math.max(share, 0), 1) * (last - first));
  }

  press(event) {
    if (event.button !== 0) return;
    this.canvas.setPointerCapture(event.pointerId);
    this.goTo(this.frameAt(event));
  }

  // Tell what is under the pointer; with the button down, go there.
  point(event) {
    this.pointer = event === null ? null : this.frameAt(event);
    if (event !== null && event.buttons & 1) this.goTo(this.pointer);
    const point = this.points.get(this.pointer);
    this.readout.textContent = this.pointer === null ? "" : this.told(point ?? [this.pointer, null, null, null, null]);
    this.draw();
  }

  told([index, time, z, chance, state]) {
    const where = { [PREDICTED]: "predicted", [LOST]: "no dock", null: "not played yet" }[state];
    const parts = [`Frame ${index + 1}`, time === null ? null : `${time.toFixed(2)} s`, z === null ? null : `z ${z.toFixed(1)} cm`];
    parts.push(where ?? (chance === null ? null : `${(100 * chance).toFixed(0)} % likely`));
    return parts.filter((part) => part !== null).join(" · ");
  }

  draw() {
    const { canvas, now } = this;
    const [wide, high] = this.size;
    if (now === null || this.hidden || wide === 0) return;
    const ratio = devicePixelRatio;
    if (canvas.width !== Math.round(wide * ratio) || canvas.height !== Math.round(high * ratio)) {
      [canvas.width, canvas.height] = [Math.round(wide * ratio), Math.round(high * ratio)];
    }
    const context = canvas.getContext("2d", { willReadFrequently: true }); // quicker without a graphics card
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.clearRect(0, 0, wide, high);
    if (this.scheme !== viserPage.scheme()) { // asking what colours are has the page laid out
      const style = getComputedStyle(this);
      const named = Object.fromEntries(["--z", "--lost", "--chance"].map((name) => [name, style.getPropertyValue(name).trim()]));
      [this.scheme, this.colours] = [viserPage.scheme(), { ...named, ink: style.color }];
    }
    const colour = (name) => this.colours[name];
    const [first, last] = this.ends();
    const every = Math.ceil((last - first) / MOST_DRAWN);
    this.stride = Math.max(every, Math.ceil((now.count ?? 0) / MOST_DRAWN));
    const isDrawn = (one) => one[INDEX] >= first && one[INDEX] <= last && (every < 2 || one[INDEX] % every === 0);
    const points = [...this.points.values()].filter(isDrawn).sort((one, other) => one[INDEX] - other[INDEX]);
    const x = (index) => MARGIN.left + ((index - first) / (last - first)) * (wide - MARGIN.left - MARGIN.right);
    const bottom = high - MARGIN.bottom - CHANCE_PX - 4;
    const [low, top] = ends(points.map((one) => one[Z]));
    const y = (z) => bottom - ((z - low) / (top - low)) * (bottom - MARGIN.top);
    this.drawFrame(context, colour, { wide, high, bottom, low, top });
    this.drawCourse(context, colour, { points, x, y, high, bottom });
    context.fillStyle = context.strokeStyle = colour("ink");
    context.lineWidth = 2;
    line(context, x(now.at), 0, x(now.at), high);
    if (this.pointer !== null) {
      context.lineWidth = 1;
      context.setLineDash([3, 3]);
      line(context, x(this.pointer), 0, x(this.pointer), high);
      context.setLineDash([]);
    }
  }

  drawFrame(context, colour, { wide, high, bottom, low, top }) {
    context.strokeStyle = "rgba(128, 128, 128, 0.5)";
    context.lineWidth = 1;
    for (const at of [MARGIN.top, bottom, high - MARGIN.bottom]) line(context, MARGIN.left, at, wide - MARGIN.right, at);
    context.fillStyle = colour("ink");
    context.font = "12px system-ui, sans-serif";
    context.textAlign = "right";
    context.fillText(`${top} cm`, MARGIN.left - 4, MARGIN.top + 8);
    context.fillText(`z ${low}`, MARGIN.left - 4, bottom);
    context.fillText("likely", MARGIN.left - 4, high - MARGIN.bottom);
  }

  // Frames that show the dock are joined; predicted ones are hollow, and those without a dock a gap with a mark below.
  drawCourse(context, colour, { points, x, y, high, bottom }) {
    context.lineWidth = 2;
    context.strokeStyle = context.fillStyle = colour("--z");
    let before = null;
    let gaps = 0;
    for (const point of points) {
      const isSeen = point[STATE] === 0 && point[Z] !== null;
      if (isSeen && before !== null && point[INDEX] - before[INDEX] <= this.stride) line(context, x(before[INDEX]), y(before[Z]), x(point[INDEX]), y(point[Z]));
      if (isSeen) context.fillRect(x(point[INDEX]) - 1, y(point[Z]) - 1, 2, 2);
      if (!isSeen && before !== null) gaps += 1;
      before = isSeen ? point : null;
    }
    this.dataset.gaps = gaps;
    this.dataset.points = points.length;
    const width = Math.max(2, x(1) - x(0));
    for (const [index, , z, chance, state] of points) {
      if (state === PREDICTED && z !== null) {
        context.lineWidth = 1;
        context.strokeRect(x(index) - 2, y(z) - 2, 4, 4);
      }
      if (state !== 0) {
        context.fillStyle = colour("--lost");
        context.fillRect(x(index) - width / 2, bottom, width, 4);
      } else if (chance !== null) {
        context.fillStyle = colour("--chance");
        context.fillRect(x(index) - width / 2, high - MARGIN.bottom - chance * CHANCE_PX, width, chance * CHANCE_PX);
      }
    }
  }
}

function line(context, x0, y0, x1, y1) {
  context.beginPath();
  context.moveTo(x0, y0);
  context.lineTo(x1, y1);
  context.stroke();
}

// Round ends of an axis around all numbers that are known.
function ends(numbers) {
  const known = numbers.filter((one) => one !== null);
  if (known.length === 0) return [0, 100];
  const [low, high] = [Math.min(...known), Math.max(...known)];
  const step = 10 ** Math.floor(Math.log10(Math.max(high - low, 1)));
  return [step * Math.floor(low / step), step * (Math.floor(high / step) + 1)];
}

customElements.define("dockpose-timeline", Timeline);
document.body.append(make("dockpose-timeline"));
