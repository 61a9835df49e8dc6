// Lights that somebody sets by hand in the picture: a click adds one where the program sees a bright spot, a click on one
// takes it away, a drag or the arrow keys move it. All are told at once, so that what is clicked fast is never lost.
"use strict";
import { make, makeSvg, newNumber, send } from "./link.js";

const CLICK_PX = 4; // a press that moves less is a click
const TOUCH_PX = 14; // how near on the screen a light is touched, at least
const [STEP_PX, LARGE_STEP_PX] = [0.1, 1]; // of the arrow keys, in pixels of the picture
const [AGAIN_MS, MOST_TRIES] = [250, 40]; // until the program has heard of what was set last
const SPOT_MS = 60; // between questions for the spot under the pointer
const [LOUPE_PX, LOUPE_SIDE] = [17, 136]; // of the picture, and of the screen

export class Hand {
  constructor(view) {
    this.view = view;
    [this.lights, this.pending, this.chosen, this.held, this.spot, this.aim] = [null, null, null, null, null, null];
    this.loupe = make("canvas", { class: "loupe", width: LOUPE_SIDE, height: LOUPE_SIDE, "aria-hidden": "true", hidden: "" });
  }

  begin() {
    send({ do: "hold" }); // lights are set in the picture that is seen
    this.end();
  }

  end() {
    [this.chosen, this.held, this.spot] = [null, null, null];
    this.loupe.hidden = true;
  }

  // What holds now: as it was told last, as the program has it, or the search's lights.
  list() {
    if (this.pending !== null) return this.lights;
    const { byHand, groups } = this.view.overlay;
    if (byHand === null) return groups.filter((group) => group.onRing).map(({ at, radius }) => ({ at, snap: true, seen: at, radius }));
    const snapped = (index) => (Array.isArray(byHand.snap) ? byHand.snap[index] : byHand.snap);
    return byHand.lights_px.map((at, index) => ({ at, snap: snapped(index), seen: groups[index]?.at ?? at, radius: groups[index]?.radius ?? 0 }));
  }

  // Tell all lights, again until the program has heard of them; null: those of the search.
  tell(lights, goesOn = false) {
    clearTimeout(this.timer);
    [this.lights, this.pending] = [lights ?? [], newNumber()];
    if (lights === null) this.chosen = null;
    const told = { at: lights?.map(({ at }) => at) ?? null, snap: lights?.map(({ snap }) => snap) ?? [] };
    const request = { do: "lights", number: this.pending, picture: this.view.picture.serial, ...told, goesOn };
    let tries = 0;
    const again = () => {
      if (this.pending === null) return;
      if (tries === MOST_TRIES) this.pending = null;
      else send(request);
      tries += 1;
      this.timer = setTimeout(again, AGAIN_MS);
    };
    again();
    this.view.drawDraft();
  }

  // A new frame: from the program's answer on, what it has holds.
  take(heard = []) {
    if (heard.includes(this.pending)) {
      clearTimeout(this.timer);
      this.pending = null;
    }
    if (this.chosen >= this.list().length) this.chosen = null;
  }

  // The light that a point of the stage touches.
  touched([x, y]) {
    const { viewport } = this.view;
    const away = this.list().map(({ seen, radius }) => {
      const [sx, sy] = viewport.toStage(seen);
      return Math.hypot(sx - x, sy - y) / Math.max(TOUCH_PX, radius * viewport.scale);
    });
    const nearest = away.indexOf(Math.min(...away));
    return away[nearest] <= 1 ? nearest : null;
  }

  press(place) {
    this.held = { from: place, light: this.touched(place), isMoved: false };
    this.look(place);
  }

  move(place) {
    const { held, view } = this;
    if (held !== null && !held.isMoved) held.isMoved = Math.hypot(place[0] - held.from[0], place[1] - held.from[1]) >= CLICK_PX;
    if (held?.isMoved && held.light === null) {
      view.viewport.pan(place[0] - held.from[0], place[1] - held.from[1]);
      held.from = place;
      view.draw();
    } else if (held?.isMoved) held.at = view.viewport.toPicture(place);
    this.look(place);
  }

  // A click with Shift is where it is, any other at the spot there; so is what was dragged.
  release(place, isExact) {
    const { held } = this;
    this.held = null;
    if (held === null || (held.isMoved && held.light === null)) return;
    const [lights, at] = [this.list(), this.view.viewport.toPicture(place)];
    if (held.light === null) this.add(at, isExact);
    else if (held.isMoved) this.put(held.light, at, !isExact);
    else this.tell(lights.filter((_, index) => index !== held.light));
    if (held.light !== null && !held.isMoved) this.chosen = null;
    this.look(place);
  }

