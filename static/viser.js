// All that our scripts know of the page that viser and its Mantine make: how its parts are named, where they stand, and
// what it does with them. The other scripts ask here, and viser.css has its styles: a new viser is work for these two.
// Names of our own for what we add would replace the selectors; a place for elements of our own, the hidden text boxes.
// Loaded before viser's own script, for the first lines must hold when that starts.
"use strict";

// viser lays out its panels otherwise on phones, without the picture; our tabs serve there as well.
const PHONE_QUERY = "(max-width: 36em)";
const realMatchMedia = window.matchMedia.bind(window);
window.matchMedia = (query) => realMatchMedia(query === PHONE_QUERY ? "not all" : query);

// viser's sorter of Gaussian splats starts with every page and builds functions from text. The page's content policy
// refuses that, and nothing here is drawn with splats, so the refusal is no fault to be told.
window.addEventListener("unhandledrejection", (event) => {
  if (event.reason instanceof EvalError) event.preventDefault();
});

// viser tries each second to connect again. Each failure makes Chromium wait longer before the next try, up to 5 s, and
// after a reload too: while the program is known to be stopped it shall not try. It asks for the page's address without its last
// slash, of which a proxy that serves a path makes another page's; and its answers tell whether it was ever connected.
const post = Worker.prototype.postMessage;
Worker.prototype.postMessage = function (message, ...rest) {
  if (message?.type === "set_server") {
    message.server = new URL("./", location.href.replace(/^http/, "ws")).href;
    this.addEventListener("message", ({ data }) => {
      if (data.type === "connected") viserPage.refused = 0;
      else if (data.type === "closed") viserPage.refused += 1;
    });
  }
  if (message?.message?.type === "ViewerCameraMessage") viserPage.takeEye(message.message);
  if (message?.type !== "retry" || viserPage.mayConnect) post.call(this, message, ...rest);
};

const TAB = "[role=tab]";
const GROUP_NAME = ".mantine-Paper-root > .mantine-Paper-root:has(> .tabler-icon)";
const PICTURE_UPLOAD = "input[type=file][accept='image/*']";
const VIDEO_UPLOAD = "input[type=file][accept^='video/*']";
const BOARD_UPLOAD = "input[type=file][accept^='.png']"; // of pictures to calibrate with

