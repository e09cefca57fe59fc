// Clicks and drags on the timeline, and clicks on the lists, become a text in the box "Go to": "57" goes to a frame,
// "120–179" selects frames, "#3" opens a row of the queue. Whoever types there gets the same.
(() => {
  const FEWEST_PIXELS = 4; // of a drag; less is a click

  const box = () => {
    const label = [...document.querySelectorAll("label, p, div")].find(
      (e) => e.childElementCount === 0 && e.textContent === "Go to",
    );
    for (let e = label, i = 0; e && i < 5; e = e.parentElement, i++) {
      const input = e.querySelector?.("input");
      if (input) return input;
    }
    return null;
  };
  const write = (text) => {
    const input = box();
    if (!input) return;
    const set = Object.getOwnPropertyDescriptor(HTMLInputElement.prototype, "value").set;
    for (const value of ["", text]) {
      set.call(input, value);
      input.dispatchEvent(new Event("input", { bubbles: true }));
    }
  };
  const frameAt = (timeline, x) => {
    const { first, last, gutter, margin } = timeline.dataset;
    const place = timeline.getBoundingClientRect();
    const width = place.width - gutter - margin;
    const share = (x - place.left - gutter) / Math.max(width, 1);
    const frame = Math.round(+first + share * (last - first));
    return Math.min(Math.max(frame, +first), +last);
  };

  let drag = null;
  const mark = (x) => {
    const place = drag.timeline.getBoundingClientRect();
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
      const timeline = event.target.closest?.("[data-addb-timeline]");
      if (!timeline || event.button !== 0) return;
      const element = document.createElement("div");
      element.style.cssText =
        "position:fixed;z-index:9999;pointer-events:none;background:rgba(86,180,233,.3);width:0";
      document.body.appendChild(element);
      drag = { timeline, x: event.clientX, frame: frameAt(timeline, event.clientX), mark: element };
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
      const { timeline, x, frame } = drag;
      end();
      document.activeElement?.blur?.();
      const to = frameAt(timeline, event.clientX);
      if (Math.abs(event.clientX - x) < FEWEST_PIXELS) write(`${frame}`);
      else write(`${Math.min(frame, to)}–${Math.max(frame, to)}`);
    },
    true,
  );
  // A click into the scene that turns nothing drops the selection; while something is typed it only ends that.
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
      if (pressed && moved < FEWEST_PIXELS) write("-");
      pressed = null;
    },
    true,
  );
  document.addEventListener("click", (event) => {
    const piece = event.target.closest?.("[data-addb-go-to]");
    if (piece) write(piece.dataset.addbGoTo);
  });
})();
