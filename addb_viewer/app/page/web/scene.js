// Tells how large the scene is in the page: where labels fit in depends on it.
let seen = null;
const told = new ResizeObserver(([{ contentRect }]) => tell(contentRect));
const tell = ({ width, height }) => width && height && window.addb.send("picture", [width, height]);
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
