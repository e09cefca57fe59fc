// The timeline at the lower edge. Rows, curves and the trial come once; cursor, pointer, zoom, pan and drag stay here,
// and only what was decided by them goes to the server: a frame, a range, another border of a flag.
import { strip } from "./bar.js";
import { drawCurves, titles, told } from "./curves.js";
import { element, isTyped } from "./elements.js";
import { heightOf, rowOf } from "./rows.js";

const GUTTER = 96, MARGIN = 12, AXIS = 16, BAR = 30, EDGE = 2; // [pixel]; as in strip.css
const FEWEST_PIXELS = 4; // of a drag; less is a click
const FEWEST_FRAMES = 8; // that zoom leaves
const TICK_PIXELS = 130;
const WAITED_MS = 2000; // for the server's word on a frame that the cursor went to ahead of it

const make = (id, parent, tag = "div", options = {}) => {
  const made = element(tag, { id, ...options });
  parent.append(made);
  return made;
};
const area = element("section", {
  id: "addb-timeline",
  tabIndex: 0,
  "aria-label": "Timeline: plus and minus zoom, the keys of the app move, select and flag",
  dataset: { addbTimeline: "", gutter: GUTTER, margin: MARGIN },
});
const grip = element("div", { id: "addb-grip", title: "Drag: height of the timeline" });
strip.prepend(grip, area);
const rowsBox = make("addb-rows", area);
const canvas = make("addb-curves", area, "canvas");
const over = make("addb-over", area);
const selectionMark = make("addb-selection", over, "div", { dataset: { addbSelection: "" } });
const pointerMark = make("addb-pointer", over);
const cursorMark = make("addb-cursor", over, "div", { dataset: { addbCursor: "" } });
const values = make("addb-values", area);
const axis = make("addb-axis", area);
const readout = make("addb-readout", strip);
readout.hidden = pointerMark.hidden = selectionMark.hidden = true;

let trial = null, rows = [], curves = [], selection = null, frame = 0;
let plays = false, said = 0, ahead = [], waiting = 0; // frames that the cursor went to ahead of the server, which has said one
let span = { first: 0, last: 1 };
let extra = Number(localStorage.getItem("addb-timeline-height")) || 0; // [pixel] of the curves, chosen by hand

const watchers = [];
/** What else is drawn over these frames: called after each change of the frames shown, and of the marks over them. */
export const watch = (drawn, marked) => watchers.push({ drawn, marked });
export const view = () => ({ trial, span, frame, selection });

const width = () => Math.max(area.clientWidth - GUTTER - MARGIN, 1);
const share = (at) => (at - span.first) / Math.max(span.last - span.first, 1e-6);
const x = (at) => GUTTER + width() * share(at);
const frameAt = (clientX, inside = true) => {
  const at = span.first + ((clientX - area.getBoundingClientRect().left - GUTTER) / width()) * (span.last - span.first);
  const low = inside ? Math.ceil(span.first) : 0, high = inside ? Math.floor(span.last) : trial.frames - 1;
  return Math.min(Math.max(Math.round(at), low), high);
};
const rowsHeight = () => rows.reduce((sum, row) => sum + heightOf(row), 0);
const place = () => ({
  left: GUTTER,
  width: width(),
  top: rowsHeight() + 2,
  height: Math.max(area.clientHeight - rowsHeight() - AXIS - 2, 0),
});

function layout() {
  const usual = Math.min(Math.max((innerHeight - 440) * 0.13, 38), 110);
  const wanted = rowsHeight() + (extra || curves.length * usual) + AXIS + 2;
  const height = `${Math.round(BAR + Math.min(wanted, 0.6 * innerHeight))}px`, page = document.documentElement.style;
  if (page.getPropertyValue("--addb-strip") !== height) {
    page.setProperty("--addb-strip", height);
    requestAnimationFrame(() => window.dispatchEvent(new Event("resize"))); // viser's panels measure themselves anew
  }
  draw();
}

function draw() {
  if (!trial) return;
  area.dataset.first = Math.ceil(span.first);
  area.dataset.last = Math.floor(span.last);
  for (const block of area.querySelectorAll(".addb-block")) put(block, +block.dataset.start, +block.dataset.end);
  drawCurves(canvas, curves, place(), x, span);
  drawAxis();
  for (const { drawn } of watchers) drawn();
  drawMarks();
}

function put(block, start, end) {
  const left = share(start - 0.5), right = share(end - 0.5);
  block.hidden = right <= 0 || left >= 1;
  const [from, to] = [Math.max(left, -EDGE / width()), Math.min(right, 1 + EDGE / width())];
  block.style.left = `${100 * from}%`;
  block.style.width = `${100 * (to - from)}%`;
}

