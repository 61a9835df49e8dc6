// The comparison of the threshold methods: a card for each, and what the page knows of being in that mode.
"use strict";
import { follow, make } from "./link.js";
import { request } from "./jobs.js";
import { outside } from "./overlay.js";

const ICONS = { right: "✓", wrong: "✕", found: "●" };
const MOST_CROSSES = 40; // of groups that are no lights: more would hide the pixels
const DIM = 0.45; // what the crop keeps of its brightness, beside the pixels that a method keeps
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
    this.again.addEventListener("click", () => request({ do: "compare" }));
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
    document.documentElement.removeAttribute("data-shows-scene");
    if (isOpen) setTimeout(() => request({ do: "compare" })); // not while viser is still building the tab
  }

  take(found) {
    this.found = found;
    this.cards.replaceChildren(...found.methods.map((method) => this.card(method)));
    if (found.figure !== null) this.cards.append(this.figure(found.figure));
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
    for (const card of this.cards.querySelectorAll(".card")) {
      const isInUse = card.dataset.method === state.inUse;
      card.setAttribute("aria-pressed", String(isInUse));
      const other = card.dataset.method === state.stepsIn ? "Steps in" : "Use";
      card.querySelector(".use").textContent = isInUse ? "In use" : other;
      this.tellVerdict(card, isInUse && state.stepsIn !== null);
    }
  }

  // What a card found; of the method in use that found nothing while another did, just that.
  tellVerdict(card, isStandIn) {
    const method = this.found.methods.find((one) => one.name === card.dataset.method);
    const other = this.found.methods.find((one) => one.name === this.state.stepsIn);
    const isTold = isStandIn && other !== undefined && !this.state.isOld;
    const words = isTold ? `Found no dock by itself: ${other.label} stepped in, and its result is what is shown.` : method.verdict;
    const kind = isTold ? "found" : method.kind;
    const verdict = card.querySelector(".verdict");
    verdict.className = `verdict ${kind}`;
    verdict.replaceChildren(make("span", { "aria-hidden": "true" }, `${ICONS[kind]} `), words);
  }

  card(method) {
    const canvas = make("canvas", { width: ENLARGED * this.found.width, height: ENLARGED * this.found.height });
    canvas.setAttribute("aria-hidden", "true");
    const title = make("div", { class: "title" }, make("b", {}, method.label), make("span", { class: "use" }, "Use"));
    const verdict = make("div", { class: "verdict" });
    const lost = make("div", { class: "lost" }, method.lost);
    const lines = method.lines.map(([name, value]) => make("div", {}, make("dt", {}, name), make("dd", {}, value)));
    const look = { type: "button", class: "card", "data-method": method.name, "data-kind": method.kind };
    const card = make("button", look, title, canvas, verdict, this.histogram(method), lost, make("dl", {}, ...lines));
    card.addEventListener("click", () => this.use(method));
    return card;
  }

  // Take a method; its docks are shown in 3D from now on, beside the cards.
  use(method) {
    request({ do: "use", method: method.name });
    document.documentElement.toggleAttribute("data-shows-scene", true);
    viserPage.sceneBox().scrollIntoView({ block: "nearest" });
  }

  // What the report on the paper has of its Figure 15 for this scene.
  figure(rows) {
    const row = (kind, cells) => make("tr", {}, ...cells.map((cell) => make(kind, {}, String(cell))));
    const body = rows.map(([name, level, groups, isRight]) => row("td", [name, level, groups, isRight ? "✓ right" : "✕ not right"]));
    const words = "The paper's Figure 15 binarises a scene like this by these five and gives no numbers; these are our report's.";
    return make("table", { class: "figure-15" }, make("caption", {}, words), row("th", ["Method", "Level", "Groups", "Pose"]), ...body);
  }

  // How many pixels have each level, by their logarithm, and what the method keeps of them.
  histogram(method) {
    const heights = this.found.histogram;
    const canvas = make("canvas", { class: "histogram", width: heights.length, height: 100, "aria-hidden": "true" });
    const context = canvas.getContext("2d");
    heights.forEach((height, level) => {
      context.fillStyle = method.level !== null && level >= method.level ? "#f0a030" : "#9aa4b0";
      context.fillRect(level, 100 - height, 1, height);
    });
    context.fillStyle = "#ffffff";
    if (method.level !== null) context.fillRect(method.level, 0, 1, 100);
    return canvas;
  }

  // The crop, dim, with the pixels that are kept; around them circles, and lines that stop at these.
  draw(crop, method, index) {
    const canvas = this.cards.children[index]?.querySelector("canvas");
    if (!canvas || this.found.methods[index] !== method) return;
    const context = canvas.getContext("2d");
    const { width, height } = this.found;
    const colour = (name) => getComputedStyle(this).getPropertyValue(`--${name}`).trim();
    context.scale(ENLARGED, ENLARGED);
    context.imageSmoothingEnabled = false;
    context.fillRect(0, 0, width, height);
    context.globalAlpha = DIM;
    context.drawImage(crop, 0, 0);
    context.globalAlpha = 1;
    context.fillStyle = colour("kept");
    for (const [start, length] of method.kept) {
      for (let at = start; at < start + length;) {
        const run = Math.min(start + length - at, width - (at % width));
        context.fillRect(at % width, Math.floor(at / width), run, 1);
        at += run;
      }
    }
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
    canvas.dataset.drawn = String(method.groups.length);
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

function goBack() {
  viserPage.openTab(viserPage.tabOf("Picture"));
}
document.addEventListener("keydown", (event) => {
  if (event.key !== "Escape" || document.documentElement.dataset.mode !== "compare") return;
  if (!viserPage.hasDialog()) goBack();
});

document.documentElement.dataset.mode = "picture";
customElements.define("dockpose-compare", Compare);
