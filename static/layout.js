// Where the parts of the page are: three beside each other, or on small screens one beneath the other.
"use strict";

// What this browser is goes along with its connection, in a cookie: whether its system is dark, and whether it draws the
// 3D scene without a graphics card, for then each drawing holds the pictures back.
function drawsInSoftware() {
  const context = document.createElement("canvas").getContext("webgl2");
  const names = context?.getExtension("WEBGL_debug_renderer_info");
  const renderer = names ? context.getParameter(names.UNMASKED_RENDERER_WEBGL) : "";
  context?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|softpipe|basic render|software/i.test(renderer);
}
const prefersDark = window.matchMedia("(prefers-color-scheme: dark)");
const isSoftware = drawsInSoftware();
const LOOK = `dockpose${location.port && `_${location.port}`}_look`;
const browserId = document.cookie.split("; ").find((one) => one.startsWith(`${LOOK}=`))?.match(/=(id\w+)/)?.[1]
  ?? `id${Array.from(crypto.getRandomValues(new Uint32Array(4)), (number) => number.toString(36)).join("")}`;
function keepLook() {
  const words = [browserId, prefersDark.matches && "dark", isSoftware && "software"].filter(Boolean);
  document.cookie = `${LOOK}=${words.join(".")}; SameSite=Strict; Path=/`;
}
keepLook();
document.documentElement.toggleAttribute("data-software", isSoftware); // a line in the tab Settings says so
prefersDark.addEventListener("change", () => {
  keepLook();
  fetch("look"); // its own pages are told to take the new colours
});

// The picture is shown as large as the window lets it, and its histogram has the height that it leaves.
const [LEAST_PICTURE_PX, WHOLE_WITHIN] = [190, 0.4];
const [LEAST_PLOT_PX, MOST_PLOT_PX] = [90, 300]; // the least has room for every decade

// Heights of picture and histogram, where both together may have `free`, and the picture is seen whole at `whole`; that
// it is on phones, where the page scrolls, within a share of the window.
function shares(free, whole) {
  const plot = Math.max(LEAST_PLOT_PX, Math.min(free - whole, MOST_PLOT_PX));
  return [Math.max(LEAST_PICTURE_PX, Math.min(whole, WHOLE_WITHIN * innerHeight), free - plot), plot];
}

function share(picture) {
  const [panel, free] = viserPage.roomFor(picture);
  const [stage, plot] = [picture.querySelector(".stage"), document.querySelector("dockpose-histogram .plot")];
  if (!panel || !plot || stage.clientWidth === 0) return; // its tab is closed
  const taken = panel.offsetHeight - stage.offsetHeight - plot.clientHeight;
  const { width, height } = picture.viewport;
  const { style } = document.documentElement;
  const whole = Math.round((stage.clientWidth * height) / width);
  const [high, low] = shares(free - taken, whole);
  for (const [name, height] of [["--stage-height", `${high}px`], ["--plot-height", `${low}px`]]) {
    if (style.getPropertyValue(name) !== height) style.setProperty(name, height); // it has the whole page styled anew
  }
}

// Two bars between picture, 3D view and tools, and panes that are put away: each browser remembers its own.
const PANES = "dockpose panes";
const panes = { right: null, scene: null, away: [], ...JSON.parse(localStorage.getItem(PANES) ?? "{}") };
const BARS = { // what each sizes, from where the bar is, as a share of the window; its keys, which make that larger and smaller
  right: { words: "Width of 3D view and tools", least: 0.2, most: 0.6, of: (x) => 1 - (x - 4) / innerWidth, keys: ["ArrowLeft", "ArrowRight"] },
  scene: { words: "Height of the 3D view", least: 0.12, most: 0.6, of: (x, y) => (y - viserPage.top()) / innerHeight, keys: ["ArrowDown", "ArrowUp"] },
};
const STEP = 0.02;

function layPanes() {
  const { style, dataset } = document.documentElement;
  for (const [name, unit] of [["right", "vw"], ["scene", "vh"]]) {
    if (panes[name] === null) style.removeProperty(`--${name}-asked`);
    else style.setProperty(`--${name}-asked`, `${(100 * panes[name]).toFixed(2)}${unit}`);
  }
  dataset.away = panes.away.join(" ");
}

