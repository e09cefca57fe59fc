// The page's end of the channel of our own; see channel.py. The session puts the page's name into a panel; with it, and
// with what the address asks for and the browser remembers, the channel begins.
import { watchPage } from "./elements.js";
import { connect, remember, remembered, system } from "./server.js";

const known = new Map(); // the newest value of each kind
const listeners = new Map();
let say = () => {}, name = null;

const heard = ([kind, value]) => {
  known.set(kind, value);
  for (const listener of listeners.get(kind) ?? []) listener(value);
};
const opened = () => say({ name, query: location.search.slice(1), dark: system.matches, memory: remembered() });
watchPage(() => {
  const given = [...document.querySelectorAll("[data-addb-page]")].at(-1)?.dataset.addbPage;
  if (!given || given === name) return;
  const isFirst = name === null;
  name = given;
  if (isFirst) say = connect("/addb/page", { opened, heard }); // else the server closes the channel of the session before
});

window.addb = {
  /** Calls back with each new value of a kind, and at once with the present one. */
  on(kind, listener) {
    listeners.set(kind, [...(listeners.get(kind) ?? []), listener]);
    if (known.has(kind)) listener(known.get(kind));
  },
  /** Asks the session for something; dropped where there is no session. */
  send: (kind, value = null) => say([kind, value]),
};

window.addb.on("memory", remember);
system.addEventListener("change", () => window.addb.send("dark", system.matches));
window.addb.on("theme", (theme) => (document.documentElement.dataset.addbTheme = theme));

// The address names the frame on the screen. A browser allows a hundred changes in 30 s: what is scrubbed over is
// not written.
let wanted = null;
window.addb.on("address", (address) => (wanted = address));
setInterval(() => {
  if (wanted && location.pathname + location.search !== wanted) history.replaceState(history.state, "", wanted);
}, 500);
