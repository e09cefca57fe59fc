// Where viser's scene lies in the page: on its size depends where labels fit in, and the video lies at its left edge.
import { watchPage } from "./elements.js";

// Of a hidden page, viser takes what arrives at once; of a seen one, within the next picture: then bones and frames lie
// where this picture has them, and points and lines, which its renderer redraws, where the one before had them. So that
// one picture shows one frame, no page is hidden to viser.
Object.defineProperty(document, "hidden", { get: () => true });

let seen = null;
const told = new ResizeObserver(([{ contentRect }]) => tell(contentRect));
const tell = ({ width, height }) => {
  if (width && height) window.addb.send("picture", [width, height]);
  if (!seen) return;
  const place = seen.getBoundingClientRect(), { style } = document.documentElement;
  style.setProperty("--addb-scene-left", `${place.left}px`);
  style.setProperty("--addb-scene-width", `${place.width}px`);
};
watchPage(() => {
  const canvas = document.querySelector("#root canvas");
  if (canvas === seen) return;
  seen = canvas;
  told.disconnect();
  if (canvas) told.observe(canvas);
});
// A tab of viser's that the session wants to be seen: its name, and a number that is another one each time.
let shown = null;
window.addb.on("tab", ([name, number]) => {
  const tab = [...document.querySelectorAll("#root [role=tab]")].find((each) => each.textContent.trim() === name);
  if (shown === number || !tab) return;
  for (const type of ["pointerdown", "pointerup"]) tab.dispatchEvent(new PointerEvent(type, { bubbles: true, isPrimary: true }));
  shown = number;
});
window.addb.on("bar", () => seen && tell(seen.getBoundingClientRect())); // the session is there
