// The comparison of the threshold methods: one large picture with what a method keeps and finds in it, its words and its
// level in the histogram, and beneath a row of them all, black and white; and what the page knows of being in that mode.
"use strict";
import { follow, make } from "./link.js";
import { request } from "./jobs.js";
import { outside } from "./overlay.js";

const ICONS = { right: "✓", wrong: "✕", found: "●" };
const WORKING = "Working: every method is tried on this picture…";
const MOST_CROSSES = 40; // of groups that are no lights: more would hide the pixels
const DIM = 0.45; // what the picture keeps of its brightness, beside the pixels that a method keeps
const ENLARGED = 2; // pixels of a canvas for one of the picture, so that lines are thin
const [HIGH, LETTERS] = [180, "26px system-ui, sans-serif"]; // of the histogram, in pixels of its canvas

class Compare extends HTMLElement {
  connectedCallback() {
    if (this.cards === undefined) this.build();
    this.sizes = new ResizeObserver(() => this.showMode());
    this.sizes.observe(this);
    this.ends = [follow("compare", (found) => this.take(found)), follow("compare-state", (state) => this.takeState(state))];
    this.showMode();
  }

  disconnectedCallback() {
    this.sizes.disconnect();
    for (const end of this.ends) end();
    this.showMode();
  }

  build() {
    [this.found, this.shown, this.state] = [null, null, { inUse: null, stepsIn: null, isOld: false }];
    const button = (words, act, look = {}) => {
      const made = make("button", { type: "button", ...look }, words);
      made.addEventListener("click", act);
      return made;
    };
    this.again = button("Compare again", () => this.ask(), { hidden: "" });
    this.note = make("p", { role: "note" }, WORKING);
    this.picture = make("canvas", { class: "large", role: "img" });
    this.told = make("div", { class: "told", "aria-live": "polite" });
    this.histogram = make("canvas", { class: "histogram", height: HIGH, "aria-hidden": "true" });
    this.cards = make("div", { class: "cards" });
    this.cards.addEventListener("keydown", (event) => this.key(event));
    const bar = make("div", { class: "bar" }, button("← Back to the picture", goBack, { title: "Key: Escape" }), this.again, this.note);
    this.append(bar, make("div", { class: "looked-at" }, this.picture, this.told), this.histogram, this.cards);
    this.toggleAttribute("data-empty", true);
  }

  // In this mode the comparison stands in the picture's place; it is tried at once what is not known yet.
  showMode() {
    const isOpen = this.isConnected && this.offsetParent !== null && this.clientWidth > 0;
    if (isOpen && this.shown !== null) this.drawHistogram(this.shown);
    const mode = isOpen ? "compare" : "picture";
    if (mode === this.mode) return;
    this.mode = document.documentElement.dataset.mode = mode;
    if (isOpen) setTimeout(() => this.ask()); // not while viser is still building the tab
  }

  ask() {
    if (this.state.isOld) this.note.textContent = WORKING;
    request({ do: "compare" });
  }

  take(found) {
    this.found = found;
    this.removeAttribute("data-empty");
    this.cards.replaceChildren(...found.methods.map((method) => this.card(method)));
    this.crop = new Image();
    this.crop.addEventListener("load", () => this.look(this.of(this.shown?.name) ?? this.of(this.state.inUse) ?? found.methods[0]));
    this.crop.src = `data:image/png;base64,${found.picture}`;
    this.takeState(this.state);
  }

  of(name) {
    return this.found?.methods.find((one) => one.name === name);
  }

  takeState(state) {
    this.state = state;
    this.again.hidden = this.found !== null && !state.isOld;
    this.toggleAttribute("data-old", state.isOld);
    this.note.id = state.isOld ? "outdated" : "";
    if (this.found !== null) {
      this.note.textContent = state.isOld
        ? `Outdated: these are the results for ${this.found.source}; the picture or the settings have changed since.`
        : `${this.found.source}. Point at a method, or press arrow keys, to look at it; Enter or Use takes it.`;
    }
    for (const card of this.cards.children) card.setAttribute("aria-pressed", String(card.dataset.method === state.inUse));
    if (this.shown !== null) this.tell(this.shown);
  }

  // One of the row: what it keeps in white, its rank and name, and what came of it.
  card(method) {
    const { width, height } = this.found;
    const kept = make("canvas", { class: "kept", width, height, "aria-hidden": "true" });
    const context = kept.getContext("2d");
    context.fillRect(0, 0, width, height);
    fillKept(context, method.kept, width, "#ffffff");
    const came = make("span", { class: `verdict ${method.kind}` }, `${ICONS[method.kind]} ${method.brief}`);
    const look = { type: "button", class: "card", "data-method": method.name, "data-kind": method.kind };
    const card = make("button", look, make("b", {}, method.label), kept, came, make("span", { class: "rank" }, `rank ${method.rank}`));
    for (const kind of ["pointerenter", "focus"]) card.addEventListener(kind, () => this.look(method));
    card.addEventListener("click", ({ pointerType }) => pointerType !== "touch" && use(method)); // fingers look first
    return card;
  }

