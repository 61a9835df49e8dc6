// What the program sends to our own elements, and what they send back; both over viser's connection, as its guard wants.
"use strict";

const newest = new Map(); // data by name
const listeners = new Map(); // functions by name
let channel = null; // id of the hidden text box whose value the program reads

// Call `listener` with the newest data of that name, now and whenever it changes. Returns a function that ends this.
export function follow(name, listener) {
  if (!listeners.has(name)) listeners.set(name, new Set());
  listeners.get(name).add(listener);
  if (newest.has(name)) listener(newest.get(name));
  return () => listeners.get(name).delete(listener);
}

// <dockpose-data name="...">JSON</dockpose-data>: viser makes a new one with each update.
class Data extends HTMLElement {
  connectedCallback() {
    const text = this.textContent;
    if (text === "") return; // moved to another place of the page
    this.textContent = "";
    const [name, data] = [this.getAttribute("name"), JSON.parse(text)];
    newest.set(name, data);
    for (const listener of [...(listeners.get(name) ?? [])]) listener(data);
  }
}

export function sendThrough(id) {
  channel = id;
}

// Tell the program what the operator did. It checks every value; a number tells two equal wishes apart.
export function send(wish) {
  const box = document.querySelector(`label[for="${channel}"]`)?.closest(".mantine-Flex-root")?.querySelector("input");
  if (!box) return;
  const set = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set; // React keeps its own
  set.call(box, JSON.stringify({ ...wish, number: Math.round(performance.timeOrigin + 1000 * performance.now()) }));
  box.dispatchEvent(new Event("input", { bubbles: true }));
}

// Make an element with attributes and children; in SVG where `space` says so.
const SVG = "http://www.w3.org/2000/svg";
export function make(tag, attributes = {}, ...children) {
  return filled(document.createElement(tag), attributes, children);
}
export function makeSvg(tag, attributes = {}, ...children) {
  return filled(document.createElementNS(SVG, tag), attributes, children);
}
function filled(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

customElements.define("dockpose-data", Data);
