// What all own parts of the page are made of.

/** An element with properties, attributes (`role`, and those with a hyphen) and children; texts are set as text. */
export const element = (tag, options = {}, ...children) => {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(options)) {
    if (name === "role" || name.includes("-")) made.setAttribute(name, value);
    else if (name === "style" || name === "dataset") Object.assign(made[name], value);
    else made[name] = value;
  }
  made.append(...children);
  return made;
};

/** A button that gives the keyboard back to the page after its click. */
export const button = (words, act, options = {}) => {
  const made = element("button", { type: "button", ...options }, ...[words].flat());
  made.onclick = () => {
    act();
    made.blur();
  };
  return made;
};

/** Whether a key is for a box. One that has just gone keeps the focus until the page is drawn again, and gets none. */
export const isTyped = ({ isComposing, target }) =>
  isComposing || ((target.isContentEditable || /^(INPUT|TEXTAREA|SELECT)$/.test(target.tagName)) && target.checkVisibility());

/** Calls back now, and whenever elements of the page come or go. */
const watchers = [];
new MutationObserver(() => watchers.forEach((look) => look())).observe(document.documentElement, { childList: true, subtree: true });
export const watchPage = (look) => {
  watchers.push(look);
  look();
};

/** Puts something of ours into the place that a panel has for it, and again whenever that is made anew. */
export const keepIn = (place, own, placed = () => {}) =>
  watchPage(() => {
    const found = document.querySelector(place);
    if (!found || found.contains(own)) return;
    found.append(own);
    placed();
  });
