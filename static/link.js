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

export function publish(name, data) {
  newest.set(name, data);
  for (const listener of [...(listeners.get(name) ?? [])]) listener(data);
}

// <dockpose-data name="...">JSON</dockpose-data>: viser makes a new one with each update.
class Data extends HTMLElement {
  connectedCallback() {
    viserPage.boxAround(this).hidden = true; // CSS that asks what is in a box would be asked again with every frame
    const text = this.textContent;
    if (text === "") return; // moved to another place of the page
    this.textContent = "";
    publish(this.getAttribute("name"), JSON.parse(text));
  }
}

// Hide what viser has before an element: the text box through which it talks to the program.
export function hideBoxBefore(element) {
  viserPage.boxBefore(element).hidden = true;
}

// <dockpose-name-next name="..." count="...">: gives what viser has after it, one or so many, a class of that name; of 0,
// what is around it.
class NameNext extends HTMLElement {
  connectedCallback() {
    const [name, count] = [this.getAttribute("name"), Number(this.getAttribute("count") ?? 1)];
    viserPage.boxAround(this).hidden = true;
    requestAnimationFrame(() => (count > 0 ? viserPage.boxesAfter(this, count) : [viserPage.boxAround(this).parentElement]).forEach((box, at) => {
      box.classList.add(name);
      box.style.setProperty("--at", at);
    }));
  }
}

export function sendThrough(id) {
  channel = id;
}

// Tell the program what the operator did. It checks every value; a number tells two equal requests apart.
export function send(request) {
  sendTo(channel, request);
}

// The same through another box; says whether there was one.
export function sendTo(id, request) {
  const box = viserPage.boxOf(id);
  if (!box) return false;
  const text = JSON.stringify({ number: newNumber(), ...request });
  viserPage.type(box, text === box.value ? `${text} ` : text); // what is typed again as it is changes nothing
  return true;
}

export function newNumber() {
  return Math.round(performance.timeOrigin + 1000 * performance.now());
}

// Make an element with attributes and children; makeSvg makes one of SVG.
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
customElements.define("dockpose-name-next", NameNext);