  key(event) {
    const step = { ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[event.key];
    if (step === undefined) return;
    event.preventDefault();
    event.stopPropagation();
    const all = [...this.cards.children];
    all[Math.min(Math.max(all.indexOf(document.activeElement) + step, 0), all.length - 1)].focus();
  }

  // Show a method at full size.
  look(method) {
    if (method !== this.of(method.name)) return;
    this.shown = method;
    for (const card of this.cards.children) card.toggleAttribute("data-looked-at", card.dataset.method === method.name);
    this.draw(method);
    this.drawHistogram(method);
    this.tell(method);
  }

  // What it found; of the method in use that found nothing while another did, just that.
  tell(method) {
    const [isInUse, other] = [method.name === this.state.inUse, this.of(this.state.stepsIn)];
    const isTold = isInUse && other !== undefined && !this.state.isOld;
    const words = isTold ? `Found no dock by itself: ${other.label} stepped in, and its result is what is shown.` : method.verdict;
    const kind = isTold ? "found" : method.kind;
    const taking = make("button", { type: "button", class: "use", "aria-pressed": String(isInUse) }, isInUse ? "In use" : method === other ? "Steps in" : "Use");
    taking.addEventListener("click", () => use(method));
    const lines = [["Rank", String(method.rank)], ...method.lines].map(([name, value]) => make("div", {}, make("dt", {}, name), make("dd", {}, value)));
    const verdict = make("div", { class: `verdict ${kind}` }, make("span", { "aria-hidden": "true" }, `${ICONS[kind]} `), words);
    this.told.replaceChildren(make("div", { class: "title" }, make("b", {}, method.label), taking), verdict, make("div", { class: "lost" }, method.lost), make("dl", {}, ...lines));
  }

  // How many pixels have each level, by their logarithm, and what the method keeps of them.
  drawHistogram(method) {
    const heights = this.found.histogram;
    this.histogram.width = Math.max(2 * this.histogram.clientWidth, heights.length);
    const [context, step] = [this.histogram.getContext("2d"), this.histogram.width / heights.length];
    heights.forEach((height, level) => {
      context.fillStyle = method.level !== null && level >= method.level ? "#f0a030" : "#9aa4b0";
      context.fillRect(level * step, HIGH * (1 - height / 100), step + 0.5, (HIGH * height) / 100);
    });
    if (method.level === null) return;
    const isLow = method.level < heights.length / 2;
    Object.assign(context, { fillStyle: "#ffffff", font: LETTERS, textAlign: isLow ? "left" : "right" });
    context.fillRect(method.level * step, 0, 3, HIGH);
    context.fillText(`level ${method.level}`, method.level * step + (isLow ? 12 : -12), 28);
  }

  // The picture, dim, with the pixels that are kept; around them circles, and lines that stop at these.
  draw(method) {
    const { width, height } = this.found;
    Object.assign(this.picture, { width: ENLARGED * width, height: ENLARGED * height, ariaLabel: `what ${method.label} keeps and finds` });
    const context = this.picture.getContext("2d");
    const colour = (name) => getComputedStyle(this).getPropertyValue(`--${name}`).trim();
    context.scale(ENLARGED, ENLARGED);
    context.imageSmoothingEnabled = false;
    context.fillRect(0, 0, width, height);
    context.globalAlpha = DIM;
    context.drawImage(this.crop, 0, 0);
    context.globalAlpha = 1;
    fillKept(context, method.kept, width, colour("kept"));
    context.lineWidth = Math.max(1, width / 200);
    const least = Math.max(4, width / 50);
    const holes = method.groups.map(([x, y], number) => [x, y, Math.max(least, method.radii[number])]);
    const lights = holes.filter((_, number) => method.onRing[number]);
    const others = holes.filter((_, number) => !method.onRing[number]).map(([x, y, radius]) => [x, y, Math.min(radius, 2 * least)]);
    outline(context, method.dock, lights, colour("pose"));
    outline(context, method.ellipse, lights, colour("ellipse"));
    context.strokeStyle = colour("light");
    for (const [x, y, radius] of lights) {
      context.beginPath();
      context.arc(x, y, radius, 0, 2 * Math.PI);
      context.stroke();
    }
    context.strokeStyle = colour("dropped");
    context.beginPath();
    for (const [x, y, radius] of others.length > MOST_CROSSES ? [] : others) {
      for (const way of [-0.7 * radius, 0.7 * radius]) {
        context.moveTo(x + way, y - Math.abs(way));
        context.lineTo(x - way, y + Math.abs(way));
      }
    }
    context.stroke();
    Object.assign(this.picture.dataset, { drawn: String(method.groups.length), method: method.name });
  }
}

function fillKept(context, kept, width, colour) {
  context.fillStyle = colour;
  for (const [start, length] of kept) {
    for (let at = start; at < start + length;) {
      const run = Math.min(start + length - at, width - (at % width));
      context.fillRect(at % width, Math.floor(at / width), run, 1);
      at += run;
    }
  }
}

function outline(context, points, holes, colour) {
  if (points.length < 2) return;
  context.strokeStyle = colour;
  context.beginPath();
  for (const [first, ...rest] of outside([...points, points[0]], holes)) {
    context.moveTo(...first);
    for (const point of rest) context.lineTo(...point);
  }
  context.stroke();
}

const use = (method) => request({ do: "use", method: method.name });
function goBack() {
  viserPage.openTab(viserPage.tabOf("Picture"));
}
document.addEventListener("keydown", (event) => {
  if (event.key !== "Escape" || document.documentElement.dataset.mode !== "compare") return;
  if (!viserPage.hasDialog()) goBack();
});

document.documentElement.dataset.mode = "picture";
customElements.define("dockpose-compare", Compare);