function drawAxis() {
  const most = Math.max(width() / TICK_PIXELS, 1);
  const step = [1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000, 20000, 50000].find((s) => (span.last - span.first) / s <= most) ?? 100000;
  const ticks = [];
  for (let at = Math.ceil(span.first / step) * step; at <= span.last; at += step) {
    const shift = x(at) < GUTTER + TICK_PIXELS / 2 ? 0 : x(at) > GUTTER + width() - TICK_PIXELS / 2 ? -100 : -50;
    const style = { left: `${x(at)}px`, transform: `translateX(${shift}%)` };
    ticks.push(element("span", { style, title: `${time(at)} s` }, ticks.length ? `${at}` : `frame ${at}`));
  }
  axis.replaceChildren(...ticks);
}

const time = (at) => (trial.first_s + at / trial.rate).toFixed(2);

function drawMarks() {
  for (const { marked } of watchers) marked();
  cursorMark.style.left = `${100 * share(frame)}%`;
  selectionMark.hidden = !selection;
  if (selection) put(selectionMark, ...selection);
  values.replaceChildren(
    ...titles(curves, place()).map(({ top, curve }) => {
      const title = element("span", {}, `${curve.title} [${curve.unit}]${curve.bound_label ? `, dashed: ${curve.bound_label}` : ""}`);
      const before = curve.before ? `${told(curve.before[frame])} → ` : "";
      const value = element("b", {}, `${before}${told(curve.values[frame])} ${curve.unit}`);
      return element("div", { className: "addb-title", style: { top: `${top}px` } }, title, value);
    }),
  );
}

// What the server says.
window.addb.on("trial", (told) => {
  const same = trial?.trial === told.trial && trial.subject === told.subject && trial.frames === told.frames;
  trial = told;
  if (!same) {
    span = { first: 0, last: Math.max(trial.frames - 1, 1) };
    frame = 0;
    ahead = [];
    readout.hidden = pointerMark.hidden = true; // they were about another one
  }
  layout();
});
window.addb.on("rows", (told) => {
  rows = told;
  rowsBox.replaceChildren(...rows.map(rowOf));
  layout();
});
window.addb.on("curves", (told) => {
  curves = told;
  layout();
});
window.addb.on("selection", (told) => {
  selection = told;
  if (!drag) drawMarks();
});
window.addb.on("plays", (speed) => (plays = speed !== 0));
window.addb.on("cursor", (told) => {
  said = told;
  if (scrubbing) return;
  const behind = ahead.indexOf(told);
  if (behind >= 0 && behind < ahead.length - 1) ahead.splice(0, behind + 1);
  else obey();
});

// A key that steps moves the cursor at once. What the server then says of steps that lie behind is passed over; where it
// says another frame, or nothing, it is right.
export function stepAhead({ frames, seconds }) {
  if (!trial || plays || scrubbing) return;
  const by = frames || Math.sign(seconds) * Math.max(1, Math.round(Math.abs(seconds) * trial.rate));
  goAhead(Math.min(Math.max(frame + by, 0), trial.frames - 1));
}
function goAhead(to) {
  if (to === frame) return;
  ahead.push(to);
  clearTimeout(waiting);
  waiting = setTimeout(obey, WAITED_MS);
  moveTo(to);
}
function obey() {
  clearTimeout(waiting);
  ahead = [];
  if (!scrubbing) moveTo(said);
}
function moveTo(to) {
  frame = to;
  if (trial && (frame < span.first || frame > span.last)) look(frame - 0.1 * (span.last - span.first));
  else drawMarks();
}

