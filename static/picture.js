// The picture on the page: as it was sent, with what was found drawn over it. To zoom, pan, mask and measure.
"use strict";
import { Flat } from "./flat.js";
import "./frame.js";
import { request } from "./jobs.js";
import { Hand } from "./lights.js";
import { follow, hideBoxBefore, make, makeSvg, sendThrough } from "./link.js";
import { overlayParts } from "./overlay.js";
import { greyOf, keptPixels, paintKept, stretch } from "./pixels.js";
import { Tools } from "./tools.js";
import { Viewport } from "./viewport.js";

const ZOOM = 1.5;
const SHARP_FROM = 2; // screen pixels in a pixel of the picture, from which each is a sharp square
const QUICK_MS = 250; // frames that come sooner after each other than that are painted in the quick way
const KINDS = {
  annotated: ["Annotated", "The picture with all that was found in it. Key: A"],
  thresholded: ["Threshold", "The pixels that the threshold keeps. Key: S"],
};
const LAYERS = { // of the annotated picture, each with its key
  lights: ["Lights", "l"],
  ellipse: ["Ellipse", "e"],
  a: ["A", "1"],
  b: ["B", "2"],
  truth: ["Truth", "y"],
};
const HIDDEN = "dockpose hidden layers"; // each browser remembers its own

class Picture extends HTMLElement {
  connectedCallback() {
    if (this.stage === undefined) this.build();
    sendThrough(this.getAttribute("channel"));
    hideBoxBefore(this);
    this.resizes = new ResizeObserver(() => this.resize());
    this.resizes.observe(this.stage);
    if (localStorage.getItem(HIDDEN) !== null) this.tellLayers();
    this.ends = [follow("frame", (frame) => this.take(frame)), follow("spot", (spot) => this.hand.takeSpot(spot))];
  }

  disconnectedCallback() {
    this.resizes.disconnect();
    for (const end of this.ends) end();
  }

  build() {
    [this.shown, this.isStretched] = ["annotated", false];
    [this.overlay, this.picture, this.grey, this.painted] = [null, null, null, ""];
    const hidden = JSON.parse(localStorage.getItem(HIDDEN) ?? '["truth"]');
    this.layers = new Set(Object.keys(LAYERS).filter((name) => !hidden.includes(name)));
    this.viewport = new Viewport();
    this.canvas = make("canvas", { "aria-hidden": "true" });
    this.canvas.getContext("2d", { willReadFrequently: true });
    this.svg = makeSvg("svg", { class: "found", role: "img", "aria-label": "what was found in the picture" });
    this.drafts = makeSvg("svg", { class: "draft", "aria-hidden": "true" });
    this.flat = new Flat(this.svg);
    this.readout = make("output", { class: "readout", "aria-label": "pixel under the pointer" });
    this.frameLabel = make("span", { class: "frame" });
    this.hand = new Hand(this);
    this.stage = make("div", { class: "stage", tabindex: "0", role: "application" }, this.canvas, this.flat.canvas, this.svg, this.drafts, this.readout, this.hand.loupe);
    this.stage.setAttribute("aria-label", "Picture. Arrows: pan. Plus, minus: zoom. F: fit.");
    const show = (kind) => () => this.show(kind);
    this.buttons = {};
    for (const [kind, [text, hint]] of Object.entries(KINDS)) this.addButton(kind, text, hint, show(kind));
    this.addButton("contrast", "Contrast", "Stretch the contrast, to see what is dim. Key: C", () => this.toggleContrast());
    this.addButton("mask", "Mask", "Draw a rectangle that is not looked at. Key: M", () => this.toggleTool("mask"));
    this.addButton("ruler", "Ruler", "Measure between two points. Key: U", () => this.toggleTool("ruler"));
    this.addButton("hand", "Set lights", "Click each light of the dock; on one: take it away. Drag or arrows: move it. Shift: exactly there. Key: H", () => this.toggleTool("lights"));
    this.addButton("clear", "Clear", "Take all lights away, to set them one by one", () => this.hand.tell([]));
    this.addButton("search", "Search again", "Let the program look for the lights", () => this.hand.tell(null));
    this.addButton("in", "+", "Zoom in. Key: +", () => this.zoom(ZOOM));
    this.addButton("out", "−", "Zoom out. Key: -", () => this.zoom(1 / ZOOM));
    this.addButton("fit", "Fit", "Show the whole picture. Key: F", () => this.fit());
    for (const [name, [text, key]] of Object.entries(LAYERS)) {
      this.addButton(`layer-${name}`, text, `Show it, or hide it. Key: ${key.toUpperCase()}`, () => this.toggleLayer(name));
      this.buttons[`layer-${name}`].setAttribute("aria-pressed", String(this.layers.has(name)));
    }
    const of = (...names) => names.map((name) => this.buttons[name]);
    const kinds = make("div", { class: "group", role: "group", "aria-label": "What is shown" }, ...of(...Object.keys(KINDS)));
    const tools = make("div", { class: "group", role: "group", "aria-label": "Tools" }, ...of("contrast", "mask", "ruler", "hand", "clear", "search"));
    const zoom = make("div", { class: "zoom", role: "group", "aria-label": "Zoom" }, ...of("in", "out", "fit"));
    const layers = make("div", { class: "group layers", role: "group", "aria-label": "Layers" }, ...of(...Object.keys(LAYERS).map((name) => `layer-${name}`)));
    const help = make("a", { href: "help#view", target: "_blank", rel: "noopener" }, "Help");
    this.append(this.stage, make("div", { class: "tools" }, kinds, tools, help, this.frameLabel), zoom, layers);
    this.tools = new Tools(this);
    for (const name of ["clear", "search"]) this.buttons[name].hidden = true;
    for (const group of this.querySelectorAll(".group, .zoom")) this.passOn(group);
    this.keys = this.keysOfButtons();
    this.addEventListener("keydown", (event) => event.key !== "Tab" && event.target !== this.stage && this.keyOnButton(event));
    this.show("annotated");
  }

