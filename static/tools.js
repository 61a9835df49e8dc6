// What can be done on the picture with the mouse, a finger or the keys: pan, draw a mask, measure with the ruler.
"use strict";
import { makeSvg, send } from "./link.js";

const LEAST_MASK_PX = 2;
const CLICK_PX = 4; // a press that moves less is a click: the ruler's first end, not the whole line
const PAN_PX = 40;
const ROUNDING = 1e-6;

// Works on `view`, the picture's element; `tool` is null (pan), "mask", "ruler" or "lights", which the view's hand sets.
export class Tools {
  constructor(view) {
    this.view = view;
    this.tool = null;
    this.pressed = null; // where on the stage the pointer went down
    [this.start, this.end, this.phase] = [null, null, null]; // of a mask or the ruler, in pixels of the picture
    this.cursor = null; // what the arrow keys move while a tool is in hand
    this.fingers = new Map(); // places on the stage by pointer
    const { stage } = view;
    stage.addEventListener("pointerdown", (event) => this.press(event));
    stage.addEventListener("pointermove", (event) => this.move(event));
    stage.addEventListener("pointerup", (event) => this.release(event));
    stage.addEventListener("pointercancel", (event) => this.cancel(event));
    stage.addEventListener("pointerleave", () => {
      view.tell(null);
      this.hand?.leave();
    });
    stage.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    stage.addEventListener("keydown", (event) => this.key(event));
  }

  // Take a tool in hand, or none; whatever was begun is forgotten.
  take(tool) {
    [this.tool, this.pressed, this.start, this.end, this.cursor] = [tool, null, null, null, null];
    this.phase = null; // "dragged": the first end is down; "clicked": it is set, and the second is to come; "last"
    this.view.onTool(tool);
  }

  // What sets lights, while that is the tool.
  get hand() {
    return this.tool === "lights" ? this.view.hand : null;
  }

  place(event) {
    const { left, top } = this.view.stage.getBoundingClientRect();
    return [event.clientX - left, event.clientY - top];
  }

  press(event) {
    if (event.button !== 0) return;
    this.view.stage.setPointerCapture(event.pointerId);
    this.fingers.set(event.pointerId, this.place(event));
    if (this.fingers.size > 1) {
      this.take(this.tool); // what the first finger began was meant for two
      return;
    }
    [this.pressed, this.cursor, this.isOnWhole] = [this.place(event), null, this.view.viewport.fits];
    this.hand?.press(this.pressed);
    if (this.tool === null || this.hand) return;
    if (this.phase !== "clicked") this.start = this.view.viewport.toPicture(this.pressed);
    this.phase = this.phase === "clicked" ? "last" : "dragged";
    this.end = this.view.viewport.toPicture(this.pressed);
  }

  move(event) {
    const place = this.place(event);
    if (this.fingers.size > 1) {
      this.pinch(event.pointerId, place);
      return;
    }
    const point = this.view.viewport.toPicture(place);
    this.hand?.move(place);
    if (this.tool === null && this.pressed !== null) {
      this.view.viewport.pan(place[0] - this.pressed[0], place[1] - this.pressed[1]);
      this.pressed = place;
      this.view.draw();
    } else if (this.phase !== null) {
      this.end = point;
      this.view.drawDraft();
    }
    this.view.tell(point);
  }

  // Two fingers zoom by how far they go apart, about the middle between them, and pan by where that goes.
  pinch(id, place) {
    const before = this.fingers.get(id);
    const [other] = [...this.fingers].filter(([one]) => one !== id).map(([, at]) => at);
    if (before === undefined) return;
    this.fingers.set(id, place);
    const apart = ([x, y]) => Math.max(Math.hypot(x - other[0], y - other[1]), 1);
    const middle = ([x, y]) => [(x + other[0]) / 2, (y + other[1]) / 2];
    const [from, to] = [middle(before), middle(place)];
    this.view.viewport.pan(to[0] - from[0], to[1] - from[1]);
    this.view.viewport.zoom(apart(place) / apart(before), to);
    this.view.draw();
  }

  // The browser took a finger's movement for scrolling the page: the picture stays as it was.
  cancel(event) {
    this.fingers.delete(event.pointerId);
    if (this.isOnWhole) this.view.fit();
    this.take(this.tool);
  }

  release(event) {
    this.fingers.delete(event.pointerId);
    if (this.pressed === null) return;
    const [x, y] = this.place(event);
    const isClick = Math.hypot(x - this.pressed[0], y - this.pressed[1]) < CLICK_PX;
    this.pressed = null;
    this.hand?.release([x, y], event.shiftKey);
    if (this.phase === null) return;
    if (this.phase === "dragged" && isClick) this.phase = "clicked";
    else this.finish(this.view.viewport.toPicture([x, y]));
  }

