// Clicks on lists and in the scene go to the server as the box "Go to" takes them: "57" goes to a frame, "120–179" selects
// frames, "#3" opens a row of the queue, "-" drops the selection.
const FEWEST_PIXELS = 4; // of a drag; less is a click
const goTo = (text) => window.addb.send("go_to", text);

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
