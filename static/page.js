// What viser's page cannot do by itself: take several pictures at once, and pictures that are dropped on it.
"use strict";

// The token has done its work once the page is there; a shared screen need not show it.
if (location.search.includes("token=")) history.replaceState(null, "", location.pathname);

const BUTTON = "input[type=file][accept='image/*']";

// Hand the files to the upload button one after the other: it takes one at a time.
async function sendAll(files) {
  for (const file of files) {
    const input = document.querySelector(BUTTON);
    if (input === null) return;
    const one = new DataTransfer();
    one.items.add(file);
    input.files = one.files;
    input.dataset.single = "yes";
    input.dispatchEvent(new Event("change", { bubbles: true }));
    await ready(input);
  }
}

// The button is disabled while it uploads.
async function ready(input) {
  for (let waited = 0; waited < 1200; waited += 1) {
    await new Promise((next) => setTimeout(next, 50));
    if (!document.getElementById(input.id.replace("file_upload_", ""))?.disabled) return;
  }
}

// Choosing several in the button's own dialogue: viser would take the first only.
document.addEventListener("click", (event) => {
  if (event.target.matches?.(BUTTON)) event.target.multiple = true;
}, true);
document.addEventListener("change", (event) => {
  if (!event.target.matches?.(BUTTON)) return;
  if (event.target.dataset.single) {
    delete event.target.dataset.single;
    return;
  }
  event.stopImmediatePropagation();
  sendAll([...event.target.files]);
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
