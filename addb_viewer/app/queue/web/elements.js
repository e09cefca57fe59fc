// Elements of the page.
import { element } from "/addb/elements.js";

export const at = (id) => document.getElementById(id);

export const make = (tag, className = "", ...children) => element(tag, { className }, ...children);

export const button = (label, onclick, options = {}) => element("button", { type: "button", onclick, ...options }, label);

export const put = (element, text) => {
  if (element.textContent !== text) element.textContent = text;
};
