// The search of curves: a box that finds quantities by their words; chips for what is chosen and has no chart here.
import { button, element } from "./elements.js";

const MOST_FOUND = 60;

/** A button that takes a quantity away. */
export const takeAway = (words, content, act) => button(content, act, { className: "addb-curve-chip", title: "Take it away", "aria-label": `Take away ${words}` });

/** Makes box, list and chips. changed: called with the ids that are to be shown, in their order. */
export function makeChooser(changed) {
  const list = element("ul", { id: "addb-curve-list", hidden: true, role: "listbox", "aria-label": "Curves" });
  const chips = element("div", { id: "addb-curve-chips", role: "group", "aria-label": "Curves that this trial has not" });
  const box = element("input", {
    type: "search", id: "addb-curve-search", placeholder: "Add a curve: knee torque, hip angle …", autocomplete: "off",
    role: "combobox", "aria-label": "Add a curve", "aria-controls": list.id, "aria-expanded": "false", "aria-autocomplete": "list",
  });

  let choices = [], chosen = [], drawn = [], at = 0, found = [];
  const words = (id) => choices.find((choice) => choice.id === id)?.words;
  const matches = ({ words, unit, also }) => {
    const text = `${words} ${unit} ${also}`.toLowerCase();
    return box.value.toLowerCase().split(/\s+/).every((part) => text.includes(part));
  };
  const tell = (ids) => {
    chosen = ids;
    draw();
    changed(ids);
  };
  const toggle = (id) => tell(chosen.includes(id) ? chosen.filter((each) => each !== id) : [...chosen, id]);

  function draw() {
    chips.replaceChildren(
      ...chosen.filter((id) => words(id) && !drawn.includes(id)).map((id) => takeAway(words(id), [words(id), element("span", {}, " ×")], () => toggle(id))),
    );
    if (list.hidden) return;
    found = choices.filter(matches).slice(0, MOST_FOUND);
    at = Math.min(at, Math.max(found.length - 1, 0));
    list.replaceChildren(
      ...found.map(({ id, words, unit }, i) => {
        const told = { id: `addb-curve-${i}`, role: "option", "aria-selected": String(chosen.includes(id)), dataset: i === at ? { at: "" } : {} };
        const option = element("li", told, element("span", {}, words), element("small", {}, unit));
        option.onclick = (event) => {
          event.stopPropagation(); // the box keeps the focus, for the next one
          at = i;
          toggle(id);
        };
        return option;
      }),
      ...(found.length ? [] : [element("li", { className: "none", textContent: "Nothing is called so." })]),
    );
    if (found.length) box.setAttribute("aria-activedescendant", `addb-curve-${at}`);
    else box.removeAttribute("aria-activedescendant");
    list.children[at]?.scrollIntoView({ block: "nearest" });
  }
  const open = (on) => {
    list.hidden = !on;
    box.setAttribute("aria-expanded", String(on));
    draw();
  };
  list.onpointerdown = (event) => event.preventDefault();
  box.onfocus = () => open(true);
  box.onblur = () => open(false);
  box.oninput = () => {
    at = 0;
    open(true);
  };
  box.onkeydown = (event) => {
    const step = { ArrowDown: 1, ArrowUp: -1 }[event.key];
    if (step) {
      at = Math.min(Math.max(at + step, 0), Math.max(found.length - 1, 0));
      draw();
    } else if (event.key === "Enter" && found[at]) {
      toggle(found[at].id);
      box.select();
    } else return;
    event.preventDefault();
    event.stopPropagation();
  };
  return {
    parts: [box, list, chips],
    toggle,
    drawn(ids) {
      drawn = ids;
      draw();
    },
    show(told) {
      [choices, chosen] = [told.choices, told.chosen];
      draw();
    },
  };
}
