// What the browser remembers of the reviewer, shared with the review page: name, theme, and the browser's own.
import { remember, remembered, system } from "/addb/server.js";

const words = (kind) => (typeof remembered()[kind] === "string" ? remembered()[kind] : "");

export const memory = {
  get name() {
    return words("reviewer");
  },
  set name(name) {
    remember({ reviewer: name });
  },
  get browser() {
    return words("browser");
  },
  get dark() {
    return words("theme") ? words("theme") === "dark" : system.matches;
  },
  set dark(dark) {
    remember({ theme: dark === system.matches ? null : dark ? "dark" : "light" }); // else it follows the system's wish
  },
};
