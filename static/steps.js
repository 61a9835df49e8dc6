// The steps of a first visit: a strip along the bottom that covers nothing, and a frame around what each is about. Once
// they are skipped or done, this browser shows them no more, but for who asks for them in the tab Settings.
"use strict";
import { follow, make } from "./link.js";

const SEEN = "dockpose steps";

class Steps extends HTMLElement {
  connectedCallback() {
    this.steps = JSON.parse(this.getAttribute("steps"));
    this.words = make("p", { "aria-live": "polite" });
    this.append(this.words, this.button("Back", () => this.show(this.at - 1)), this.button("Next", () => this.next()), this.button("Skip", () => this.end()));
    this.asked = (event) => event.target.closest?.("[data-steps-again]") && this.show(0);
    document.addEventListener("click", this.asked);
    if (localStorage.getItem(SEEN) !== null) return;
    const stop = follow("frame", () => setTimeout(() => { // when there is something to show, and the rest of the page has it
      stop();
      if (this.at === undefined) this.show(0);
    }));
  }

  disconnectedCallback() {
    document.removeEventListener("click", this.asked);
  }

  button(words, act) {
    const button = make("button", { type: "button" }, words);
    button.addEventListener("click", act);
    return button;
  }

  show(at) {
    this.at = at;
    const { tab, here, words } = this.steps[at];
    document.documentElement.toggleAttribute("data-steps", true);
    this.words.textContent = `${at + 1} of ${this.steps.length}: ${words}`;
    const [, back, next, skip] = this.children;
    [back.disabled, next.textContent, skip.hidden] = [at === 0, at + 1 < this.steps.length ? "Next" : "Done", at + 1 === this.steps.length];
    this.frame(here ? document.querySelector(here) : viserPage.tabOf(tab));
  }

  next() {
    if (this.at + 1 < this.steps.length) this.show(this.at + 1);
    else this.end();
  }

  end() {
    localStorage.setItem(SEEN, "seen");
    document.documentElement.removeAttribute("data-steps");
    this.frame(null);
  }

  frame(element) {
    for (const old of document.querySelectorAll("[data-step-here]")) old.removeAttribute("data-step-here");
    element?.toggleAttribute("data-step-here", true);
    element?.scrollIntoView({ block: "nearest" });
  }
}

customElements.define("dockpose-steps", Steps);
