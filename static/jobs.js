// The bar of main jobs, and the channel by which it and the other elements of the modes tell what is wished.
"use strict";
import { hideBoxBefore, make, sendTo } from "./link.js";

let channel = null; // id of the hidden text box that the program reads

// The box is there a moment after the page.
export function wish(what, tries = 50) {
  if (!sendTo(channel, what) && tries > 0) setTimeout(() => wish(what, tries - 1), 100);
}

class Jobs extends HTMLElement {
  connectedCallback() {
    channel = this.getAttribute("channel");
    hideBoxBefore(this);
    if (this.children.length > 0) return;
    this.append(
      this.button("Take (T)", "Log this frame: a row of the session, on the disk at once. Key: T.", () => wish({ do: "take" })),
      this.button("Play", "Open a video or a simulated course, and play it.", () => this.openPlay()),
      this.button("Everything as ZIP", "Save all that is known of this frame as one ZIP file.", () => wish({ do: "zip" })),
    );
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
