// Draws what was found over the picture: in SVG, at the size of the screen, so that lines stay crisp at any zoom.
"use strict";
import { makeSvg } from "./link.js";

const LEAST_RADIUS_PX = 6;

// The elements of the overlay. `shown` is "annotated" or "thresholded"; of what is annotated, `layers` are drawn.
// No line runs through a light: all stop at its circle, which is empty.
export function overlayParts(overlay, viewport, shown, layers) {
  const parts = overlay.masks.map((mask, index) => drawMask(mask, index, viewport));
  const groups = layers.has("lights") ? overlay.groups.map((group) => drawGroup(group, viewport, shown, overlay.byHand !== null)) : [];
  if (shown !== "annotated") return [...parts, ...groups];
  const lights = overlay.groups.filter((group) => group.onRing);
  const holes = lights.map((group) => [...viewport.toStage(group.at), radiusOf(group, viewport)]);
  const poses = [...overlay.poses].reverse().filter((pose) => layers.has(pose.name.toLowerCase()));
  if (overlay.truth !== null && layers.has("truth")) parts.push(drawPose(overlay.truth, viewport, holes));
  parts.push(...poses.map((pose) => drawPose(pose, viewport, holes)));
  if (layers.has("ellipse")) parts.push(...drawRing(overlay, viewport, holes));
  if (layers.has("lights")) parts.push(...overlay.extra.map((at) => drawExtra(at, viewport)));
  return [...parts, ...groups, ...drawCentres(overlay, viewport, layers), ...drawScale(overlay, viewport)];
}

function radiusOf(group, viewport) {
  return Math.max(LEAST_RADIUS_PX, group.radius * viewport.scale);
}

// What is left of a line through points of the stage outside of round holes (x, y, radius): pieces of it.
export function outside(points, holes) {
  const pieces = [];
  let isOpen = false; // whether the next part goes on where the last one ended
  points.slice(1).forEach((to, index) => {
    const from = points[index];
    const at = (share) => [0, 1].map((part) => from[part] + share * (to[part] - from[part]));
    const free = freeParts(from, to, holes);
    for (const [begin, end] of free) {
      if (begin === 0 && isOpen) pieces.at(-1).push(at(end));
      else pieces.push([at(begin), at(end)]);
    }
    isOpen = free.at(-1)?.[1] === 1;
  });
  return pieces;
}

// The shares of a straight line between which it is in no hole.
function freeParts(from, to, holes) {
  const [dx, dy] = [to[0] - from[0], to[1] - from[1]];
  const square = dx * dx + dy * dy;
  let free = square > 0 ? [[0, 1]] : [];
  for (const [x, y, radius] of holes) {
    const [ex, ey] = [from[0] - x, from[1] - y];
    const middle = -(ex * dx + ey * dy) / square;
    const half = middle * middle - (ex * ex + ey * ey - radius * radius) / square;
    if (half <= 0) continue;
    const [into, out] = [middle - Math.sqrt(half), middle + Math.sqrt(half)];
    free = free.flatMap(([begin, end]) => [[begin, Math.min(end, into)], [Math.max(begin, out), end]]).filter(([begin, end]) => end > begin);
  }
  return free;
}

