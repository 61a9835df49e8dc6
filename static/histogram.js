// The histogram beneath the picture: pixels of each grey level, how many groups each level leaves, and the threshold,
// which can be dragged.
"use strict";
import { Flat } from "./flat.js";
import { follow, make, makeSvg, send } from "./link.js";

const LEVELS = 256;
const [LEFT, RIGHT] = [52, 34]; // beside the plot: pixels and groups
const MARGIN = { top: 15, bottom: 15 }; // above and beneath it: votes and levels
const ONE = 0.25; // of a decade: how high a single pixel stands, so that it is seen
const LETTER_PX = 7;
const GRIP_PX = 16; // to either side of the threshold's line

class Histogram extends HTMLElement {
  connectedCallback() {
    if (this.plot === undefined) this.build();
    this.resizes = new ResizeObserver(() => this.resize());
    this.resizes.observe(this.plot);
    this.end = follow("frame", (frame) => this.take(frame));
  }

  disconnectedCallback() {
    this.resizes.disconnect();
    this.end();
  }

  build() {
    this.size = [0, 0];
    [this.levels, this.kept] = [[], 0]; // where each light has a level of its own
    [this.data, this.dragged, this.hovered, this.found] = [null, null, null, LEVELS];
    this.moving = makeSvg("g"); // the threshold, so that a step of it draws nothing else anew
    this.plot = makeSvg("svg", { class: "plot", role: "img", "aria-label": "histogram of the picture" });
    this.grip = make("div", { class: "grip", role: "slider", tabindex: "0", "aria-label": "Threshold level", "aria-valuemin": 0, "aria-valuemax": 255 });
    this.grip.title = "Drag, or use the arrow keys: sets a fixed level";
    this.readout = make("output", { class: "readout", "aria-label": "grey level under the pointer" });
    this.flat = new Flat(this.plot);
    this.append(make("div", { class: "plots" }, this.plot, this.flat.canvas, this.grip), this.readout);
    this.grip.addEventListener("pointerdown", (event) => this.grasp(event));
    this.grip.addEventListener("pointermove", (event) => this.dragged !== null && this.drag(event));
    for (const name of ["pointerup", "pointercancel"]) this.grip.addEventListener(name, () => this.letGo());
    this.grip.addEventListener("keydown", (event) => this.key(event));
    this.addEventListener("pointermove", (event) => this.hover(event));
    this.addEventListener("pointerleave", () => this.hover(null));
  }

  // Asked here alone, for whoever asks while a frame is shown has the page laid out once more.
  resize() {
    this.size = [this.plot.clientWidth, this.plot.clientHeight];
    this.draw();
  }

  take({ overlay, histogram, isPlaying }) {
    const isOther = isPlaying !== this.isPlaying;
    if (isOther) this.flat.forget();
    this.isPlaying = isPlaying;
    this.toggleAttribute("data-playing", isPlaying);
    this.found = overlay.level;
    [this.levels, this.kept] = [overlay.levels ?? [], (overlay.kept ?? []).reduce((sum, [, length]) => sum + length, 0)];
    if (this.grasped !== true && this.found === this.dragged) this.dragged = null;
    const isNew = histogram !== undefined && histogram.serial !== this.data?.serial;
    if (isNew) this.data = histogram;
    if (isNew || isOther) this.draw();
    else this.drawLine();
  }

  // Left edge of a level's bar, and the level at a place; both across the plot.
  x(level) {
    return LEFT + (level * this.wide) / LEVELS;
  }
  levelAt(event) {
    const x = event.clientX - this.plot.getBoundingClientRect().left;
    return Math.min(Math.max(Math.floor(((x - LEFT) * LEVELS) / this.wide), 0), LEVELS - 1);
  }

  // Whether each light has its own level, and nobody drags one for all.
  get isEach() {
    return this.levels.length > 0 && this.dragged === null;
  }

  get level() {
    return this.dragged ?? this.found;
  }