  addButton(name, text, hint, act) {
    const button = make("button", { type: "button", title: hint, "aria-label": `${text}: ${hint}`, "data-do": name }, text);
    if ((name.length > 4 || ["mask", "hand"].includes(name)) && !["clear", "search"].includes(name)) button.setAttribute("aria-pressed", "false");
    button.addEventListener("click", act);
    this.buttons[name] = button;
  }

  keysOfButtons() {
    const names = { a: "annotated", s: "thresholded", c: "contrast", m: "mask", u: "ruler", h: "hand", "+": "in", "=": "in", "-": "out", f: "fit", 0: "fit" };
    for (const [name, [, key]] of Object.entries(LAYERS)) names[key] = `layer-${name}`;
    return Object.fromEntries(Object.entries(names).map(([key, name]) => [key, () => this.buttons[name].click()]));
  }

  // What lies over the picture hides no pixel from the wheel and the readout.
  passOn(group) {
    group.addEventListener("wheel", (event) => {
      event.preventDefault();
      this.stage.dispatchEvent(new WheelEvent("wheel", event));
    }, { passive: false });
    group.addEventListener("pointermove", (event) => this.tell(this.viewport.toPicture(this.tools.place(event))));
  }

  // On a button, Enter and Space press it; they must not reach the page's own hotkeys.
  keyOnButton(event) {
    if (["Enter", " "].includes(event.key)) event.stopPropagation();
  }

  take({ picture, overlay, serial, isPlaying, lightsHeard, lightsRefused }) {
    clearTimeout(this.settling);
    const now = performance.now();
    const isQuick = isPlaying || now - this.takenAt < QUICK_MS;
    this.takenAt = now;
    this.setQuick(isQuick);
    if (isQuick && !isPlaying) this.settling = setTimeout(() => this.settle(), QUICK_MS);
    if (picture !== this.picture) {
      [this.picture, this.grey] = [picture, null];
      this.viewport.setPicture(picture.width, picture.height);
    }
    [this.overlay, this.serial, this.refused] = [overlay, serial, lightsRefused];
    if (isPlaying) this.tell(null);
    this.hand.take(lightsHeard);
    this.paint();
    this.draw();
    this.dataset.frame = overlay.frame;
    this.dataset.drawn = serial; // of the picture and overlay that are to be seen now
  }

  // While frames follow each other, as when a slider moves, all is painted onto one canvas.
  setQuick(isQuick) {
    if (isQuick === this.isQuick) return;
    this.isQuick = isQuick;
    this.flat.forget();
    this.stage.toggleAttribute("data-flat", isQuick);
  }

  settle() {
    this.setQuick(false);
    this.paint();
    this.draw();
  }

  show(kind) {
    this.shown = this.dataset.shown = kind;
    for (const name of Object.keys(KINDS)) this.buttons[name].setAttribute("aria-pressed", String(name === kind));
    this.paint();
    this.draw();
  }

  // Above the picture: its name; beside it, under Threshold, what the colours mean.
  label() {
    const { groups, small, name } = this.overlay;
    const lights = groups.filter((group) => group.onRing).length;
    const parts = [["light", `○ ${lights} on the ring`], ["dropped", `✕ ${groups.length - lights} thrown out`]];
    if (small !== null) parts.push(["small", `${small[0]} below ${small[1]} px`]);
    const colours = parts.map(([kind, text]) => make("span", { class: kind }, text));
    this.frameLabel.replaceChildren(name, ...(this.shown === "thresholded" ? colours : []));
    if (this.refused && this.tools.tool === "lights") this.frameLabel.append(make("span", { class: "refused", role: "status" }, this.refused));
  }

  toggleLayer(name) {
    if (!this.layers.delete(name)) this.layers.add(name);
    this.buttons[`layer-${name}`].setAttribute("aria-pressed", String(this.layers.has(name)));
    localStorage.setItem(HIDDEN, JSON.stringify(Object.keys(LAYERS).filter((one) => !this.layers.has(one))));
    this.tellLayers();
    this.draw();
  }

