// Where the picture lies on its stage. A picture's pixel (0, 0) covers the square from (0, 0) to (1, 1) of its surface,
// so that the pixel's centre, which is what the program counts from, is at (0.5, 0.5) there.
"use strict";

const LEAST_SEEN_PX = 40; // of the picture, at any edge of the stage
const MOST = 64; // screen pixels in a pixel of the picture

export class Viewport {
  constructor() {
    [this.scale, this.left, this.top] = [1, 0, 0];
    [this.width, this.height] = [1, 1]; // of the picture, in its pixels
    [this.wide, this.high] = [1, 1]; // of the stage, in screen pixels
    this.fits = true; // until someone zooms
  }

  // From a point of the picture, in the program's pixels, to one of the stage; and back.
  toStage([x, y]) {
    return [this.left + (x + 0.5) * this.scale, this.top + (y + 0.5) * this.scale];
  }
  toPicture([x, y]) {
    return [(x - this.left) / this.scale - 0.5, (y - this.top) / this.scale - 0.5];
  }

  setPicture(width, height) {
    if (width === this.width && height === this.height) return;
    [this.width, this.height] = [width, height];
    this.fit();
  }
  setStage(wide, high) {
    const [x, y] = [this.wide / 2 - this.left, this.high / 2 - this.top];
    [this.wide, this.high] = [wide, high];
    if (this.fits) this.fit();
    else [this.left, this.top] = [wide / 2 - x, high / 2 - y];
  }

  fit() {
    this.scale = Math.min(this.wide / this.width, this.high / this.height, MOST);
    [this.left, this.top] = [(this.wide - this.width * this.scale) / 2, (this.high - this.height * this.scale) / 2];
    this.fits = true;
  }

  // Zoom by a factor about a point of the stage, which stays where it is.
  zoom(factor, [x, y] = [this.wide / 2, this.high / 2]) {
    const least = 0.5 * Math.min(this.wide / this.width, this.high / this.height);
    const scale = Math.min(Math.max(this.scale * factor, least), MOST);
    this.left = x - ((x - this.left) * scale) / this.scale;
    this.top = y - ((y - this.top) * scale) / this.scale;
    this.scale = scale;
    this.pan(0, 0);
  }

  pan(dx, dy) {
    const [width, height] = [this.width * this.scale, this.height * this.scale];
    this.left = Math.min(Math.max(this.left + dx, LEAST_SEEN_PX - width), this.wide - LEAST_SEEN_PX);
    this.top = Math.min(Math.max(this.top + dy, LEAST_SEEN_PX - height), this.high - LEAST_SEEN_PX);
    this.fits = false;
  }
}
