// What the browser remembers of the reviewer, shared with the review page: name, theme, and the browser's own.

const ITEM = "addb-viewer";

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
    return read().dark === true;
  },
  set dark(dark) {
    write({ dark });
  },
};