  // What is exported is drawn alike.
  tellLayers() {
    request({ do: "layers", of: [...this.layers] });
  }

  toggleContrast() {
    this.isStretched = !this.isStretched;
    this.buttons.contrast.setAttribute("aria-pressed", String(this.isStretched));
    this.paint();
  }

  toggleTool(tool) {
    this.tools.take(this.tools.tool === tool ? null : tool);
    this.stage.focus();
  }

  onTool(tool) {
    const pressed = { mask: "mask", ruler: "ruler", hand: "lights" };
    for (const [name, its] of Object.entries(pressed)) this.buttons[name].setAttribute("aria-pressed", String(its === tool));
    const isHand = tool === "lights";
    for (const name of ["clear", "search"]) this.buttons[name].hidden = !isHand;
    if (isHand) this.hand.begin();
    else this.hand.end();
    this.stage.dataset.tool = tool ?? "";
    this.draw();
  }

  zoom(factor) {
    this.viewport.zoom(factor);
    this.draw();
  }

  fit() {
    this.viewport.fit();
    this.draw();
  }

  resize() {
    const { clientWidth, clientHeight } = this.stage;
    if (clientWidth === 0) return; // its tab is closed
    this.viewport.setStage(clientWidth, clientHeight);
    this.draw();
  }

  // The grey of each pixel, read once a picture and only where it is needed.
  greys() {
    if (this.grey === null) {
      const { bitmap } = this.picture;
      const whole = make("canvas", { width: bitmap.width, height: bitmap.height });
      whole.getContext("2d", { willReadFrequently: true }).drawImage(bitmap, 0, 0);
      this.grey = greyOf(whole);
    }
    return this.grey;
  }

  // Whether the canvas would hold the picture as it came.
  get isCopied() {
    return this.shown !== "thresholded" && !this.isStretched;
  }

  // Paint the picture's pixels, unless they are there already.
  paint() {
    if (this.overlay === null) return;
    const { canvas, overlay, picture } = this;
    const { bitmap } = picture;
    const isThresholded = this.shown === "thresholded";
    const now = `${picture.serial} ${isThresholded ? this.serial : ""} ${this.isStretched} ${this.isQuick}`;
    if (now === this.painted) return;
    this.painted = now;
    [canvas.width, canvas.height] = [bitmap.width, bitmap.height];
    if (isThresholded) {
      const style = getComputedStyle(this);
      const colour = (name) => style.getPropertyValue(`--${name}`).trim();
      const colours = { small: colour("small"), light: colour("light"), dropped: colour("dropped") };
      paintKept(canvas, keptPixels(this.greys(), bitmap.width, overlay), overlay, colours);
      return;
    }
    if (!this.isCopied || !this.isQuick) canvas.getContext("2d").drawImage(bitmap, 0, 0);
    if (this.isStretched) stretch(canvas, this.greys());
  }

  // Lay the picture where the viewport has it, and draw the overlay there.
  draw() {
    if (this.overlay === null) return;
    const { viewport, canvas } = this;
    const scale = (viewport.scale * viewport.width) / canvas.width; // a very large picture is sent smaller
    canvas.style.transform = `translate(${viewport.left}px, ${viewport.top}px) scale(${scale})`;
    canvas.style.imageRendering = scale >= SHARP_FROM ? "pixelated" : "auto";
    const parts = overlayParts(this.overlay, viewport, this.shown, this.layers);
    if (this.isQuick) {
      this.flat.begin(viewport.wide, viewport.high);
      this.flat.context.imageSmoothingEnabled = scale < SHARP_FROM;
      const place = [viewport.left, viewport.top, canvas.width * scale, canvas.height * scale];
      this.flat.context.drawImage(this.isCopied ? this.picture.bitmap : canvas, ...place);
      this.flat.paint(parts);
    }
    this.svg.replaceChildren(...(this.isQuick ? [] : parts));
    this.stage.toggleAttribute("data-fits", viewport.fits);
    this.buttons["layer-truth"].hidden = this.overlay.truth === null;
    this.label();
    this.drawDraft();
  }

  drawDraft() {
    this.drafts.replaceChildren(...this.tools.draft(this.overlay));
  }

  // Tell place and grey of the pixel at a point; null where the pointer left.
  tell(point) {
    if (point === null || this.overlay === null) {
      this.readout.textContent = "";
      return;
    }
    const [x, y] = point.map(Math.round);
    const { width, height } = this.viewport;
    if (x < 0 || y < 0 || x >= width || y >= height) {
      this.readout.textContent = "";
      return;
    }
    const { bitmap, isExact } = this.picture;
    const step = width / bitmap.width;
    const grey = this.greys()[Math.floor(y / step) * bitmap.width + Math.floor(x / step)];
    this.readout.textContent = `x ${x}, y ${y}: ${isExact ? "" : "about "}grey ${grey}`;
  }
}

customElements.define("dockpose-picture", Picture);