  grasp(event) {
    if (event.button !== 0) return;
    this.grip.setPointerCapture(event.pointerId);
    [this.grasped, this.dragged] = [true, Math.min(this.found, LEVELS - 1)];
    this.offset = this.levelAt(event) - this.dragged;
  }
  drag(event) {
    if (this.grasped === true) this.set(this.levelAt(event) - this.offset);
  }
  letGo() {
    this.grasped = false;
    if (this.dragged === this.found) this.dragged = null;
  }

  // Choose a level: drawn at once, and told to the program, whose answer draws it again.
  set(level) {
    const chosen = Math.min(Math.max(level, 0), LEVELS - 1);
    if (chosen === this.level) return;
    this.dragged = chosen;
    send({ do: "level", level: chosen });
    this.drawLine();
  }

  key(event) {
    const steps = { ArrowLeft: -1, ArrowDown: -1, ArrowRight: 1, ArrowUp: 1, PageDown: -10, PageUp: 10, Home: -LEVELS, End: LEVELS };
    if (!(event.key in steps) || event.ctrlKey || event.altKey || event.metaKey) return;
    this.set(Math.min(this.level, LEVELS - 1) + steps[event.key]);
    event.preventDefault();
    event.stopPropagation();
  }

  hover(event) {
    if (this.data === null) return;
    const x = event === null ? -1 : event.clientX - this.plot.getBoundingClientRect().left;
    this.hovered = event !== null && x >= LEFT && x <= LEFT + this.wide ? this.levelAt(event) : null;
    this.tell();
    const place = this.hovered === null ? -10 : this.x(this.hovered + 0.5);
    this.pointer?.setAttribute("transform", `translate(${place} 0)`);
  }

  // The pixels of the level under the pointer, or else all that the threshold keeps.
  tell() {
    const { hovered, data } = this;
    const count = (number, noun) => `${number} ${noun}${number === 1 ? "" : "s"}`;
    const level = hovered ?? this.level;
    const groups = (data.groups[level] ?? -1) < 0 ? "" : count(data.groups[level], "group");
    if (hovered !== null) {
      this.readout.textContent = `Level ${level}: ${count(data.counts[level], "pixel")}${groups && `; as threshold ${groups}`}`;
    } else if (this.isEach) {
      const [first, last] = [this.levels[0], this.levels.at(-1)];
      this.readout.textContent = `A level for each of ${count(this.levels.length, "light")}, ${first} to ${last}: keeps ${count(this.kept, "pixel")}`;
    } else if (level >= LEVELS) this.readout.textContent = "Nothing is bright enough: no level keeps a light.";
    else {
      const kept = data.counts.slice(level).reduce((sum, one) => sum + one, 0);
      this.readout.textContent = `Threshold ${level}: keeps ${count(kept, "pixel")}${groups && ` in ${groups}`}`;
    }
  }

  draw() {
    const [wide, high] = this.size;
    if (this.data === null || wide === 0) return;
    [this.wide, this.high] = [wide - LEFT - RIGHT, high];
    const most = Math.max(...this.data.counts, 1);
    this.decades = Math.ceil(2 * Math.log10(most) + 0.2) / 2; // in halves, so that it seldom moves
    this.groupsTop = this.data.groupsTop;
    this.pointer = makeSvg("path", { d: `M0 ${MARGIN.top}V${this.bottom}`, class: "pointer", transform: "translate(-10 0)" });
    this.parts = [...this.axes(), this.bars(), this.groups(), ...this.votes()];
    this.plot.replaceChildren(...(this.isPlaying ? [] : [...this.parts, this.pointer, this.moving]));
    this.drawLine();
  }

  drawLine() {
    if (this.data === null || this.wide === undefined) return;
    const line = this.line();
    if (this.isPlaying) {
      this.flat.begin(...this.size);
      this.flat.paint([...this.parts, ...line]);
    } else this.moving.replaceChildren(...line);
    this.grip.style.left = `${this.x(Math.min(this.level, LEVELS - 1) + 0.5) - GRIP_PX}px`;
    this.grip.setAttribute("aria-valuenow", this.level);
    this.tell();
  }

  // The base of the bars, from above.
  get bottom() {
    return this.high - MARGIN.bottom;
  }

