// The comparison of the threshold methods: a card for each, and what the page knows of being in that mode.
"use strict";
import { follow, make } from "./link.js";
import { wish } from "./jobs.js";

const ICONS = { right: "✓", wrong: "✕", found: "●" };
const ENLARGED = 2; // pixels of a canvas for one of the crop, so that lines are thin

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
    [this.found, this.state] = [null, { inUse: null, stepsIn: null, isOld: false }];
    const back = make("button", { type: "button", title: "Key: Escape" }, "← Back to the picture");
    back.addEventListener("click", goBack);
    this.again = make("button", { type: "button", hidden: "" }, "Compare again");
    this.again.addEventListener("click", () => wish({ do: "compare" }));
    this.note = make("p", { role: "note" }, "Every method is tried on this picture, as soon as this tab is opened.");
    this.cards = make("div", { class: "cards" });
    this.append(make("div", { class: "bar" }, back, this.again, this.note), this.cards);
  }

  // In this mode the comparison has the page to itself; it is tried at once what is not known yet.
  showMode() {
    const isOpen = this.isConnected && this.offsetParent !== null && this.clientWidth > 0;
    const mode = isOpen ? "compare" : "picture";
    if (mode === this.mode) return;
    this.mode = document.documentElement.dataset.mode = mode;
    if (isOpen) setTimeout(() => wish({ do: "compare" })); // not while viser is still building the tab
  }

  take(found) {
    this.found = found;
    this.cards.replaceChildren(...found.methods.map((method) => this.card(method)));
    const crop = new Image();
    crop.addEventListener("load", () => found.methods.forEach((method, index) => this.draw(crop, method, index)));
    crop.src = `data:image/png;base64,${found.picture}`;
    this.takeState(this.state);
  }

  takeState(state) {
    this.state = state;
    this.again.hidden = this.found !== null && !state.isOld;
    this.cards.toggleAttribute("data-old", state.isOld);
    this.note.id = state.isOld ? "outdated" : "";
    if (this.found !== null) {
      this.note.textContent = state.isOld
        ? `Outdated: these are the results for ${this.found.source}; the picture or the settings have changed since.`
        : `${this.found.source}. Click a method, or press Enter on it, to use it.`;
    }
    for (const card of this.cards.children) {
      const isInUse = card.dataset.method === state.inUse;
      card.setAttribute("aria-pressed", String(isInUse));
      const other = card.dataset.method === state.stepsIn ? "Steps in" : "Use";
      card.querySelector(".use").textContent = isInUse ? "In use" : other;
    }
  }

  card(method) {
    const canvas = make("canvas", { width: ENLARGED * this.found.width, height: ENLARGED * this.found.height });
    canvas.setAttribute("aria-hidden", "true");
    const title = make("div", { class: "title" }, make("b", {}, method.label), make("span", { class: "use" }, "Use"));
    const icon = make("span", { "aria-hidden": "true" }, `${ICONS[method.kind]} `);
    const verdict = make("div", { class: `verdict ${method.kind}` }, icon, method.verdict);
    const lines = method.lines.map(([name, value]) => make("div", {}, make("dt", {}, name), make("dd", {}, value)));
    const look = { type: "button", class: "card", "data-method": method.name, "data-kind": method.kind };
    const card = make("button", look, title, canvas, verdict, make("dl", {}, ...lines));
    card.addEventListener("click", () => wish({ do: "use", method: method.name }));
    return card;
  }

  // The crop, with the pixels that are kept, the ellipse, the dock by the chosen pose, and the groups.
  draw(crop, method, index) {
    const canvas = this.cards.children[index]?.querySelector("canvas");
    if (!canvas || this.found.methods[index] !== method) return;
    const context = canvas.getContext("2d");
    const { width } = this.found;
    const colour = (name) => getComputedStyle(this).getPropertyValue(`--${name}`).trim();
    context.scale(ENLARGED, ENLARGED);
    context.imageSmoothingEnabled = false;
    context.drawImage(crop, 0, 0);
    context.fillStyle = colour("kept");
    context.globalAlpha = 0.55;
    for (const [start, length] of method.kept) {
      for (let at = start; at < start + length;) {
        const run = Math.min(start + length - at, width - (at % width));
        context.fillRect(at % width, Math.floor(at / width), run, 1);
        at += run;
      }
    }
    context.globalAlpha = 1;
    context.lineWidth = Math.max(1, width / 130);
    outline(context, method.ellipse, colour("ellipse"));
    outline(context, method.dock, colour("pose"));
    const size = Math.max(4, width / 40);
    method.groups.forEach(([x, y], number) => {
      const isLight = method.onRing[number];
      context.strokeStyle = colour(isLight ? "light" : "dropped");
      context.beginPath();
      if (isLight) context.arc(x, y, size, 0, 2 * Math.PI);
      else for (const [a, b] of [[-1, -1], [-1, 1]]) {
        context.moveTo(x + 0.7 * a * size, y + 0.7 * b * size);
        context.lineTo(x - 0.7 * a * size, y - 0.7 * b * size);
      }
      context.stroke();
    });
    canvas.dataset.drawn = String(method.groups.length);
  }
}

function outline(context, points, colour) {
  if (points.length < 2) return;
  context.strokeStyle = colour;
  context.beginPath();
  points.forEach(([x, y], index) => (index === 0 ? context.moveTo(x, y) : context.lineTo(x, y)));
  context.closePath();
  context.stroke();
}

function goBack() {
  viserPage.openTab(viserPage.tabOf("Picture"));
}
document.addEventListener("keydown", (event) => {
  if (event.key !== "Escape" || document.documentElement.dataset.mode !== "compare") return;
  if (!viserPage.hasDialog()) goBack();
});

document.documentElement.dataset.mode = "picture";
customElements.define("dockpose-compare", Compare);