function keepPanes(change) {
  Object.assign(panes, change);
  localStorage.setItem(PANES, JSON.stringify(panes));
  layPanes();
}

function togglePane(name) {
  const rest = panes.away.filter((one) => one !== name);
  keepPanes({ away: rest.length < panes.away.length ? rest : [...rest, name] });
}

function sizePane(name, share) {
  const { least, most } = BARS[name];
  keepPanes({ [name]: Math.min(Math.max(share, least), most), away: panes.away.filter((one) => one !== name) });
}

function addBar(name) {
  const { words, least, most, of, keys } = BARS[name];
  const share = () => {
    const { left, top, width, height } = bar.getBoundingClientRect();
    return of(left + width / 2, top + height / 2);
  };
  const bar = document.createElement("div");
  bar.id = `bar-${name}`;
  [bar.role, bar.tabIndex, bar.ariaLabel, bar.ariaOrientation] = ["separator", 0, words, name === "right" ? "vertical" : "horizontal"];
  bar.title = "Drag, or press arrows, to share the room; double click or Enter puts away what is beyond, or brings it back.";
  bar.addEventListener("pointerdown", (event) => event.button === 0 && bar.setPointerCapture(event.pointerId));
  bar.addEventListener("pointermove", (event) => {
    if (bar.hasPointerCapture(event.pointerId) && !panes.away.includes(name)) sizePane(name, of(event.clientX, event.clientY));
  });
  bar.addEventListener("dblclick", () => togglePane(name));
  bar.addEventListener("keydown", (event) => {
    const asked = { [keys[0]]: share() + STEP, [keys[1]]: share() - STEP, Home: least, End: most }[event.key];
    if (asked !== undefined) sizePane(name, asked);
    else if (event.key === "Enter") togglePane(name);
    else return;
    event.preventDefault();
    event.stopPropagation();
  });
  document.body.append(bar);
  const tell = () => (bar.ariaValueNow = Math.round(100 * share()));
  for (const kind of ["focus", "keydown", "pointermove"]) bar.addEventListener(kind, tell);
  tell();
}
layPanes();
document.addEventListener("DOMContentLoaded", () => Object.keys(BARS).forEach(addBar));

// viser makes its panels anew when it connects again, so the picture is looked for whenever the page changes.
let shared = null;
const resizes = new ResizeObserver(() => shared !== null && share(shared));
let shape = 0; // of the picture, its width over its height
const redrawn = new MutationObserver(() => {
  const { width, height } = shared.viewport;
  if (width / height !== shape) share(shared);
  shape = width / height;
});
new MutationObserver(() => {
  const picture = document.querySelector("dockpose-picture");
  if (picture === shared || !picture?.viewport) return;
  shared = picture;
  resizes.disconnect();
  redrawn.disconnect();
  for (const part of viserPage.around(picture)) resizes.observe(part);
  redrawn.observe(picture, { attributeFilter: ["data-drawn"] });
}).observe(document, { childList: true, subtree: true });

// viser's groups of controls open and close by a click on their name: here by the keys as well. Screen readers are told
// the names of its sliders and boxes.
const WORKED_BY_KEYS_MS = 200;
let isLooking = false;

function makeGroupsReachable() {
  isLooking = false;
  for (const name of viserPage.groupNames()) {
    [name.tabIndex, name.role] = [0, "button"];
    name.setAttribute("aria-expanded", String(viserPage.isUnfolded(name)));
  }
  for (const one of viserPage.unnamed()) one.ariaLabel = viserPage.labelOf(one);
  for (const one of viserPage.closers()) one.ariaLabel = "Close this notice";
}
new MutationObserver(() => {
  if (!isLooking) setTimeout(makeGroupsReachable, WORKED_BY_KEYS_MS);
  isLooking = true;
}).observe(document, { childList: true, subtree: true });
document.addEventListener("keydown", (event) => {
  if (!["Enter", " "].includes(event.key) || !viserPage.isGroupName(event.target)) return;
  event.preventDefault();
  event.stopPropagation();
  event.target.click();
}, { capture: true });
