// Where the parts of the page are: three beside each other, or on small screens one at a time, as a bar of tabs says.
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
prefersDark.addEventListener("change", () => {
  keepLook();
  fetch("/look"); // its own pages are told to take the new colours
});

const PARTS = { picture: "Picture", view3d: "3D", tools: "Tools" };
const OPEN_PART = "dockpose part";

function openPart(name) {
  document.documentElement.dataset.tab = name;
  sessionStorage.setItem(OPEN_PART, name);
  for (const button of document.querySelectorAll("#parts button")) {
    button.setAttribute("aria-current", String(button.dataset.part === name));
  }
}

function addParts() {
  const bar = document.createElement("nav");
  bar.id = "parts";
  bar.setAttribute("aria-label", "Parts of the page");
  for (const [name, words] of Object.entries(PARTS)) {
    const button = document.createElement("button");
    [button.type, button.textContent, button.dataset.part] = ["button", words, name];
    button.addEventListener("click", () => openPart(name));
    bar.append(button);
  }
  document.body.prepend(bar);
  const last = sessionStorage.getItem(OPEN_PART);
  openPart(last in PARTS ? last : "picture");
}
document.documentElement.dataset.tab = "picture";
document.addEventListener("DOMContentLoaded", addParts);

// The picture takes the height that the rest of its panel leaves, as far as it needs it, and its histogram the rest.
const LEAST_PICTURE_PX = 190;
const [LEAST_PLOT_PX, MOST_PLOT_PX, PLOT_SHARE] = [128, 320, 0.24]; // the least has room for every decade

// Heights of picture and histogram, where both together may have `free`, and the picture is seen whole at `whole`.
function shares(free, whole) {
  const plot = Math.max(LEAST_PLOT_PX, Math.round(PLOT_SHARE * free));
  const picture = Math.max(LEAST_PICTURE_PX, Math.min(free - plot, whole));
  return [picture, Math.min(Math.max(free - picture, LEAST_PLOT_PX), MOST_PLOT_PX)];
}

function share(picture) {
  const panel = viserPage.scrollerOf(picture);
  const [stage, plot] = [picture.querySelector(".stage"), document.querySelector("dockpose-histogram .plot")];
  if (!panel || !plot || stage.clientWidth === 0) return; // its tab is closed
  const taken = panel.firstElementChild.offsetHeight - stage.offsetHeight - plot.clientHeight;
  const { width, height } = picture.viewport;
  const [high, low] = shares(panel.clientHeight - taken, Math.round((stage.clientWidth * height) / width));
  const { style } = document.documentElement;
  for (const [name, height] of [["--stage-height", `${high}px`], ["--plot-height", `${low}px`]]) {
    if (style.getPropertyValue(name) !== height) style.setProperty(name, height); // it has the whole page styled anew
  }
}

// viser makes its panels anew when it connects again, so the picture is looked for whenever the page changes.
let shared = null;
const resizes = new ResizeObserver(() => shared !== null && share(shared));
const redrawn = new MutationObserver(() => share(shared));
new MutationObserver(() => {
  const picture = document.querySelector("dockpose-picture");
  if (picture === shared || !picture?.viewport) return;
  shared = picture;
  resizes.disconnect();
  redrawn.disconnect();
  const panel = viserPage.scrollerOf(picture);
  for (const part of [panel, panel?.firstElementChild]) if (part) resizes.observe(part);
  redrawn.observe(picture, { attributeFilter: ["data-drawn"] }); // of another shape, perhaps
}).observe(document, { childList: true, subtree: true });

// viser's groups of controls open and close by a click on their name: here by the keys as well.
const WORKED_BY_KEYS_MS = 200;
let isLooking = false;

function makeGroupsReachable() {
  isLooking = false;
  for (const name of viserPage.groupNames()) {
    [name.tabIndex, name.role] = [0, "button"];
    name.setAttribute("aria-expanded", String(viserPage.isUnfolded(name)));
  }
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
