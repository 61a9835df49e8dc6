// Paints SVG elements onto a canvas. A canvas reaches the screen as one picture, where a browser without a graphics card
// would draw the lines one by one: too slow while frames follow each other.
"use strict";
import { make } from "./link.js";

export class Flat {
  // `svg` stands where the elements would, so that they are painted in the colours that they would have there.
  constructor(svg) {
    this.svg = svg;
    this.styles = new Map();
    this.canvas = make("canvas", { class: "flat", "aria-hidden": "true" });
    this.context = this.canvas.getContext("2d", { willReadFrequently: true });
  }

  // Begin anew, in pixels of the page.
  begin(wide, high) {
    if (this.scheme !== viserPage.scheme()) this.forget();
    this.scheme = viserPage.scheme();
    const scale = window.devicePixelRatio;
    const [width, height] = [Math.round(wide * scale), Math.round(high * scale)];
    if (this.canvas.width !== width || this.canvas.height !== height) {
      [this.canvas.width, this.canvas.height] = [width, height];
      [this.canvas.style.width, this.canvas.style.height] = [`${wide}px`, `${high}px`];
    }
    this.context.setTransform(scale, 0, 0, scale, 0, 0);
    this.context.clearRect(0, 0, wide, high);
  }

  // Colours may have changed since frames last followed each other.
  forget() {
    this.styles.clear();
  }

  paint(elements) {
    for (const element of elements) this.paintOne(element, []);
  }

  paintOne(element, within) {
    const { context } = this;
    if (element.tagName === "title") return;
    context.save();
    const [, x, y] = /translate\((\S+) (\S+)\)/.exec(element.getAttribute("transform")) ?? [];
    if (x !== undefined) context.translate(Number(x), Number(y));
    if (element.tagName === "g") for (const child of element.children) this.paintOne(child, [...within, element]);
    else this.fillAndStroke(element, this.styleOf(element, within));
    context.restore();
  }

  fillAndStroke(element, style) {
    const { context } = this;
    const isText = element.tagName === "text";
    const shape = isText ? null : outline(element);
    const text = isText ? [element.firstChild?.data ?? "", number(element, "x"), number(element, "y")] : null;
    [context.fillStyle, context.strokeStyle, context.lineWidth] = [style.fill, style.stroke, style.strokeWidth];
    context.setLineDash(style.dash);
    context.lineJoin = style.lineJoin;
    if (isText) [context.font, context.textAlign] = [style.font, ALIGNED[element.getAttribute("text-anchor")] ?? "start"];
    if (style.stroke !== "none") {
      context.globalAlpha = style.strokeOpacity;
      if (isText) context.strokeText(...text);
    }
    if (style.fill !== "none") {
      context.globalAlpha = style.fillOpacity;
      if (isText) context.fillText(...text);
      else context.fill(shape);
    }
    if (style.stroke !== "none" && !isText) {
      context.globalAlpha = style.strokeOpacity;
      context.stroke(shape);
    }
  }

  // What an element would look like within these others; asked once for each kind.
  styleOf(element, within) {
    const kind = [...within, element].map((one) => `${one.tagName}.${one.getAttribute("class")}`).join(" ");
    if (!this.styles.has(kind)) {
      const copies = [...within, element].map((one) => one.cloneNode(false));
      copies.reduce((outer, inner) => outer.appendChild(inner));
      this.svg.append(copies[0]);
      const style = getComputedStyle(copies.at(-1));
      this.styles.set(kind, {
        fill: style.fill,
        fillOpacity: Number(style.fillOpacity),
        stroke: style.stroke,
        strokeOpacity: Number(style.strokeOpacity),
        strokeWidth: parseFloat(style.strokeWidth),
        dash: style.strokeDasharray === "none" ? [] : style.strokeDasharray.split(/[ ,]+/).map(parseFloat),
        lineJoin: style.strokeLinejoin,
        font: style.font,
      });
      copies[0].remove();
    }
    return this.styles.get(kind);
  }
}

const ALIGNED = { middle: "center", end: "end", start: "start" };

function number(element, name) {
  return Number(element.getAttribute(name) ?? 0);
}

function outline(element) {
  if (element.tagName === "path") return new Path2D(element.getAttribute("d"));
  const shape = new Path2D();
  if (element.tagName === "circle") {
    shape.arc(number(element, "cx"), number(element, "cy"), number(element, "r"), 0, 2 * Math.PI);
  } else {
    shape.rect(number(element, "x"), number(element, "y"), number(element, "width"), number(element, "height"));
  }
  return shape;
}
