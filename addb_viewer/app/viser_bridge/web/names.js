// Names of viser's own controls, for people who hear the page: viser ties a label to an id that its boxes and sliders do
// not carry, and its buttons with a picture have a name only while the pointer lies over them.
import { watchPage } from "./elements.js";

const PICTURES = { "list-search": "Commands (Ctrl K)" };
const EVERY_MS = 300; // at most: the charts in the panel are drawn anew with each frame

document.getElementById("root").setAttribute("role", "main");

const name = (element, text) => {
  if (!element.getAttribute("aria-label")) element.setAttribute("aria-label", text);
};
const nameAll = () => {
  for (const label of document.querySelectorAll("#root label[for]")) {
    const row = label.control ? null : label.closest("p")?.parentElement?.parentElement;
    for (const box of row?.querySelectorAll("input, textarea, [role=slider]") ?? []) name(box, label.textContent);
  }
  for (const [picture, text] of Object.entries(PICTURES)) {
    for (const drawn of document.querySelectorAll(`button > .mantine-ActionIcon-icon > .tabler-icon-${picture}`)) {
      name(drawn.closest("button"), text);
    }
  }
};
let waiting = 0;
watchPage(() => {
  waiting ||= setTimeout(() => {
    waiting = 0;
    nameAll();
  }, EVERY_MS);
});
