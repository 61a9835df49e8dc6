// The 3D scene as a light drawing, in place of viser's while frames are played without a graphics card: the camera, its
// picture plane and the docks, from the same side as "Fit" and ten times a second at most.
"use strict";
import { follow, make, makeSvg } from "./link.js";

const EVERY_MS = 100;
const PLANE_AT = 0.3; // of the way to the farthest dock
const CORNERS = 32;
const [HOLE, NORMAL] = [0.62, 1.3]; // of a dock, in radii
const EYE = unit([0.8, -0.42, -0.6]); // from the scene to the eye, in the camera's frame: y points down
const RIGHT = unit(cross([0, -1, 0], EYE));
const UP = cross(EYE, RIGHT);
const MARGIN = { side: 24, top: 52, bottom: 24 }; // in pixels; buttons lie along the upper edge

function unit(one) {
  const length = Math.hypot(...one);
  return one.map((part) => part / length);
}
function cross([a, b, c], [d, e, f]) {
  return [b * f - c * e, c * d - a * f, a * e - b * d];
}
const dot = (one, other) => one.reduce((sum, part, index) => sum + part * other[index], 0);
const plus = (one, other, times = 1) => one.map((part, index) => part + times * other[index]);
const seen = (point) => [dot(point, RIGHT), -dot(point, UP)];

class Scene extends HTMLElement {
  connectedCallback() {
    if (this.svg !== undefined) return;
    this.svg = makeSvg("svg", { role: "img", "aria-label": "camera and docks from the side" });
    this.append(this.svg);
    [this.drawnAt, this.course, this.box] = [0, null, null];
    new ResizeObserver(() => this.draw()).observe(this);
  }

  take(frame) {
    this.frame = frame;
    clearTimeout(this.waiting);
    if (!frame.hidesScene) return;
    if (this.parentElement !== viserPage.sceneBox()) viserPage.sceneBox().append(this);
    const rest = EVERY_MS - (performance.now() - this.drawnAt);
    if (rest <= 0) this.draw();
    else this.waiting = setTimeout(() => this.draw(), rest);
  }

  draw() {
    const [wide, high] = [this.clientWidth, this.clientHeight];
    if (wide === 0 || high === 0) return;
    this.drawnAt = performance.now();
    const { overlay, timeline } = this.frame;
    if (timeline.course !== this.course) [this.course, this.box] = [timeline.course, null];
    const docks = [...overlay.poses].reverse().map((pose) => ({ ...pose, ...this.dock(pose, overlay.dockRadius) }));
    const depth = Math.max(...docks.map((dock) => dock.at[2]), this.depth ?? 0, 0.1);
    if (docks.length > 0) this.depth = Math.max(...docks.map((dock) => dock.at[2]));
    const plane = overlay.plane.map((corner) => corner.map((part) => part * PLANE_AT * depth));
    this.widen([[0, 0, 0], ...plane, ...docks.flatMap((dock) => [...dock.rim, dock.tip])].map(seen));
    const place = this.placed(wide, high);
    const path = (points, isClosed) => `M${points.map((point) => place(seen(point)).map((one) => one.toFixed(1)).join(" ")).join("L")}${isClosed ? "Z" : ""}`;
    const edges = plane.map((corner) => path([[0, 0, 0], corner])).join("");
    this.svg.replaceChildren(
      makeSvg("path", { d: path(plane, true), class: "plane" }), makeSvg("path", { d: edges, class: "edges" }),
      ...docks.filter((dock) => dock.chosen).map((dock) => makeSvg("path", { d: path([[0, 0, 0], dock.at]), class: "aim" })),
      ...docks.flatMap((dock) => {
        const name = `pose-${dock.name.toLowerCase()} ${dock.chosen ? "chosen" : "other"}`;
        const side = dot(dock.normal3, EYE) > 0 ? "face" : "back";
        const [x, y] = place(seen(dock.tip));
        const letter = makeSvg("text", { x: x + 6, y: y + 4 });
        letter.textContent = dock.name;
        return [
          makeSvg("path", { d: path(dock.rim, true) + path(dock.hole, true), class: `disc ${side} ${name}` }),
          makeSvg("path", { d: path([dock.at, dock.tip]), class: `arrow ${name}` }), makeSvg("circle", { cx: x, cy: y, r: 3, class: `tip ${name}` }), letter,
        ];
      }),
    );
  }

  // The corners of a dock's rim and hole, and where its arrow ends.
  dock({ place }, radius) {
    const [at, normal3] = [place.slice(0, 3), place.slice(3)];
    const across = unit(cross(Math.abs(normal3[1]) < 0.9 ? [0, 1, 0] : [1, 0, 0], normal3));
    const along = cross(normal3, across);
    const ring = (size) => Array.from({ length: CORNERS }, (_, index) => {
      const angle = (2 * Math.PI * index) / CORNERS;
      return plus(plus(at, across, size * Math.cos(angle)), along, size * Math.sin(angle));
    });
    return { at, normal3, rim: ring(radius), hole: ring(HOLE * radius), tip: plus(at, normal3, NORMAL * radius) };
  }

  // All that was seen of this course stays in sight, so that the dock moves and not the view.
  widen(points) {
    const [xs, ys] = [0, 1].map((part) => points.map((point) => point[part]));
    const [left, top, right, bottom] = this.box ?? [Infinity, Infinity, -Infinity, -Infinity];
    this.box = [Math.min(left, ...xs), Math.min(top, ...ys), Math.max(right, ...xs), Math.max(bottom, ...ys)];
  }

  placed(wide, high) {
    const [left, top, right, bottom] = this.box;
    const [width, height] = [wide - 2 * MARGIN.side, high - MARGIN.top - MARGIN.bottom];
    const scale = Math.max(1e-6, Math.min(width / (right - left), height / (bottom - top)));
    const [x0, y0] = [(wide - scale * (right - left)) / 2, MARGIN.top + (height - scale * (bottom - top)) / 2];
    return ([x, y]) => [x0 + scale * (x - left), y0 + scale * (y - top)];
  }
}

customElements.define("dockpose-scene", Scene);
const scene = make("dockpose-scene");
follow("frame", (frame) => scene.take(frame));
