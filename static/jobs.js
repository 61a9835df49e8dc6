// The row beneath the strip, of a fixed height: the chips and the main jobs; and the channel by which it and the other
// elements of the modes tell what is asked for.
"use strict";
import { follow, hideBoxBefore, make, newNumber, sendTo } from "./link.js";

let channel = null; // id of the hidden text box that the program reads

// The box is there a moment after the page.
export function request(what, tries = 50) {
  if (!sendTo(channel, what) && tries > 0) setTimeout(() => request(what, tries - 1), 100);
}

// viser sends what is set last within 50 ms, so that of what is typed fast, as by a gauge, whole boxes may be lost, and a
// request as well. So Take sends the boxes' own text, until the program has heard of it, and so does a pause in typing. Take
// waits for what viser still has to send: coming later, that would undo what the program then sets.
const [SENT_MS, SETTLED_MS, AGAIN_MS, MOST_TRIES] = [60, 200, 250, 40];
const typed = new Map(); // by names of boxes their text, and the row that it was typed for
let [settling, typedAt] = [0, -SENT_MS];

// The boxes of the tab Log by their names, while it is open.
function boxes() {
  const ids = JSON.parse(document.querySelector("dockpose-measured")?.getAttribute("boxes") ?? "{}");
  return new Map(Object.entries(ids).map(([name, id]) => [name, viserPage.boxOf(id)]).filter(([, box]) => box));
}

function take() {
  clearTimeout(settling);
  typed.clear();
  const texts = Object.fromEntries([...boxes()].map(([name, box]) => [name, box.value]));
  const what = { do: "take", boxes: texts, number: newNumber() };
  let tries = 0;
  const send = () => {
    request(what);
    if ((tries += 1) < MOST_TRIES) timer = setTimeout(send, AGAIN_MS);
  };
  let timer = setTimeout(send, Math.max(0, typedAt + SENT_MS - performance.now()));
  const end = follow("page", ({ taken = [] }) => {
    if (!taken.includes(what.number)) return;
    clearTimeout(timer);
    end();
  });
}

// Not of the box in which somebody still types: what is on the way would come after what is typed next.
function settle() {
  clearTimeout(settling);
  settling = setTimeout(() => {
    const left = [...typed].filter(([name]) => boxes().get(name) !== document.activeElement);
    const target = left.at(-1)?.[1].target;
    const texts = left.filter(([, one]) => one.target === target).map(([name, { text }]) => [name, text]);
    if (texts.length > 0) request({ do: "typed", boxes: { target, ...Object.fromEntries(texts) } });
    for (const [name] of left) typed.delete(name);
  }, SETTLED_MS);
}
for (const kind of ["input", "focusout"]) {
  document.addEventListener(kind, (event) => {
    const found = [...boxes()].find(([, box]) => box === event.target);
    if (found === undefined || found[0] === "target") return;
    if (kind === "input") {
      typed.set(found[0], { text: event.target.value, target: boxes().get("target").value });
      typedAt = performance.now();
    }
    settle();
  }, true);
}

// T, and from within any box Ctrl+Enter, each in place of what viser would do.
document.addEventListener("keydown", (event) => {
  const isHeld = event.ctrlKey || event.metaKey;
  const isTyping = event.target.closest?.("input, textarea, select, [contenteditable]");
  const isKey = event.key.toLowerCase() === "t" && !isHeld && !event.altKey && !isTyping && !viserPage.hasDialog();
  if (!isKey && !(event.key === "Enter" && isHeld)) return;
  event.preventDefault();
  event.stopImmediatePropagation();
  if (!event.repeat) take();
}, true);

// A number is told whole, once its box is left, Enter pressed, or nothing typed for a while; who leaves it sees what is in force.
const PAUSE_MS = 1500;
let [pausing, toldNumber] = [0, ""];
function tellNumber(box, isLeft) {
  clearTimeout(pausing);
  const [text, inForce] = [box.value, box.getAttribute("value")];
  if (isLeft) viserPage.write(box, inForce);
  if (![inForce, toldNumber, ""].includes(text.trim())) request({ do: "number", of: viserPage.rowLabel(box).htmlFor, text });
  toldNumber = isLeft ? "" : text;
}
for (const kind of ["input", "change", "keydown"]) {
  document.addEventListener(kind, (event) => {
    if (!event.isTrusted || !viserPage.isForNumber(event.target)) return;
    if (kind !== "keydown") event.stopImmediatePropagation();
    if (kind === "change" || ["ArrowUp", "ArrowDown"].includes(event.key)) tellNumber(event.target, true);
    else if (kind === "input") [clearTimeout(pausing), pausing = setTimeout(tellNumber, PAUSE_MS, event.target, false)];
  }, true);
}

