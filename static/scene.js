// The 3D scene as a light drawing, in place of viser's while it changes without a graphics card: the camera, its picture
// plane, the docks and their labels, from where viser's scene is looked at, and ten times a second at most while playing.
"use strict";
import { follow, make, makeSvg } from "./link.js";

const EVERY_MS = 100;
const [HOLE, NORMAL] = [0.62, 1.3]; // of a dock, in radii
const LETTER_PX = 12;

const dot = (one, other) => one.reduce((sum, part, index) => sum + part * other[index], 0);
const plus = (one, other, times = 1) => one.map((part, index) => part + times * other[index]);

class Scene extends HTMLElement {
  connectedCallback() {
    if (this.svg !== undefined) return;
    this.svg = makeSvg("svg", { role: "img", "aria-label": "camera and docks from the side" });
    this.append(this.svg);
    this.drawnAt = 0;
    new ResizeObserver(() => this.draw()).observe(this);
  }

  take(frame) {
    this.frame = frame;
    clearTimeout(this.waiting);
    if (!frame.hidesScene) return;
    if (this.parentElement !== viserPage.sceneBox()) viserPage.sceneBox().append(this);
    const rest = frame.isPlaying ? EVERY_MS - (performance.now() - this.drawnAt) : 0;
    if (rest <= 0) this.draw();
    else this.waiting = setTimeout(() => this.draw(), rest);
  }

  draw() {
    const [wide, high] = [this.clientWidth, this.clientHeight];
    const { overlay, scene, picture } = this.frame ?? {};
    if (wide === 0 || high === 0 || !scene || viserPage.eye === undefined) return;
    this.drawnAt = performance.now();
    const place = placing(viserPage.eye, wide, high);
    const path = (points, isClosed) => `M${points.map((point) => place(point).map((one) => one.toFixed(1)).join(" ")).join("L")}${isClosed ? "Z" : ""}`;
    const shape = (look, ...lines) => makeSvg("path", { d: lines.join(""), class: look });
    const { plane } = scene;
    const [across, down] = [1, 3].map((corner) => plus(plane[corner], plane[0], -1));
    const lights = overlay.groups.filter((one) => one.onRing)
      .map(({ at: [x, y] }) => plus(plus(plane[0], across, (x + 0.5) / picture.width), down, (y + 0.5) / picture.height));
    const docks = overlay.poses.map((pose, index) => ({ ...pose, ...dockOf(pose.place, overlay.dockRadius, scene, index) }));
    docks.sort((one, other) => one.chosen - other.chosen);
    this.svg.replaceChildren(
      shape("plane", path(plane, true)), shape("edges", ...plane.map((corner) => path([[0, 0, 0], corner])), ...scene.marks.map((ends) => path(ends))),
      ...(lights.length > 2 ? [shape("ring", path(lights, true))] : []), ...lights.map((light) => {
        const [x, y] = place(light);
        return makeSvg("circle", { cx: x, cy: y, r: 1.5, class: "spot" });
      }),
      shape("rays", ...scene.rays.map((ends) => path(ends))), shape("way", ...scene.path.map((ends) => path(ends))),
      shape("known", ...scene.known.map((rim) => path(rim, true))),
      ...docks.flatMap((dock) => {
        const name = `pose-${dock.name.toLowerCase()} ${dock.chosen ? "chosen" : "other"}`;
        const side = dot(dock.normal3, plus(viserPage.eye.position, dock.at, -1)) > 0 ? "face" : "back";
        const [x, y] = place(dock.tip);
        return [shape(`disc ${side} ${name}`, path(dock.rim, true), path(dock.hole, true)), shape(`arrow ${name}`, path([dock.at, dock.tip])),
          makeSvg("circle", { cx: x, cy: y, r: 3, class: `tip ${name}` })];
      }),
      ...scene.labels.map(([name, words, anchor, ...at]) => {
        const [x, y] = place(at);
        const [above, beside] = anchor.split("-");
        const text = makeSvg("text", { x, y: y + { bottom: -5, center: LETTER_PX / 3, top: LETTER_PX + 3 }[above], class: `pose-${name.toLowerCase()}` });
        text.setAttribute("text-anchor", { left: "start", center: "middle", right: "end" }[beside]);
        text.textContent = words;
        return text;
      }),
    );
    this.dataset.drawn = String(Number(this.dataset.drawn ?? 0) + 1);
  }
}

// A function from a point in metres to its pixels, as viser's eye sees it: by a pinhole whose y points down.
function placing({ position, wxyz: [w, x, y, z], fov }, wide, high) {
  const axes = [
    [1 - 2 * (y * y + z * z), 2 * (x * y + w * z), 2 * (x * z - w * y)],
    [2 * (x * y - w * z), 1 - 2 * (x * x + z * z), 2 * (y * z + w * x)],
    [2 * (x * z + w * y), 2 * (y * z - w * x), 1 - 2 * (x * x + y * y)],
  ];
  const scale = high / 2 / Math.tan(fov / 2);
  return (point) => {
    const [right, down, ahead] = axes.map((axis) => dot(axis, plus(point, position, -1)));
    const times = scale / Math.max(ahead, 1e-3);
    return [wide / 2 + times * right, high / 2 + times * down];
  };
}

// Where a dock is, its rim and its hole, and where its arrow ends.
function dockOf(place, radius, { shift, rims }, index) {
  const [at, normal3, rim] = [plus(place.slice(0, 3), shift), place.slice(3), rims[index]];
  return { at, normal3, rim, hole: rim.map((corner) => plus(at, plus(corner, at, -1), HOLE)), tip: plus(at, normal3, NORMAL * radius) };
}

customElements.define("dockpose-scene", Scene);
const scene = make("dockpose-scene");
follow("frame", (frame) => scene.take(frame));
viserPage.takeEye = (eye) => {
  viserPage.eye = eye;
  if (scene.offsetParent !== null) scene.draw();
};
