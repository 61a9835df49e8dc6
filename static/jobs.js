// The row beneath the strip, of a fixed height: the chips, what there is to say, and the main jobs; and the channel by
// which it and the other elements of the modes tell what is wished.
"use strict";
import { follow, hideBoxBefore, make, sendTo } from "./link.js";

let channel = null; // id of the hidden text box that the program reads

// The box is there a moment after the page.
export function wish(what, tries = 50) {
  if (!sendTo(channel, what) && tries > 0) setTimeout(() => wish(what, tries - 1), 100);
}

class Jobs extends HTMLElement {
  connectedCallback() {
    channel = this.getAttribute("channel");
    hideBoxBefore(this);
    if (this.chips === undefined) this.build();
    this.end = follow("frame", ({ chips }) => this.take(chips));
    requestAnimationFrame(() => this.fetchWords());
  }

  disconnectedCallback() {
    this.end();
  }

  build() {
    this.chips = make("div", { class: "chips" });
    this.words = make("div", { class: "words", tabindex: "0", title: "All of it is shown while the pointer or the focus is here." });
    this.append(
      this.chips, this.words,
      this.button("Take (T)", "Log this frame: a row of the session, on the disk at once. Key: T.", () => wish({ do: "take" })),
      this.button("Play", "Open a video or a simulated course, and play it.", () => this.openPlay()),
      this.button("Everything as ZIP", "Save all that is known of this frame as one ZIP file.", () => wish({ do: "zip" })),
      make("button", { type: "button", "data-pane": "scene", title: "Show the 3D view, or put it away." }, "3D"),
    );
    paneButton(this.lastElementChild);
  }

  // What there is to say comes with each frame, to a place of its own that stands before this one.
  fetchWords() {
    const words = document.querySelector("dockpose-live[name=status]");
    if (words !== null && words.parentElement !== this.words) this.words.append(words);
  }

  take(chips) {
    if (JSON.stringify(chips) === this.shown) return;
    this.shown = JSON.stringify(chips);
    this.chips.replaceChildren(...chips.map(([label, hint]) => {
      const chip = this.button(label, `${label}: ${hint}`, () => wish({ do: "chip", label }));
      chip.className = "chip";
      return chip;
    }));
  }

  button(words, hint, act) {
    const button = make("button", { type: "button", title: hint }, words);
    button.addEventListener("click", act);
    return button;
  }

  openPlay() {
    openPart("tools"); // on small screens
    if (document.documentElement.dataset.mode === "compare") viserPage.openTab(viserPage.tabOf("Picture"));
    viserPage.openTab(viserPage.tabOf("Play"));
  }
}

customElements.define("dockpose-jobs", Jobs);
