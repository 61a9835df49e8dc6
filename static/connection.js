// What holds beyond one visit: says when dockpose has stopped and when it is back, or why it cannot be reached, and keeps
// the open tabs over a reload. It stands in the page itself, for where nothing else comes.
"use strict";

const ASK_EVERY_MS = 2000, ASK_WHILE_OUT_MS = 500, PATIENCE_MS = 10000;
const TABS = "dockpose tabs";

// A line over the whole page, for what must be read before anything else is believed.
function showBanner(text) {
  let banner = document.getElementById("connection-banner");
  if (banner === null) {
    banner = document.createElement("div");
    banner.id = "connection-banner";
    banner.setAttribute("role", "alert");
    banner.style.cssText = "position: fixed; inset: 0 0 auto 0; z-index: 10000; padding: 0.8em 1em; font: 600 16px/1.4 "
      + "system-ui, sans-serif; color: #fff; background: #a40000; white-space: pre-line; text-align: center; overflow-wrap: anywhere";
    document.body.append(banner);
  }
  banner.textContent = text;
  banner.hidden = text === "";
}

function startAgain() {
  const port = location.port && location.port !== "8080" ? ` --port ${location.port}` : "";
  return `dockpose serve${port}`;
}

// A proxy that names another address than the browser has, or lets no WebSocket through: the page alone comes.
let lacksScript = false;
window.addEventListener("error", ({ target }) => { lacksScript ||= target instanceof HTMLScriptElement; }, { capture: true });
const REFUSED = `The program answers, but this page gets no connection to it, so that nothing is shown.
A proxy between them must pass on the address that the browser has, ${location.host}, and WebSocket. For nginx:
proxy_http_version 1.1;  proxy_set_header Host $http_host;
proxy_set_header Upgrade $http_upgrade;  proxy_set_header Connection "upgrade";
Where the proxy cannot do that, start dockpose with --allow-host ${location.origin}. Its terminal says what it refused.`;

// The server answers nobody while it is stopped, and refuses who has an old token. After an outage viser stops trying to
// connect, so the page is loaded anew; until then the banner stays.
let wasOut = false;
async function ask() {
  try {
    const answer = await fetch("alive", { cache: "no-store", signal: AbortSignal.timeout(PATIENCE_MS) });
    if (answer.status === 403) showBanner("dockpose was started anew. Open the address that it printed in the terminal.");
    else if (!answer.ok) throw new Error("a proxy answers in its place");
    else if (wasOut) {
      location.reload();
      return; // a second reload would begin the first anew, where the program answers slowly
    } else showBanner(lacksScript || viserPage.refused > 1 ? REFUSED : "");
  } catch {
    wasOut = true;
    viserPage.mayConnect = false;
    showBanner(`dockpose has stopped; what is shown here is old.\n`
      + `Start it again in the terminal: ${startAgain()}. This page then reconnects by itself.`);
  }
  setTimeout(ask, wasOut ? ASK_WHILE_OUT_MS : ASK_EVERY_MS);
}
setTimeout(ask, ASK_EVERY_MS);

// What the program's answer shows of the result until the page is built goes as soon as there is a newer one, or no answer.
const [ASK_OF_SHELL_MS, MOST_ASKED] = [250, 80];
async function watchShell(asked = 0) {
  const shell = document.getElementById("shell");
  if (shell === null) return;
  const newest = await fetch("alive", { cache: "no-store" }).then((answer) => answer.ok && answer.text(), () => false);
  if (newest !== shell.dataset.result || asked > MOST_ASKED) shell.remove();
  else setTimeout(watchShell, ASK_OF_SHELL_MS, asked + 1);
}
document.addEventListener("DOMContentLoaded", () => watchShell());

// Tabs that were open are opened again after a reload; viser itself always starts with the first.
function openTabs() {
  return viserPage.tabs().filter(viserPage.isOpen).map(viserPage.nameOfTab);
}
document.addEventListener("click", (event) => {
  if (!event.isTrusted || !viserPage.isInTab(event.target)) return;
  setTimeout(() => sessionStorage.setItem(TABS, JSON.stringify(openTabs())), 100);
});
async function openTabsAgain() {
  const wanted = new Set(JSON.parse(sessionStorage.getItem(TABS) ?? "[]"));
  let isUsed = false;
  document.addEventListener("pointerdown", (event) => { isUsed ||= event.isTrusted; }, { capture: true });
  // viser opens the first tab again whenever another one arrives, so they must have stayed open for a while.
  for (let waited = 0, stayed = 0; wanted.size > 0 && waited < 300 && stayed < 10 && !isUsed; waited += 1) {
    const closed = viserPage.tabs().filter((tab) => wanted.has(viserPage.nameOfTab(tab)) && !viserPage.isOpen(tab));
    closed.forEach(viserPage.openTab);
    stayed = closed.length === 0 && wanted.size <= openTabs().length ? stayed + 1 : 0;
    await new Promise((next) => setTimeout(next, 100));
  }
}
openTabsAgain();