  // The second end: a mask goes to the program, a ruler's line stays until the next.
  finish(end) {
    [this.end, this.phase] = [end, null];
    if (this.tool === "mask") {
      const [x, y, width, height] = maskBetween(this.start, this.end);
      if (width >= LEAST_MASK_PX && height >= LEAST_MASK_PX) send({ do: "mask", x, y, width, height });
      this.take(null);
    }
    this.view.drawDraft();
  }

  wheel(event) {
    event.preventDefault();
    this.view.viewport.zoom(Math.exp(-0.0015 * event.deltaY * (event.deltaMode === 1 ? 33 : 1)), this.place(event));
    this.view.draw();
  }

  // Keys while the picture has the focus. What is used here must not reach the page's own hotkeys.
  key(event) {
    if (event.ctrlKey || event.altKey || event.metaKey) return;
    const arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    const act = this.view.keys[event.key.toLowerCase()];
    if (this.hand?.key(event, arrow));
    else if (arrow && this.tool !== null) this.moveCursor(arrow.map((one) => one * (event.shiftKey ? 10 : 1)));
    else if (arrow) this.view.viewport.pan(...arrow.map((one) => -PAN_PX * one));
    else if (["Enter", " "].includes(event.key) && this.tool !== null) this.setPoint(event.shiftKey);
    else if (event.key === "Escape" && this.tool !== null) this.take(null);
    else if (act) act();
    else return;
    event.preventDefault();
    event.stopPropagation();
    this.view.draw();
  }

  moveCursor([dx, dy]) {
    const { viewport } = this.view;
    const middle = viewport.toPicture([viewport.wide / 2, viewport.high / 2]);
    const [x, y] = this.cursor ?? middle.map((one) => Math.round(one + ROUNDING)); // half a pixel, but for the arithmetic
    const clip = (one, size) => Math.min(Math.max(one, 0), size - 1);
    this.cursor = [clip(x + dx, viewport.width), clip(y + dy, viewport.height)];
    if (this.phase === "clicked") this.end = this.cursor;
    this.view.tell(this.cursor);
  }

  // Enter: the first end of a mask or of the ruler, then the second; or a light.
  setPoint(isExact) {
    if (this.cursor === null) this.moveCursor([0, 0]);
    if (this.hand) {
      this.hand.enter(this.cursor, isExact);
      return;
    }
    if (this.phase === "clicked") this.finish(this.cursor);
    else [this.start, this.end, this.phase] = [this.cursor, this.cursor, "clicked"];
  }

  // The mask or the ruler's line as it stands, and the cursor, as SVG.
  draft(overlay) {
    const { viewport } = this.view;
    const parts = this.hand?.draft() ?? [];
    if (this.cursor !== null) {
      const [x, y] = viewport.toStage(this.cursor);
      parts.push(makeSvg("path", { d: `M${x - 12} ${y}H${x + 12}M${x} ${y - 12}V${y + 12}`, class: "cursor" }));
    }
    if (this.start === null) return parts;
    if (this.tool === "mask") {
      const [left, top, width, height] = maskBetween(this.start, this.end);
      const [x, y] = viewport.toStage([left - 0.5, top - 0.5]);
      const size = { width: width * viewport.scale, height: height * viewport.scale };
      parts.push(makeSvg("rect", { x, y, ...size, class: "mask" }));
    } else if (this.tool === "ruler") {
      const [[x1, y1], [x2, y2]] = [viewport.toStage(this.start), viewport.toStage(this.end)];
      const label = makeSvg("text", { x: (x1 + x2) / 2, y: (y1 + y2) / 2 - 10, "text-anchor": "middle", class: "ruler" });
      label.textContent = lengthWords(this.start, this.end, overlay);
      const ends = { x1, y1, x2, y2 };
      parts.push(makeSvg("line", { ...ends, class: "edge" }), makeSvg("line", { ...ends, class: "line ruler" }), label);
    }
    return parts;
  }
}

// The whole pixels between two corners: x, y, width, height.
function maskBetween([x0, y0], [x1, y1]) {
  const [left, top] = [Math.floor(Math.min(x0, x1) + 0.5), Math.floor(Math.min(y0, y1) + 0.5)];
  return [left, top, Math.ceil(Math.max(x0, x1) + 0.5) - left, Math.ceil(Math.max(y0, y1) + 0.5) - top];
}

// Pixels, and centimetres at the dock's distance where there is a dock.
export function lengthWords([x0, y0], [x1, y1], overlay) {
  const pixels = Math.hypot(x1 - x0, y1 - y0);
  const length = overlay?.cmPerPx ? `, ${(pixels * overlay.cmPerPx).toFixed(1)} cm at the dock` : "";
  return `${pixels.toFixed(1)} px${length}`;
}
