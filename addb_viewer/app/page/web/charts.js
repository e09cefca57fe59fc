// The tab "Curves": quantities are chosen here and come from the server; cursor, zoom and read-out stay here. viser makes
// the tab, with a place for us in it that comes and goes.
import { makeChooser } from "./chooser.js";
import { told } from "./curves.js";
import { dashOf, drawOverTime, GUTTER, MARGIN, niceTicks, tickText } from "./multiples.js";
import { view, watch, zoom } from "./timeline.js";

const LOWEST = 58, HIGHEST = 170, HEADING = 19, AXIS = 20; // [pixel]
const element = (tag, options = {}, ...children) => {
  const made = Object.assign(document.createElement(tag), options);
  made.append(...children);
  return made;
};
let charts = [], pointer = null; // pointer: the frame under it; null: elsewhere
const chooser = makeChooser((chosen) => window.addb.send("curves", { chosen }));
const plots = element("div", { id: "addb-plots" });
const axis = element("div", { id: "addb-plots-axis" });
const cursor = element("div", { id: "addb-plots-cursor" }), band = element("div", { id: "addb-plots-selection", hidden: true });
const pointed = element("div", { id: "addb-plots-pointer", hidden: true });
const area = element("div", { id: "addb-plots-area" }, plots, band, pointed, cursor, axis);
Object.assign(area.dataset, { gutter: GUTTER, margin: MARGIN });
const root = element("section", { id: "addb-charts" }, ...chooser.parts, area);
root.setAttribute("aria-label", "Curves");

const width = () => Math.max(plots.clientWidth - GUTTER - MARGIN, 1);
const share = (frame, { span }) => (frame - span.first) / Math.max(span.last - span.first, 1e-6);
const x = (frame, now) => GUTTER + width() * share(frame, now);

/** As high as lets all of them be seen, within bounds. */
function heightOfOne() {
  let top = plots.getBoundingClientRect().top; // as it is where nothing is scrolled
  for (let around = plots.parentElement; around; around = around.parentElement) top += around.scrollTop;
  const bottom = document.getElementById("addb-strip").getBoundingClientRect().top;
  const room = (bottom - top - AXIS - 14) / Math.max(charts.length, 1) - HEADING;
  return Math.round(Math.min(Math.max(room, LOWEST), HIGHEST));
}

function build() {
  plots.replaceChildren(
    ...charts.map((chart) => {
      const name = element("b", { textContent: `${chart.title} [${chart.unit}]` }), values = element("span", { className: "addb-plot-values" });
      const canvas = element("canvas");
      canvas.setAttribute("role", "img");
      canvas.setAttribute("aria-label", `${chart.title} over time`);
      return element("figure", {}, element("figcaption", {}, name, ...chart.lines.filter(isKeyed).map(key), values), canvas);
    }),
  );
  draw();
}
const isKeyed = ({ label, style, trial }) => label && style !== "trial" && !trial;
const key = ({ label, color, style }) => {
  const sample = element("i", { className: `addb-key ${style}` });
  sample.style.borderColor = color;
  return element("span", {}, sample, label);
};

function draw() {
  const now = view();
  if (!now.trial || !root.isConnected || !plots.clientWidth) return;
  Object.assign(area.dataset, { addbCharts: "", first: Math.ceil(now.span.first), last: Math.floor(now.span.last) });
  const height = `${heightOfOne()}px`;
  charts.forEach((chart, i) => {
    const canvas = plots.children[i].querySelector("canvas");
    if (canvas.style.height !== height) canvas.style.height = height;
    drawOverTime(canvas, chart, now.span, () => dashOf(0));
  });
  const second = (frame) => now.trial.first_s + frame / now.trial.rate;
  const [start, end] = [second(now.span.first), second(now.span.last)];
  axis.replaceChildren(
    ...niceTicks(start, end, Math.max(width() / 90, 2)).map((time) => {
      const tick = element("span", { textContent: tickText(time, end - start) });
      tick.style.left = `${GUTTER + (width() * (time - start)) / (end - start)}px`;
      return tick;
    }),
    element("span", { className: "addb-axis-name", textContent: "s" }),
  );
  mark();
}

function mark() {
  const now = view();
  if (!now.trial || !root.isConnected) return;
  const at = share(now.frame, now);
  cursor.hidden = at < 0 || at > 1 || !charts.length;
  cursor.style.left = `${x(now.frame, now)}px`;
  pointed.hidden = pointer === null;
  if (pointer !== null) pointed.style.left = `${x(pointer, now)}px`;
  band.hidden = !now.selection || !charts.length;
  if (now.selection) {
    const [left, right] = now.selection.map((frame) => Math.min(Math.max(x(frame - 0.5, now), GUTTER), GUTTER + width()));
    Object.assign(band.style, { left: `${left}px`, width: `${Math.max(right - left, 0)}px` });
  }
  const frame = pointer ?? now.frame;
  charts.forEach((chart, i) => {
    const values = plots.children[i]?.querySelector(".addb-plot-values");
    values?.replaceChildren(
      ...chart.lines.filter(({ style }) => style !== "bound").map((line) => {
        const value = element("span", { textContent: told(line.values[Math.round(frame / line.step)]) });
        value.style.color = line.ink;
        return value;
      }),
    );
  });
}

watch(draw, mark);
window.addb.on("curve-choices", chooser.show);
window.addb.on("curve-charts", (heard) => {
  charts = heard.charts;
  build();
});
area.addEventListener("pointermove", (event) => {
  const now = view(), left = event.clientX - plots.getBoundingClientRect().left - GUTTER;
  const inside = now.trial && charts.length && left >= 0 && left <= width();
  pointer = inside ? Math.round(now.span.first + (left / width()) * (now.span.last - now.span.first)) : null;
  mark();
});
area.addEventListener("pointerleave", () => {
  pointer = null;
  mark();
});
area.addEventListener(
  "wheel",
  (event) => {
    if (!event.ctrlKey && !event.metaKey) return; // the panel scrolls
    event.preventDefault();
    if (pointer !== null) zoom(1.0015 ** event.deltaY, pointer);
  },
  { passive: false },
);
new ResizeObserver(draw).observe(plots);
window.addEventListener("resize", draw);
new MutationObserver(draw).observe(document.documentElement, { attributeFilter: ["data-mantine-color-scheme"] });
const settle = () => {
  const place = document.querySelector("[data-addb-curves]");
  if (!place || place.contains(root)) return;
  place.append(root);
  draw();
};
new MutationObserver(settle).observe(document.body, { childList: true, subtree: true });
settle();
