// The connection to the server; it comes back by itself.

const AGAIN_MS = [500, 1000, 2000, 5000];

export class Channel {
  constructor(heard, opened, lost) {
    Object.assign(this, { heard, opened, lost, tries: 0 });
    this.open();
  }

  open() {
    const socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/addb/queue`);
    this.socket = socket;
    socket.addEventListener("open", () => {
      this.tries = 0;
      this.opened();
    });
    socket.addEventListener("message", (event) => this.heard(JSON.parse(event.data)));
    socket.addEventListener("close", () => {
      this.lost();
      setTimeout(() => this.open(), AGAIN_MS[Math.min(this.tries++, AGAIN_MS.length - 1)]);
    });
  }

  say(what, more = {}) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify({ what, ...more }));
  }
}

// What the browser remembers of the reviewer, shared with the review page: name, theme, and the browser's own.

const ITEM = "addb-viewer";
export const system = matchMedia("(prefers-color-scheme: dark)");

const read = () => {
  try {
    const kept = JSON.parse(localStorage.getItem(ITEM) ?? "{}");
    return typeof kept === "object" && kept !== null ? kept : {};
  } catch {
    return {};
  }
};

const write = (change) => {
  try {
    localStorage.setItem(ITEM, JSON.stringify({ ...read(), ...change }));
  } catch {
    // a browser that keeps nothing
  }
};

export const memory = {
  get name() {
    const { reviewer } = read();
    return typeof reviewer === "string" ? reviewer : "";
  },
  set name(name) {
    write({ reviewer: name });
  },
  get browser() {
    const { browser } = read();
    return typeof browser === "string" ? browser : "";
  },
  get dark() {
    const { theme } = read();
    return typeof theme === "string" ? theme === "dark" : system.matches;
  },
  set dark(dark) {
    write({ theme: dark === system.matches ? null : dark ? "dark" : "light" }); // else it follows the system's wish
  },
};