// Zoom and pan.
export function look(first, length = span.last - span.first) {
  const whole = Math.max(trial.frames - 1, 1), shown = Math.min(Math.max(length, FEWEST_FRAMES), whole);
  const from = Math.min(Math.max(first, 0), whole - shown);
  span = { first: from, last: from + shown };
  draw();
}
export function zoom(factor, around) {
  const length = span.last - span.first;
  look(around - (around - span.first) * factor, length * factor);
}
area.addEventListener(
  "wheel",
  (event) => {
    event.preventDefault();
    if (!trial) return;
    const length = span.last - span.first;
    const sideways = event.shiftKey ? event.deltaY : event.deltaX;
    if (Math.abs(sideways) > Math.abs(event.shiftKey ? 0 : event.deltaY)) look(span.first + (sideways / width()) * length);
    else zoom(1.0015 ** event.deltaY, frameAt(event.clientX));
  },
  { passive: false },
);
window.addEventListener(
  "keydown",
  (event) => {
    const factor = { "+": 0.6, "-": 1 / 0.6 }[event.key];
    if (!trial || isTyped(event) || !factor || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    event.stopImmediatePropagation();
    zoom(factor, frame);
  },
  true,
);

// Click, drag, borders.
let drag = null, scrubbing = false;
const ranged = (a, b) => [Math.min(a, b), Math.max(a, b) + 1];
area.addEventListener("pointerdown", (event) => {
  if (!trial || event.button > 1) return;
  const at = frameAt(event.clientX);
  const bar = event.target.closest(".addb-block");
  drag = { x: event.clientX, frame: at, first: span.first, bar, kind: "range" };
  if (event.button === 1) drag.kind = "pan";
  else if (axis.contains(event.target)) drag.kind = "scrub";
  else if (event.target.classList.contains("addb-edge")) drag.kind = event.target.dataset.side;
  else if (selection && !bar) {
    const near = (side) => Math.abs(x(side - 0.5) - (event.clientX - area.getBoundingClientRect().left)) < 5;
    const [start, end] = selection;
    if (near(start)) Object.assign(drag, { frame: end - 1 });
    else if (near(end)) Object.assign(drag, { frame: start });
  }
  area.setPointerCapture(event.pointerId);
  event.preventDefault();
  document.activeElement?.blur?.();
});
area.addEventListener("pointermove", (event) => {
  if (!trial) return;
  const at = frameAt(event.clientX);
  if (!drag) return point(event, at);
  readout.hidden = true;
  if (drag.kind === "pan") look(drag.first - ((event.clientX - drag.x) / width()) * (span.last - span.first));
  else if (drag.kind === "scrub") scrub(at);
  else if (drag.kind === "range") {
    if (Math.abs(event.clientX - drag.x) < FEWEST_PIXELS) return;
    selectionMark.hidden = false;
    put(selectionMark, ...ranged(drag.frame, at));
  } else put(drag.bar, ...bordered(drag, at));
});
const bordered = ({ bar, kind }, at) => {
  const { start, end } = bar.block;
  return kind === "start" ? [Math.min(at, end - 1), end] : [start, Math.max(at + 1, start + 1)];
};
let sent = 0;
function scrub(at) {
  scrubbing = true;
  frame = at;
  drawMarks();
  if (performance.now() - sent < 30) return;
  sent = performance.now();
  window.addb.send("go_to", `${at}`);
}
area.addEventListener("pointerup", (event) => {
  if (!drag) return;
  const done = drag, at = frameAt(event.clientX), clicked = Math.abs(event.clientX - done.x) < FEWEST_PIXELS;
  drag = null;
  scrubbing = false;
  if (done.kind === "pan") return;
  if (done.kind === "scrub" || (clicked && !done.bar)) {
    goAhead(at);
    window.addb.send("go_to", `${at}`);
  } else if (clicked) {
    const { start, end, foot } = done.bar.block;
    if (done.bar.dataset.foot) window.addb.send("select", { start, end, foot });
    else window.addb.send("go_to", `${start}:${end}`);
  } else if (done.kind === "range") {
    selection = ranged(done.frame, at);
    drawMarks();
    window.addb.send("go_to", selection.join(":"));
  } else {
    const { start, end, foot } = done.bar.block;
    window.addb.send("border", { start, end, foot, to: bordered(done, at) });
  }
});
area.addEventListener("pointercancel", () => {
  drag = null;
  scrubbing = false;
  draw();
});

function point(event, at) {
  const left = event.clientX - area.getBoundingClientRect().left;
  const outside = left < GUTTER || left > area.clientWidth - MARGIN;
  readout.hidden = pointerMark.hidden = outside;
  if (outside) return;
  pointerMark.style.left = `${100 * share(at)}%`;
  const block = event.target.closest(".addb-block")?.block;
  const lines = [`frame ${at} · ${time(at)} s`];
  if (block) lines.push(`${block.start}–${block.end - 1}: ${block.told}`);
  for (const curve of curves) lines.push(`${curve.title}: ${told(curve.values[at])} ${curve.unit}`);
  readout.textContent = lines.join("\n");
  const right = left > area.clientWidth / 2;
  readout.style.left = right ? "auto" : `${left + 14}px`;
  readout.style.right = right ? `${area.clientWidth - left + 14}px` : "auto";
  readout.style.bottom = `${innerHeight - event.clientY + 10}px`;
}
area.addEventListener("pointerleave", () => (readout.hidden = pointerMark.hidden = true));

grip.addEventListener("pointerdown", (event) => {
  grip.setPointerCapture(event.pointerId);
  const from = event.clientY, height = place().height;
  grip.onpointermove = (moved) => {
    extra = Math.max(height + from - moved.clientY, 30);
    layout();
  };
  grip.onpointerup = () => {
    grip.onpointermove = grip.onpointerup = null;
    localStorage.setItem("addb-timeline-height", String(Math.round(extra)));
  };
});
window.addEventListener("resize", layout);
window.addb.on("theme", draw);
