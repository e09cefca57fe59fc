// Clicks on lists and clicks and drags on charts go to the server as the box "Go to" takes them: "57" goes to a frame,
// "120–179" selects frames, "#3" opens a row of the queue, "-" drops the selection.
const FEWEST_PIXELS = 4; // of a drag; less is a click
const goTo = (text) => window.addb.send("go_to", text);

const frameAt = (charts, x) => {
  const { first, last, gutter, margin } = charts.dataset;
  const place = charts.getBoundingClientRect();
  const share = (x - place.left - gutter) / Math.max(place.width - gutter - margin, 1);
  return Math.min(Math.max(Math.round(+first + share * (last - first)), +first), +last);
};

let drag = null;
const mark = (x) => {
  const place = drag.charts.getBoundingClientRect();
  const left = Math.min(drag.x, x), right = Math.max(drag.x, x);
  Object.assign(drag.mark.style, {
    left: `${left}px`, width: `${right - left}px`, top: `${place.top}px`, height: `${place.height}px`,
  });
};
const end = () => {
  drag?.mark.remove();
  drag = null;
};
document.addEventListener(
  "pointerdown",
  (event) => {
    const charts = event.target.closest?.("[data-addb-charts]");
    if (!charts || event.button !== 0) return;
    const element = document.createElement("div");
    element.style.cssText = "position:fixed;z-index:9999;pointer-events:none;background:rgba(86,180,233,.3);width:0";
    document.body.appendChild(element);
    drag = { charts, x: event.clientX, frame: frameAt(charts, event.clientX), mark: element };
    event.preventDefault();
  },
  true,
);
document.addEventListener("pointermove", (event) => drag && mark(event.clientX), true);
document.addEventListener("pointercancel", end, true);
document.addEventListener(
  "pointerup",
  (event) => {
    if (!drag) return;
    const { charts, x, frame } = drag;
    end();
    document.activeElement?.blur?.();
    const to = frameAt(charts, event.clientX);
    if (Math.abs(event.clientX - x) < FEWEST_PIXELS) goTo(`${frame}`);
    else goTo(`${Math.min(frame, to)}–${Math.max(frame, to)}`);
  },
  true,
);
// A click into the scene that turns nothing drops the selection, or measures; while something is typed it only ends that.
let measuring = false;
window.addb.on("measuring", (on) => (measuring = on));
let pressed = null;
document.addEventListener(
  "pointerdown",
  (event) => {
    const typing = ["INPUT", "TEXTAREA"].includes(document.activeElement?.tagName);
    const scene = event.button === 0 && event.target.tagName === "CANVAS" && !typing;
    pressed = scene ? { x: event.clientX, y: event.clientY } : null;
  },
  true,
);
document.addEventListener(
  "pointerup",
  (event) => {
    const moved = pressed && Math.hypot(event.clientX - pressed.x, event.clientY - pressed.y);
    if (pressed && moved < FEWEST_PIXELS) {
      const { left, top } = event.target.getBoundingClientRect();
      if (measuring) window.addb.send("pick", [event.clientX - left, event.clientY - top]);
      else goTo("-");
    }
    pressed = null;
  },
  true,
);
document.addEventListener("click", (event) => {
  const piece = event.target.closest?.("[data-addb-go-to]");
  if (piece) goTo(piece.dataset.addbGoTo);
});