// The path through points of the picture, but for the holes.
function path(points, viewport, holes, closed = false) {
  const places = [...points, ...(closed ? points.slice(0, 1) : [])].map((point) => viewport.toStage(point));
  const words = (piece) => `M${piece.map((place) => place.map((one) => one.toFixed(2)).join(" ")).join("L")}`;
  return outside(places, holes).map(words).join("");
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

function drawRing(overlay, viewport, holes) {
  return overlay.outline === null ? [] : [titled(line(path(overlay.outline, viewport, holes, true), "ellipse outline"), "fitted ellipse")];
}

// A light on the ring has a circle and its number, one set by hand a square; a group that was thrown out has a cross.
function drawGroup(group, viewport, shown, isByHand) {
  const [x, y] = viewport.toStage(group.at);
  const radius = radiusOf(group, viewport);
  const place = { class: "group", "data-x": group.at[0], "data-y": group.at[1], transform: `translate(${x} ${y})` };
  if (!group.onRing) {
    const r = 0.7 * radius;
    const cross = line(`M${-r} ${-r}L${r} ${r}M${-r} ${r}L${r} ${-r}`, "dropped");
    return titled(makeSvg("g", { ...place, "data-thrown-out": "" }, cross), "thrown out: not a light of the dock");
  }
  const around = (name) => isByHand
    ? makeSvg("rect", { x: -radius, y: -radius, width: 2 * radius, height: 2 * radius, class: name })
    : makeSvg("circle", { r: radius, class: name });
  const [edge, ring] = [around("edge"), around("line light")];
  const mark = makeSvg("g", { ...place, "data-light": group.label }, edge, ring);
  if (shown === "annotated") {
    const [dx, dy] = group.outward.map((one) => one * (radius + 11));
    mark.append(words(group.label, [dx, dy + 5]));
  }
  return titled(mark, isByHand ? `light ${group.label}, set by hand` : `light ${group.label} on the ring`);
}

// A lamp out of the ring's plane where it is seen, in a diamond.
function drawExtra(at, viewport) {
  const [x, y] = viewport.toStage(at);
  return titled(makeSvg("g", { "data-extra": "" }, line(`M${x - 12} ${y}L${x} ${y - 12}L${x + 12} ${y}L${x} ${y + 12}Z`, "light")), "extra lamp of the dock");
}

// A pose's dock: its outline, two diameters, and its normal with the pose's letter at the tip.
function drawPose(pose, viewport, holes) {
  const name = `pose-${pose.name.toLowerCase()}${pose.chosen ? " chosen" : ""}`;
  const isTruth = pose.name === "Truth"; // broad, and its name at the other side: it lies beneath the pose that is right
  const parts = pose.axes.map((ends) => line(path(ends, viewport, holes), `${name} thin`));
  parts.push(line(path(pose.outline, viewport, holes, true), name), line(path(pose.normal, viewport, holes), name));
  if (pose.normal.length === 2) {
    const [x, y] = viewport.toStage(pose.normal[1]);
    parts.push(makeSvg("circle", { cx: x, cy: y, r: 4, class: `line tip ${name}` }), isTruth ? words(pose.name, [x - 10, y + 5], "letter", "end") : words(pose.name, [x + 8, y + 5], "letter", "start"));
  }
  // Where this pose has lamps out of the ring's plane.
  for (const at of pose.extra) {
    const [x, y] = viewport.toStage(at);
    parts.push(line(`M${x - 6} ${y}H${x + 6}M${x} ${y - 6}V${y + 6}`, name));
  }
  const group = makeSvg("g", { "data-pose": pose.name, class: pose.chosen || isTruth ? "" : "other" }, ...parts);
  return titled(group, isTruth ? "dock as it is in truth" : `dock by pose ${pose.name}${pose.chosen ? ", chosen" : ""}`);
}

function drawCentres(overlay, viewport, layers) {
  const parts = [];
  if (overlay.ellipse !== null && layers.has("ellipse")) {
    const [x, y] = viewport.toStage(overlay.ellipse);
    const plus = line(`M${x - 7} ${y}H${x + 7}M${x} ${y - 7}V${y + 7}`, "ellipse");
    parts.push(titled(plus, "centre of the ellipse"));
  }
  if (overlay.centre !== null && overlay.poses.some((pose) => pose.chosen && layers.has(pose.name.toLowerCase()))) {
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

// A bar of a round length at the dock's distance; where the buttons leave room.
function drawScale(overlay, viewport) {
  if (overlay.scale === null) return [];
  const isNarrow = viewport.wide < 480;
  const [right, y] = [viewport.wide - (isNarrow ? 58 : 10), viewport.high - (isNarrow ? 48 : 10)];
  const left = right - overlay.scale.px * viewport.scale;
  if (left < 0) return [];
  return [line(`M${left} ${y}H${right}`, "scale"), words(`${overlay.scale.words} at the dock`, [right, y - 7], "", "end")];
}
