// The picture's own pixels: their grey, which of them the threshold keeps, and how they are painted.
"use strict";

const SHARE = 0.002; // of the pixels, at either end, that a stretch of the contrast makes black or white

// Grey of each pixel, by the weights and the rounding of OpenCV, which the program uses.
export function greyOf(canvas) {
  const { data } = canvas.getContext("2d").getImageData(0, 0, canvas.width, canvas.height);
  const grey = new Uint8Array(data.length / 4);
  for (let index = 0, at = 0; index < grey.length; index += 1, at += 4) {
    grey[index] = (data[at] * 9798 + data[at + 1] * 19235 + data[at + 2] * 3735 + 16384) >> 15;
  }
  return grey;
}

// Which pixels the threshold keeps: those listed where each light has a level of its own, else by the one level.
export function keptPixels(grey, width, overlay) {
  const kept = new Uint8Array(grey.length);
  if (overlay.kept !== null) {
    for (const [start, length] of overlay.kept) kept.fill(1, start, start + length);
    return kept;
  }
  for (let index = 0; index < grey.length; index += 1) kept[index] = grey[index] >= overlay.level ? 1 : 0;
  const height = grey.length / width;
  for (const [left, top, wide, high] of overlay.masks) {
    const [x0, x1] = span(left, wide, width);
    const [y0, y1] = span(top, high, height);
    for (let y = y0; y < y1; y += 1) kept.fill(0, y * width + x0, y * width + x1);
  }
  return kept;
}

// First and one past the last pixel whose centre lies in a mask.
function span(start, length, size) {
  const clip = (one) => Math.min(Math.max(Math.ceil(one), 0), size);
  return [clip(start), clip(start + length)];
}

// Paint the pixels that are kept, in the colours of what became of their groups.
export function paintKept(canvas, kept, overlay, colours) {
  const [context, { width }] = [canvas.getContext("2d"), canvas];
  const image = context.createImageData(width, canvas.height);
  const pixels = new Uint32Array(image.data.buffer);
  const [black, small, light, dropped] = ["#000000", colours.small, colours.light, colours.dropped].map(packed);
  for (let index = 0; index < pixels.length; index += 1) pixels[index] = kept[index] ? small : black;
  const inOrder = [...overlay.groups].sort((one, other) => one.onRing - other.onRing); // a light stays a light
  for (const { box: [left, top, right, bottom], onRing } of inOrder) {
    for (let y = top; y <= bottom; y += 1) {
      for (let x = left; x <= right; x += 1) if (kept[y * width + x]) pixels[y * width + x] = onRing ? light : dropped;
    }
  }
  context.putImageData(image, 0, 0);
}

// Stretch the contrast in place: the darkest pixels become black, the brightest white.
export function stretch(canvas, grey) {
  const counts = new Uint32Array(256);
  for (const level of grey) counts[level] += 1;
  const least = SHARE * grey.length;
  let [low, high] = [0, 255];
  for (let sum = counts[0]; sum < least && low < 254; sum += counts[low]) low += 1;
  for (let sum = counts[255]; sum < least && high > low + 1; sum += counts[high]) high -= 1;
  const context = canvas.getContext("2d");
  const image = context.getImageData(0, 0, canvas.width, canvas.height);
  const table = Uint8ClampedArray.from({ length: 256 }, (_, level) => (255 * (level - low)) / (high - low));
  for (let at = 0; at < image.data.length; at += 4) {
    for (let part = at; part < at + 3; part += 1) image.data[part] = table[image.data[part]];
  }
  context.putImageData(image, 0, 0);
}

// A colour as canvases keep it: alpha, blue, green and red from the top byte down.
function packed(colour) {
  const [red, green, blue] = [1, 3, 5].map((at) => parseInt(colour.slice(at, at + 2), 16));
  return ((255 << 24) | (blue << 16) | (green << 8) | red) >>> 0;
}
