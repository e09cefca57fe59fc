// Where viser's scene lies in the page: on its size depends where labels fit in, and the video lies at its left edge.
import { watchPage } from "./elements.js";

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
window.addb.on("bar", () => seen && tell(seen.getBoundingClientRect())); // the session is there
