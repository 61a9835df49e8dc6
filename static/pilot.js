// The pilot view: large figures, a cross and a corridor, for the far end of the tank. It asks for the newest numbers over
// and over, so it needs nothing of the page of the operator, and is back by itself after an outage.
"use strict";

const [ASK_EVERY_MS, AGAIN_MS, PATIENCE_MS, STALE_S] = [100, 500, 3000, 2];
const CROSS_DEG = 15; // from the middle of the cross to its ends
const WORDS_PX = 124; // at the left of a corridor
const LENGTHS_M = [0.5, 1, 2, 5, 10, 20, 50]; // of the corridor
const SHAPES = { // of the trust, so that it is never told by colour alone
  green: "M4 19 14 29 32 7",
  amber: "M18 4 33 31H3ZM18 14V22M18 26V27",
  red: "M6 6 30 30M30 6 6 30",
  grey: "M18 3A15 15 0 1 1 17.9 3ZM18 9V18L24 22",
};
const find = (selector) => document.querySelector(selector);
let [now, cameAtMs, fault] = [null, 0, ""];

async function ask() {
  let wait = ASK_EVERY_MS;
  try {
    const answer = await fetch("/pilot.json", { cache: "no-store", signal: AbortSignal.timeout(PATIENCE_MS) });
    if (answer.ok) {
      const told = await answer.json();
      [now, cameAtMs, fault] = [told?.trust ? told : null, performance.now(), ""]; // there may be no picture yet
    } else fault = "dockpose was started anew: open the address that it printed";
  } catch {
    [fault, wait] = ["No connection to dockpose", AGAIN_MS];
  }
  setTimeout(ask, wait);
}

function svg(tag, attributes, words = "") {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.textContent = words;
  return element;
}

function show() {
  const ageS = now === null ? 0 : now.ageS + (performance.now() - cameAtMs) / 1000;
  const isOld = now !== null && (fault !== "" || now.isLive) && ageS > STALE_S;
  const told = fault && (now === null || isOld) ? fault : isOld ? `No new picture for ${Math.floor(ageS)} s` : now?.verdict;
  const trust = now === null || isOld || fault ? "grey" : now.trust;
  const box = find("#trust");
  if (box.dataset.trust !== trust) find("#trust path").setAttribute("d", SHAPES[trust]);
  box.dataset.trust = trust;
  document.body.toggleAttribute("data-old", trust === "grey");
  find("#trust span").textContent = told ?? "Waiting for a picture";
  if (now === null) return;
  find("#age").textContent = `${now.isLive ? `Picture ${ageS.toFixed(1)} s old` : "Not live"} · ${now.source}`;
  find("#reason").textContent = now.reason;
  find("#target").textContent = now.target ?? ""; // where the figures lead, if not to the dock's ring
  for (const label of document.querySelectorAll("[data-angle]")) label.textContent = `${label.dataset.angle}${now.target ? " off" : ""}`;
  for (const figure of document.querySelectorAll("[data-figure]")) {
    const words = now.figures?.[figure.dataset.figure] ?? "–";
    const isPlace = figure.nextElementSibling !== null;
    const [, number, way] = (isPlace && words.match(/^(.*) (\S+)$/)) || [null, words, ""];
    figure.textContent = number;
    if (isPlace) figure.nextElementSibling.textContent = way;
  }
  drawCross(find(".cross"));
  const [above, side] = document.querySelectorAll(".corridor");
  drawCorridor(above, "from above", now.corridor?.right ?? null, now.corridor?.headingRightDeg);
  drawCorridor(side, "from the side", now.corridor?.down ?? null, now.corridor?.headingDownDeg);
}

// Where the camera looks is the middle, and the dock a ring, full while the vehicle is in the corridor.
function drawCross(box) {
  const [wide, high] = [box.clientWidth, box.clientHeight];
  const [x, y, arm] = [wide / 2, high / 2, Math.max(0, Math.min(wide, high) / 2 - 20)];
  const parts = [svg("path", { class: "axis", d: `M${x - arm} ${y}H${x + arm}M${x} ${y - arm}V${y + arm}` })];
  for (const share of [1 / 3, 2 / 3, 1]) parts.push(svg("circle", { class: "axis", cx: x, cy: y, r: arm * share, "stroke-opacity": 0.5 }));
  parts.push(svg("text", { x: x + arm - 8, y: y + arm + 18 }, `${CROSS_DEG}°`));
  if (now.figures) {
    const [right, down] = now.directionDeg.map((one) => one / CROSS_DEG);
    const far = Math.max(1, Math.hypot(right, down)); // beyond the cross the ring stays at its edge
    const at = { cx: x + (arm * right) / far, cy: y + (arm * down) / far, r: 16 };
    parts.push(svg("circle", { class: now.corridor.isInside ? "ring inside" : "ring", ...at }));
  }
  box.replaceChildren(...parts);
}

// The dock stands at the right; `offset` is how far the vehicle is to the right of its axis, or below it, in metres.
function drawCorridor(box, words, offset, headingDeg) {
  const [wide, high] = [box.clientWidth, box.clientHeight];
  const parts = [svg("text", { x: 4, y: 16 }, words)];
  if (offset !== null) {
    const { ahead, entrance, opening } = now.corridor;
    const length = LENGTHS_M.find((one) => one > ahead * 1.1) ?? ahead * 1.1;
    const scale = Math.min((wide - 20 - WORDS_PX) / length, (high - 12) / 2 / (entrance + opening * length));
    const [x, y, middle] = [(one) => wide - 20 - one * scale, (one) => high / 2 + one * scale, high / 2];
    const [near, far] = [entrance, entrance + opening * length].map((one) => one * scale);
    const rim = Math.max(near, 6);
    parts.unshift(
      svg("path", { class: "way", d: `M${x(0)} ${middle - near}L${x(length)} ${middle - far}V${middle + far}L${x(0)} ${middle + near}Z` }),
      svg("path", { class: "axis", d: `M${x(0)} ${middle}H${x(length)}`, "stroke-dasharray": "6 6" }),
      svg("path", { class: "dock", d: `M${x(0)} ${middle - near - rim}V${middle - near}M${x(0)} ${middle + near}V${middle + near + rim}` }),
    );
    const clipped = Math.min(Math.max(y(offset), 15), high - 15);
    const turn = `translate(${Math.max(WORDS_PX + 10, Math.min(x(ahead), wide - 15))} ${clipped}) rotate(${headingDeg})`;
    parts.push(svg("path", { class: "vehicle", d: "M14 0L-10 9V-9Z", transform: turn }), svg("text", { x: 4, y: high - 6 }, `${length.toFixed(1)} m`));
  }
  box.replaceChildren(...parts);
}

function showAgain() {
  show();
  setTimeout(() => requestAnimationFrame(showAgain), ASK_EVERY_MS);
}
// The token has done its work once the page is there; a shared screen need not show it.
history.replaceState(null, "", location.pathname);
ask();
showAgain();
