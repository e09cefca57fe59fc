// Elements of the page.

export const at = (id) => document.getElementById(id);

export const make = (tag, kind = "", text = "") => {
  const element = document.createElement(tag);
  if (kind) element.className = kind;
  if (text) element.textContent = text;
  return element;
};

export function button(label, act) {
  const element = make("button", "", label);
  element.type = "button";
  element.addEventListener("click", act);
  return element;
}

export const put = (element, text) => {
  if (element.textContent !== text) element.textContent = text;
};