// Boxes that Enter acts on, once viser has sent what was typed there.
const ENTERED = { "New session": "session", "Save as": "tank" };
document.addEventListener("keydown", ({ key, target }) => {
  const act = key === "Enter" && target.matches("input") && ENTERED[viserPage.labelOf(target)];
  if (act) setTimeout(() => request({ do: act, name: target.value }), SETTLED_MS);
});

// Pictures that are sent together: the first of them is to be shown.
document.addEventListener("together", ({ detail }) => request({ do: "together", names: detail }));

// A double click on a slider sets it back to what the file has, once viser has sent where its clicks moved it.
document.addEventListener("dblclick", (event) => {
  const label = viserPage.sliderAround(event.target);
  if (label) setTimeout(() => request({ do: "given", label }), SETTLED_MS);
});

// A slider, or the histogram's line, that is let go: what is drawn next is undone by itself.
let isDrawn = false;
document.addEventListener("pointerdown", ({ target }) => {
  isDrawn = Boolean(viserPage.sliderAround(target) || target.closest?.(".grip"));
}, true);
document.addEventListener("pointerup", () => {
  if (isDrawn) setTimeout(() => request({ do: "moved" }), SETTLED_MS);
  isDrawn = false;
}, true);

// A picture of the board, which is dropped by a click, and taken back by another.
document.addEventListener("click", (event) => {
  const board = event.target.closest?.("[data-board]");
  if (board) request({ do: "board", name: board.dataset.board });
  const truth = event.target.closest?.("[data-truth]");
  if (truth) request({ do: "truth", what: truth.dataset.truth });
});

class Jobs extends HTMLElement {
  connectedCallback() {
    channel = this.getAttribute("channel");
    hideBoxBefore(this);
    if (this.chips === undefined) this.build();
    this.end = follow("frame", ({ chips }) => this.take(chips));
  }

  disconnectedCallback() {
    this.end();
  }

  build() {
    this.chips = make("div", { class: "chips" });
    this.append(
      this.chips,
      this.button("Take (T)", "Log this frame: a row of the session, on the disk at once. Key: T.", take),
      this.button("Play", "Play the first sequence that the tab Source offers. Key: K.", () => request({ do: "play" })),
      this.button("Everything as ZIP", "Save all that is known of this frame as one ZIP file.", () => request({ do: "zip" })),
    );
    this.sizes = new ResizeObserver(() => this.giveRoom());
    this.sizes.observe(this.chips);
  }

  // viser may make the strip anew, as while the page is built or when it connects again.
  watchStrip() {
    if (this.strip?.isConnected) return;
    this.strip = document.querySelector("dockpose-live[name=strip]");
    if (this.strip !== null) this.sizes.observe(this.strip);
  }

  take(chips) {
    this.watchStrip();
    if (JSON.stringify(chips) === this.shown) return;
    this.shown = JSON.stringify(chips);
    this.chips.replaceChildren(...chips.map(([label, hint, opens], at) => {
      const act = () => opens ? viserPage.openTab(viserPage.tabOf(opens)) : request({ do: "chip", label });
      const chip = this.button(label, `${label}: ${hint}`, act);
      chip.className = at === 0 && !label.endsWith("✕") ? "chip next" : "chip"; // what to do next stands out
      return chip;
    }));
  }

  // The strip is as high as its words; chips have lines of their own on small screens.
  giveRoom() {
    const height = this.chips.childElementCount > 0 ? `${this.chips.offsetHeight + 4}px` : "0px";
    document.documentElement.style.setProperty("--chips-height", height);
    if (this.strip?.offsetHeight > 0) document.documentElement.style.setProperty("--strip-height", `${this.strip.offsetHeight}px`);
  }

  button(words, hint, act) {
    const button = make("button", { type: "button", title: hint }, words);
    button.addEventListener("click", act);
    return button;
  }
}

customElements.define("dockpose-jobs", Jobs);