  add(at, isExact) {
    const { width, height } = this.view.viewport;
    if (!(at[0] >= -0.5 && at[1] >= -0.5 && at[0] < width - 0.5 && at[1] < height - 0.5)) return;
    const lights = this.list();
    this.chosen = lights.length;
    this.tell([...lights, { at, snap: !isExact, seen: at, radius: 0 }]);
  }

  put(light, at, snap, goesOn = false) {
    this.chosen = light;
    this.tell(this.list().map((one, index) => (index === light ? { ...one, at, snap, seen: at } : one)), goesOn);
  }

  // Keys of a light that is chosen; says whether it was one.
  key(event, arrow) {
    if (this.chosen === null) return false;
    const light = this.list()[this.chosen];
    if (arrow) {
      const step = event.shiftKey ? LARGE_STEP_PX : STEP_PX;
      this.put(this.chosen, light.seen.map((one, axis) => one + step * arrow[axis]), false, true);
    } else if (event.key === "Delete" || event.key === "Backspace") {
      this.tell(this.list().filter((_, index) => index !== this.chosen));
      this.chosen = null;
    } else if (event.key === "Escape") this.chosen = null;
    else return false;
    this.view.drawDraft();
    return true;
  }

  // Enter, where the cursor is: takes hold of the light there, or adds one.
  enter(at, isExact) {
    const light = this.touched(this.view.viewport.toStage(at));
    if (light === null) this.add(at, isExact);
    else this.chosen = light;
  }

  // Aim: the pixels around, enlarged, and the spot there, which the program is asked for.
  look(place) {
    const at = this.view.viewport.toPicture(place);
    this.aim = at;
    this.showLoupe(place, at);
    this.view.drawDraft();
    if (this.pending !== null || this.asking) return; // what is asked now would overtake what was set
    this.asking = setTimeout(() => {
      this.asking = 0;
      if (this.pending === null && this.aim !== null) send({ do: "spot", picture: this.view.picture.serial, at: this.aim });
    }, SPOT_MS);
  }

  leave() {
    [this.aim, this.spot, this.loupe.hidden] = [null, null, true];
    this.view.drawDraft();
  }

  takeSpot(spot) {
    this.spot = spot;
    this.view.drawDraft();
  }

  showLoupe([x, y], at) {
    const { view, loupe } = this;
    const { bitmap } = view.picture;
    const step = view.viewport.width / bitmap.width; // a very large picture is sent smaller
    const [middle, side, context] = [at.map((one) => (one + 0.5) / step), LOUPE_PX / step, loupe.getContext("2d")];
    context.imageSmoothingEnabled = false;
    context.fillRect(0, 0, LOUPE_SIDE, LOUPE_SIDE);
    context.drawImage(bitmap, middle[0] - side / 2, middle[1] - side / 2, side, side, 0, 0, LOUPE_SIDE, LOUPE_SIDE);
    context.strokeStyle = "#ffff00";
    context.strokeRect(LOUPE_SIDE / 2 - 8, LOUPE_SIDE / 2 - 8, 16, 16);
    loupe.toggleAttribute("data-left", x > view.viewport.wide / 2 && y > view.viewport.high / 2);
    loupe.hidden = false;
  }

  // As SVG: the spot under the pointer, what was told and is not drawn yet, what is dragged, and the chosen one.
  draft() {
    const { viewport } = this.view;
    const square = (at, half, name) => {
      const [x, y] = viewport.toStage(at);
      return makeSvg("rect", { x: x - half, y: y - half, width: 2 * half, height: 2 * half, class: name });
    };
    const parts = [];
    if (this.spot !== null && this.aim !== null && this.held === null && this.pending === null) {
      const half = Math.max(8, 1.6 * this.spot.radius * viewport.scale);
      if (this.touched(viewport.toStage(this.spot.at)) === null) parts.push(square(this.spot.at, half, "spot"));
    }
    if (this.pending !== null) parts.push(...this.lights.filter(({ radius }) => radius === 0).map(({ seen }) => square(seen, 8, "spot told")));
    if (this.held?.at) parts.push(square(this.held.at, 8, "spot"));
    const chosen = this.chosen === null ? undefined : this.list()[this.chosen];
    if (chosen !== undefined) parts.push(square(chosen.seen, Math.max(12, chosen.radius * viewport.scale + 5), "chosen-light"));
    return parts;
  }
}
