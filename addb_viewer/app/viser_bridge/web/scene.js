// Where viser's scene lies in the page: on its size depends where labels fit in, and the video lies at its left edge.
import { watchPage } from "./elements.js";

// Of a hidden page, viser takes what arrives at once; of a seen one, within the next picture: then bones and frames lie
// where this picture has them, and points and lines, which its renderer redraws, where the one before had them. So that
// one picture shows one frame, no page is hidden to viser.
Object.defineProperty(document, "hidden", { get: () => true });

// viser's labels are black on white: the brightest things of a dark page. There they are pale on dark.
const LABELS = [["vec4(1.0, 1.0, 1.0, 0.85 * vAlpha)", "vec4(0.17, 0.18, 0.19, 0.85 * vAlpha)"], ["vec4(0.0, 0.0, 0.0, a)", "vec4(0.75, 0.76, 0.78, a)"]];
const gl = WebGL2RenderingContext.prototype, { shaderSource, useProgram } = gl, places = new WeakMap();
gl.shaderSource = function (shader, text) {
  const colors = LABELS.find(([bright]) => text.includes("vAlpha") && text.includes(bright));
  const mixed = colors && text.replace("void main", "uniform float addbDark;\nvoid main").replace(colors[0], `mix(${colors}, addbDark)`);
  shaderSource.call(this, shader, mixed ?? text);
};
gl.useProgram = function (program) {
  useProgram.call(this, program);
  if (!program) return;
  if (!places.has(program)) places.set(program, this.getUniformLocation(program, "addbDark"));
  const place = places.get(program);
  if (place) this.uniform1f(place, document.documentElement.dataset.addbTheme === "dark" ? 1 : 0);
};

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

// The name of the marker under the pointer once it rests.
const RESTS_MS = 80;
const tip = document.createElement("div");
tip.id = "addb-pointed";
tip.setAttribute("role", "status");
document.body.append(tip);
let resting = null, rest = { x: 0, y: 0 }, rests = 0;
document.addEventListener("pointermove", (event) => {
  clearTimeout(resting);
  rests += 1;
  tip.textContent = "";
  if (event.buttons || event.target.tagName !== "CANVAS" || !event.target.closest("#root")) return;
  const { left, top } = event.target.getBoundingClientRect();
  rest = { x: event.clientX, y: event.clientY };
  resting = setTimeout(() => window.addb.send("point", [rest.x - left, rest.y - top, rests]), RESTS_MS);
});
window.addb.on("pointed", ([words, number]) => {
  if (number !== rests) return;
  tip.textContent = words;
  tip.style.translate = `${rest.x + 12}px ${rest.y - 24}px`;
});