  // Height of a number of pixels, by decades; of a number of groups, evenly.
  y(count) {
    const share = count <= 0 ? 0 : (Math.log10(count) + ONE) / (this.decades + ONE);
    return this.bottom - share * (this.bottom - MARGIN.top);
  }
  yOfGroups(groups) {
    return this.bottom - Math.min(groups / this.groupsTop, 1) * (this.bottom - MARGIN.top);
  }

  axes() {
    const parts = [];
    const step = Math.ceil((9.4 * (this.decades + ONE)) / (this.bottom - MARGIN.top)); // decades between two labels
    for (let power = 0; power <= this.decades; power += step) {
      const y = this.y(10 ** power);
      parts.push(makeSvg("path", { d: `M${LEFT} ${y}h${this.wide}`, class: "rule" }));
      const isFree = this.data.peaks.length === 0 || y > MARGIN.top + 8; // of the word above
      if (isFree) parts.push(label(String(10 ** power), LEFT - 5, y + 4, "end"));
    }
    for (const groups of [0, this.groupsTop / 2, this.groupsTop]) {
      parts.push(label(String(groups), LEFT + this.wide + 5, this.yOfGroups(groups) + 4, "start", "groups"));
    }
    for (let level = 0; level <= 200; level += 50) parts.push(label(String(level), this.x(level + 0.5), this.high - 3));
    parts.push(label("255", this.x(255.5), this.high - 3));
    return parts;
  }

  bars() {
    const base = this.bottom;
    const tops = this.data.counts.map((count, level) => `L${this.x(level).toFixed(1)} ${this.y(count).toFixed(1)}H${this.x(level + 1).toFixed(1)}`);
    return makeSvg("path", { d: `M${LEFT} ${base}${tops.join("")}V${base}Z`, class: "bars" });
  }

  groups() {
    let d = "";
    this.data.groups.forEach((groups, level) => {
      if (groups < 0) return;
      const isFirst = level === 0 || this.data.groups[level - 1] < 0;
      d += `${isFirst ? "M" : "L"}${this.x(level).toFixed(1)} ${this.yOfGroups(groups).toFixed(1)}H${this.x(level + 1).toFixed(1)}`;
    });
    return makeSvg("path", { d, class: "groups" });
  }

  // How many groups each peak stands for, above it; where two would touch, the surer one is told.
  votes() {
    const told = [];
    for (const peak of [...this.data.peaks].sort((one, other) => other.votes - one.votes || other.level - one.level)) {
      const half = (String(peak.groups).length * LETTER_PX) / 2 + 4;
      const x = this.x(peak.level + 0.5);
      if (told.every((other) => Math.abs(other.x - x) > other.half + half)) told.push({ ...peak, x, half });
    }
    const dots = this.data.peaks.map(({ level }) => makeSvg("circle", { cx: this.x(level + 0.5), cy: this.y(this.data.counts[level]), r: 3, class: "peak" }));
    const labels = told.map((peak) => {
      const text = label(String(peak.groups), peak.x, 12, "middle", "vote");
      text.setAttribute("data-peak", peak.level);
      text.append(makeSvg("title", {}, `peak at level ${peak.level}: votes for ${peak.groups} groups`));
      return text;
    });
    return [...dots, ...(labels.length > 0 ? [label("groups", LEFT - 5, 12, "end")] : []), ...labels];
  }

  line() {
    if (this.isEach) {
      const d = [...new Set(this.levels)].map((level) => `M${this.x(level + 0.5)} ${MARGIN.top - 4}V${this.bottom}`).join("");
      return [makeSvg("path", { d, class: "threshold each" })];
    }
    if (this.level >= LEVELS) return [];
    const x = this.x(this.level + 0.5);
    return [makeSvg("path", { d: `M${x} ${MARGIN.top - 4}V${this.bottom}`, class: "threshold" }), makeSvg("path", { d: `M${x - 6} ${MARGIN.top - 4}h12l-6 8Z`, class: "handle" })];
  }
}

function label(text, x, y, anchor = "middle", name = "") {
  return makeSvg("text", { x, y, "text-anchor": anchor, class: name }, text);
}

customElements.define("dockpose-histogram", Histogram);
