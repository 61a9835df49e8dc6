// What viser's page cannot do by itself: take several pictures at once, and files that are dropped on it.
"use strict";

// The token has done its work once the page is there; a shared screen need not show it.
if (location.search.includes("token=")) history.replaceState(null, "", location.pathname);

const pause = () => new Promise((next) => setTimeout(next, 50));
// The upload button for a file, where a first one was chosen the same as that; what is in a closed tab is not on the page
// at all, so its tab is opened first.
async function buttonFor(file, chosen) {
  const isVideo = file.type.startsWith("video/") || /\.(mp4|m4v|mov|avi|mkv|webm|mpe?g|ts|wmv|mjpe?g|mcap|bag|db3)$/i.test(file.name);
  for (let waited = 0; waited < 40; waited += 1) {
    const isForBoards = chosen !== null && viserPage.isForBoards(chosen);
    const input = isForBoards ? viserPage.inputLike(chosen) : viserPage.uploadInput(isVideo);
    if (input !== null) return input;
    if (waited === 0) viserPage.openTab(viserPage.tabOf(isForBoards ? "Calibrate" : "Source"));
    await pause();
  }
  return null;
}

// Hand the files to the upload button one after the other: it takes one at a time.
async function sendAll(files, chosen = null) {
  if (files.length > 1) document.dispatchEvent(new CustomEvent("together", { detail: files.map(({ name }) => name) }));
  for (const file of files) {
    const input = await buttonFor(file, chosen);
    if (input === null) return;
    const one = new DataTransfer();
    one.items.add(file);
    input.files = one.files;
    input.dataset.single = "yes";
    input.dispatchEvent(new Event("change", { bubbles: true }));
    await pause();
    for (let waited = 0; viserPage.isUploading(input) && waited < 1200; waited += 1) await pause();
  }
}

// Choosing several in the button's own dialogue: viser would take the first only.
document.addEventListener("click", (event) => {
  if (viserPage.takesMany(event.target)) event.target.multiple = true;
}, true);
document.addEventListener("change", (event) => {
  if (!viserPage.takesMany(event.target)) return;
  if (event.target.dataset.single) {
    delete event.target.dataset.single;
    return;
  }
  event.stopImmediatePropagation();
  sendAll([...event.target.files], event.target);
}, true);

// Files dropped anywhere; without this the browser would leave the page to show them.
for (const kind of ["dragenter", "dragover"]) {
  window.addEventListener(kind, (event) => {
    if (event.dataTransfer?.types.includes("Files")) event.preventDefault();
  });
}
window.addEventListener("drop", (event) => {
  if (!event.dataTransfer?.types.includes("Files")) return;
  event.preventDefault();
  sendAll([...event.dataTransfer.files]);
});

// The strip, made large for whoever looks from afar; its words come anew with each result, so what is pressed is of the page.
document.addEventListener("click", (event) => {
  if (event.target.id === "strip-size") document.documentElement.classList.toggle("large");
});

// Words that open a tab.
document.addEventListener("click", (event) => {
  const link = event.target.closest?.("[data-opens]");
  if (link) [event.preventDefault(), viserPage.openTab(viserPage.tabOf(link.dataset.opens))];
});

// Esc leaves any box, and so does a choice from its list, so that keys are commands again; then what is over the picture.
document.addEventListener("keydown", (event) => {
  if (event.key !== "Escape" || viserPage.hasDialog()) return;
  if (event.target.matches("input, textarea")) event.target.blur();
  else if (document.documentElement.classList.contains("large")) document.documentElement.classList.remove("large");
  else if (viserPage.tabs().some((tab) => /^(Log|Calibrate)$/.test(viserPage.nameOfTab(tab)) && viserPage.isOpen(tab))) {
    viserPage.openTab(viserPage.tabOf("Picture"));
  }
}, true);
document.addEventListener("click", (event) => {
  if (viserPage.isChoice(event.target)) setTimeout(() => document.activeElement.blur());
}, true);