const viserPage = {
  mayConnect: true, // whether viser tries to connect again
  refused: 0, // times in a row that it tried in vain
  takeEye: (eye) => (viserPage.eye = eye), // from where the 3D scene is looked at, as it tells the program

  // Tabs. viser opens one when it is pressed, and drags it where the pointer moves; a plain click does nothing.
  tabs: () => [...document.querySelectorAll(TAB)],
  nameOfTab: (tab) => tab.textContent.trim(),
  tabOf: (name) => viserPage.tabs().find((tab) => viserPage.nameOfTab(tab) === name),
  isOpen: (tab) => tab.getAttribute("aria-selected") === "true",
  isInTab: (element) => Boolean(element.closest?.(TAB)),
  openTab(tab) {
    for (const kind of ["pointerdown", "pointerup"]) {
      tab?.dispatchEvent(new PointerEvent(kind, { bubbles: true, cancelable: true, isPrimary: true }));
    }
  },

  // Groups of controls: the lines with their names, which are clicked.
  groupNames: () => document.querySelectorAll(GROUP_NAME),
  isGroupName: (element) => Boolean(element.matches?.(GROUP_NAME)),
  isUnfolded: (name) => name.querySelector(".tabler-icon-chevron-up") !== null,

  // Upload buttons, which are disabled while they upload; none is on the page while its tab is closed.
  uploadInput: (isVideo) => document.querySelector(isVideo ? VIDEO_UPLOAD : PICTURE_UPLOAD),
  takesMany: (element) => Boolean(element.matches?.(`${PICTURE_UPLOAD}, ${BOARD_UPLOAD}`)),
  isForBoards: (element) => Boolean(element.matches?.(BOARD_UPLOAD)),
  inputLike: (input) => document.querySelector(`input[type=file][accept="${CSS.escape(input.accept)}"]`),
  isUploading: (input) => document.getElementById(input.id.replace("file_upload_", ""))?.disabled ?? false,

  // Text boxes: the words beside one, those that these do not name for who hears them, the one of an id, and typing into it.
  rowLabel(input) {
    let row = input.parentElement;
    while (row !== null && row.querySelector("label") === null) row = row.parentElement;
    return row?.querySelector("label");
  },
  labelOf: (input) => viserPage.rowLabel(input)?.textContent.trim() ?? "",
  unnamed: () => document.querySelectorAll("[role=slider][aria-label=''], .mantine-Input-input:not([aria-label])"),
  closers: () => document.querySelectorAll(".mantine-Notification-closeButton:not([aria-label])"),
  boxOf: (id) => document.querySelector(`label[for="${id}"]`)?.closest(".mantine-Flex-root")?.querySelector("input, textarea"),
  // A box for a number reads what is typed letter by letter, drops what it does not know, and goes to the ends of its range.
  isForNumber: (element) => Boolean(element.matches?.(".mantine-NumberInput-input")),
  write: (box, text) => Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set.call(box, text), // React keeps its own
  type(box, text) {
    viserPage.write(box, text);
    box.dispatchEvent(new Event("input", { bubbles: true }));
  },

  // Whether something is of the choices of an open list.
  isChoice: (element) => Boolean(element.closest?.("[role=option]")),

  // A slider's name, for what is in its track.
  sliderAround: (element) => (element.closest?.(".mantine-Slider-root") ? viserPage.labelOf(element) : ""),

  // Elements of our own each stand in a box, one after the other with those of the controls.
  boxAround: (element) => element.parentElement,
  boxBefore: (element) => element.parentElement?.previousElementSibling,
  boxesAfter(element, count) {
    const all = [...(element.parentElement?.parentElement?.children ?? [])];
    const at = all.indexOf(element.parentElement) + 1;
    return all.slice(at, at + count);
  },
  // Where its panels begin, in pixels from the top of the window.
  top: () => document.getElementById("root").offsetTop,
  // What an element's panel holds, and the height that it may have there: on small screens all panels scroll as one, and
  // the 3D view follows upon the picture.
  roomFor(element) {
    const [page, scroller, content] = viserPage.around(element);
    const isColumn = scroller !== undefined && getComputedStyle(page).display === "flex";
    return [content, isColumn ? page.clientHeight - page.firstElementChild.offsetHeight : scroller?.clientHeight];
  },
  // Whose sizes that depends on, from outside to inside.
  around(element) {
    const scroller = element.closest("[data-dock-region]")?.querySelector("[data-scrollarea-viewport]");
    return scroller ? [scroller.closest("[data-dock-root]"), scroller, scroller.firstElementChild] : [];
  },
  // Where it draws its 3D scene.
  sceneBox: () => document.querySelector("[data-dock-root] > div:first-child"),
  // Whether its page is dark or light, and what is to be done when that changes.
  scheme: () => document.documentElement.dataset.mantineColorScheme,
  onScheme: (act) => new MutationObserver(act).observe(document.documentElement, { attributeFilter: ["data-mantine-color-scheme"] }),
  hasDialog: () => [...document.querySelectorAll("[role=dialog], [role=listbox]")].some((one) => one.getClientRects().length > 0),
};

// viser lets its tabs be dragged out of their panel, which wet fingers do by mistake: a press opens a tab, no more.
document.addEventListener("pointerdown", (event) => {
  const tab = event.target.closest?.("[data-dock-tab]");
  if (!event.isTrusted || !tab) return;
  event.stopPropagation();
  if (event.button === 0) viserPage.openTab(tab);
}, { capture: true });
