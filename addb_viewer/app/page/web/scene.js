// Tells how large the scene is in the page, on which depends where labels fit in; and where it begins.
let seen = null;
const told = new ResizeObserver(([{ contentRect }]) => tell(contentRect));
const tell = ({ width, height }) => {
  if (width && height) window.addb.send("picture", [width, height]);
  if (!seen) return;
  const place = seen.getBoundingClientRect(), { style } = document.documentElement;
  style.setProperty("--addb-scene-left", `${place.left}px`);
  style.setProperty("--addb-scene-width", `${place.width}px`);
};
const look = () => {
  const canvas = document.querySelector("#root canvas");
  if (canvas === seen) return;
  seen = canvas;
  told.disconnect();
  if (canvas) told.observe(canvas);
};
new MutationObserver(look).observe(document.documentElement, { childList: true, subtree: true });
window.addb.on("bar", () => seen && tell(seen.getBoundingClientRect())); // the session is there
look();
