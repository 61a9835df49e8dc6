// Draws what was found over the picture: in SVG, at the size of the screen, so that lines stay crisp at any zoom.
"use strict";
import { makeSvg } from "./link.js";

const LEAST_RADIUS_PX = 8;

// The elements of the overlay. `shown` is "annotated", "thresholded" or "original".
export function overlayParts(overlay, viewport, shown) {
  const parts = [];
  if (shown !== "original") {
    overlay.masks.forEach((mask, index) => parts.push(drawMask(mask, index, viewport)));
    if (shown === "annotated") parts.push(...drawRing(overlay, viewport));
    if (shown === "annotated") parts.push(...[...overlay.poses].reverse().map((pose) => drawPose(pose, viewport)));
    overlay.groups.forEach((group) => parts.push(drawGroup(group, viewport, shown)));
    if (shown === "annotated") {
      parts.push(...drawCentres(overlay, viewport), ...drawScale(overlay, viewport));
    }
  }
  return parts;
}

// The path through points of the picture.
function path(points, viewport, closed = false) {
  const places = points.map((point) => viewport.toStage(point).map((one) => one.toFixed(2)).join(" "));
  return places.length < 2 ? "" : `M${places.join("L")}${closed ? "Z" : ""}`;
}

// A line with a dark edge, so that it is seen on a bright picture too.
function line(d, name) {
  return makeSvg("g", {}, makeSvg("path", { d, class: "edge" }), makeSvg("path", { d, class: `line ${name}` }));
}

function words(text, [x, y], name = "", anchor = "middle") {
  const label = makeSvg("text", { x, y, class: name, "text-anchor": anchor });
  label.textContent = text;
  return label;
}

function titled(element, text) {
  const title = makeSvg("title");
  title.textContent = text;
  element.append(title);
  return element;
}

function drawRing(overlay, viewport) {
  return overlay.outline === null ? [] : [titled(line(path(overlay.outline, viewport, true), "ellipse"), "fitted ellipse")];
}

// A light on the ring has a circle and its number; a group that was thrown out has a cross.
function drawGroup(group, viewport, shown) {
  const [x, y] = viewport.toStage(group.at);
  const radius = Math.max(LEAST_RADIUS_PX, group.radius * viewport.scale);
  const place = { class: "group", "data-x": group.at[0], "data-y": group.at[1], transform: `translate(${x} ${y})` };
  if (!group.onRing) {
    const r = 0.7 * radius;
    const cross = line(`M${-r} ${-r}L${r} ${r}M${-r} ${r}L${r} ${-r}`, "dropped");
    return titled(makeSvg("g", { ...place, "data-thrown-out": "" }, cross), "thrown out: not a light of the dock");
  }
  const edge = makeSvg("circle", { r: radius, class: "edge" });
  const ring = makeSvg("circle", { r: radius, class: "line light" });
  const mark = makeSvg("g", { ...place, "data-light": group.label }, edge, ring);
  if (shown === "annotated") {
    const [dx, dy] = group.outward.map((one) => one * (radius + 11));
    mark.append(words(group.label, [dx, dy + 5]));
  }
  return titled(mark, `light ${group.label} on the ring`);
}

// A pose's dock: its outline, two diameters, and its normal with the pose's letter at the tip.
function drawPose(pose, viewport) {
  const name = `pose-${pose.name.toLowerCase()}${pose.chosen ? " chosen" : ""}`;
  const parts = pose.axes.map((ends) => line(path(ends, viewport), `${name} thin`));
  parts.push(line(path(pose.outline, viewport, true), `${name} thin`), line(path(pose.normal, viewport), name));
  if (pose.normal.length === 2) {
    const [x, y] = viewport.toStage(pose.normal[1]);
    parts.push(makeSvg("circle", { cx: x, cy: y, r: 4, class: `line tip ${name}` }), words(pose.name, [x + 8, y + 5], "letter", "start"));
  }
  const group = makeSvg("g", { "data-pose": pose.name }, ...parts);
  return titled(group, `dock by pose ${pose.name}${pose.chosen ? ", chosen" : ""}`);
}

function drawCentres(overlay, viewport) {
  const parts = [];
  if (overlay.ellipse !== null) {
    const [x, y] = viewport.toStage(overlay.ellipse);
    const plus = line(`M${x - 7} ${y}H${x + 7}M${x} ${y - 7}V${y + 7}`, "ellipse");
    parts.push(titled(plus, "centre of the ellipse"));
  }
  if (overlay.centre !== null) {
    const [cx, cy] = viewport.toStage(overlay.centre);
    const ring = makeSvg("circle", { cx, cy, r: 6, class: "line centre" });
    const group = makeSvg("g", {}, makeSvg("circle", { cx, cy, r: 6, class: "edge" }), ring);
    parts.push(titled(group, "centre of the dock"));
  }
  return parts;
}

export function drawMask([left, top, width, height], index, viewport) {
  const [x, y] = viewport.toStage([left - 0.5, top - 0.5]);
  const size = { width: width * viewport.scale, height: height * viewport.scale };
  const box = makeSvg("rect", { x, y, ...size, class: "mask" });
  return titled(makeSvg("g", { "data-mask": index }, box, words("masked", [x + 4, y + 15], "mask", "start")), "not looked at");
}

// A bar of a round length at the dock's distance.
function drawScale(overlay, viewport) {
  if (overlay.scale === null) return [];
  const [right, y] = [viewport.wide - 10, viewport.high - 10];
  const left = right - overlay.scale.px * viewport.scale;
  if (left < 0) return [];
  return [line(`M${left} ${y}H${right}`, "scale"), words(`${overlay.scale.words} at the dock`, [right, y - 7], "", "end")];
}
