// One frame, one update: a picture, what was found in it and all words about it are shown at the same moment, once the
// picture is decoded. Of frames that come faster than they can be drawn, the newest is shown and the others are not.
"use strict";
import { follow, publish } from "./link.js";

const pages = new Map(); // the newest page for each picture that is still to come or shown, by the picture's serial
let [decoded, next, isDecoding] = [null, null, false];
let [isHidden, unhiding] = [false, null]; // the 3D view, and when it is shown again
const DRAWN_MS = 600; // it takes without a graphics card to draw what it was sent
let isDue = false; // when the browser draws next

// Decode the newest picture; those that come meanwhile wait, and of them only the newest is decoded.
async function decode(picture) {
  next = picture;
  if (isDecoding) return;
  isDecoding = true;
  while (next !== null) {
    const { data, ...taken } = next;
    next = null;
    const bitmap = new Image(); // from the text itself: a blob's bytes would wait behind all other messages
    bitmap.src = `data:${taken.type};base64,${data}`;
    const loaded = taken.isExact ? bitmap.decode() : new Promise((done, fail) => Object.assign(bitmap, { onload: done, onerror: fail }));
    await loaded.then(() => ready({ ...taken, bitmap }), (error) => console.error(error));
  }
  isDecoding = false;
}

function ready(picture) {
  decoded = picture;
  for (const serial of pages.keys()) if (serial < picture.serial) pages.delete(serial);
  if (pages.has(picture.serial)) showSoon();
}

function take(page) {
  if (decoded !== null && page.picture < decoded.serial) return;
  pages.set(page.picture, page);
  if (page.picture === decoded?.serial) showSoon();
}

// At once; while playing at most once for each time that the browser draws, for frames may come sooner than that.
function showSoon() {
  if (!pages.get(decoded.serial).isPlaying) show();
  else if (!isDue) {
    isDue = true;
    requestAnimationFrame(show);
  }
}

function show() {
  isDue = false;
  const page = pages.get(decoded.serial);
  if (page === undefined) return;
  publish("frame", { ...page, picture: decoded });
  if (page.hidesScene === isHidden) return;
  isHidden = page.hidesScene;
  clearTimeout(unhiding);
  unhiding = setTimeout(() => document.documentElement.toggleAttribute("data-hides-scene", isHidden), isHidden ? 0 : DRAWN_MS);
}

// What the program's answer had of the result goes in the moment in which the page has all of that itself.
function dropShell() {
  const isShown = (name) => document.querySelector(`dockpose-live[name=${name}]`)?.childElementCount > 0;
  if (isShown("strip") && isShown("candidates")) document.getElementById("shell")?.remove();
}

// <dockpose-live name="...">: words of a frame, as HTML that the program made and escaped.
class Live extends HTMLElement {
  connectedCallback() {
    this.end = follow("frame", ({ html }) => this.take(html[this.getAttribute("name")] ?? ""));
  }

  disconnectedCallback() {
    this.end();
  }

  take(html) {
    if (html === this.html) return;
    [this.html, this.innerHTML] = [html, html];
    dropShell();
  }
}

follow("picture", decode);
follow("page", take);
customElements.define("dockpose-live", Live);
