// The tab "Curves": quantities are chosen here and come from the server; cursor, zoom and read-out stay here. viser makes
// the tab, with a place for us in it that comes and goes.
import { makeChooser, takeAway } from "./chooser.js";
import { told, toldWith } from "./curves.js";
import { element, keepIn } from "./elements.js";
import { dashOf, drawByCycle, drawOverTime, GUTTER, MARGIN, niceTicks, tickText } from "./multiples.js";
import { makeOptions } from "./options.js";
import { view, watch, zoom } from "./timeline.js";

const LOWEST = 46, HIGHEST = 170, HEADING = 19, AXIS = 20; // [pixel]
let charts = [], cycles = null; // cycles: the strides of each foot [s], where charts are by gait cycle
let pointer = null; // the frame, or the percent of the cycle, under it; null: elsewhere
let choice = { chosen: [], by: "time", over: [], per_kg: false };
const choose = (part) => window.addb.send("curves", { ...choice, ...part });
const chooser = makeChooser((chosen) => choose({ chosen }));
const options = makeOptions(choose);
const note = element("p", { id: "addb-curve-note" });
const plots = element("div", { id: "addb-plots" });
const axis = element("div", { id: "addb-plots-axis" });
const cursors = element("div", { id: "addb-plots-cursor" }), band = element("div", { id: "addb-plots-selection", hidden: true });
const pointed = element("div", { id: "addb-plots-pointer", hidden: true });
const where = element("div", { id: "addb-plots-where" });
const area = element("div", { id: "addb-plots-area", dataset: { gutter: GUTTER, margin: MARGIN } }, plots, band, pointed, cursors, axis, where);
const root = element("section", { id: "addb-charts", "aria-label": "Curves" }, ...chooser.parts, options.part, note, area);

const width = () => Math.max(plots.clientWidth - GUTTER - MARGIN, 1);
const shown = () => (cycles ? { first: 0, last: 100 } : view().span);
const share = (at) => (at - shown().first) / Math.max(shown().last - shown().first, 1e-6);
const x = (at) => GUTTER + width() * share(at);
const dashes = (trial) => dashOf(options.numberOf(trial));

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
      const title = `${chart.title} [${chart.unit}]`, name = element("b", { title: [title, chart.band].filter(Boolean).join("\n") }, title), values = element("span", { className: "addb-plot-values" });
      const canvas = element("canvas", { role: "img", "aria-label": `${chart.title} ${cycles ? "by gait cycle, mean and standard deviation" : "over time"}` });
      const gone = takeAway(chart.title, "×", () => chooser.toggle(chart.id));
      const keys = chart.lines.filter(({ label, style, trial }) => label && style !== "before" && !trial).map(key);
      if (chart.lines.some(({ style }) => style === "before")) keys.push(key({ label: "before", color: "inherit", style: "before" }));
      if (chart.band) keys.push(key({ label: "95 %", color: "inherit", style: "band", why: chart.band }));
      return element("figure", {}, element("figcaption", {}, name, element("span", { className: "addb-plot-keys" }, ...keys), values, gone), canvas);
    }),
  );
  draw();
}
const key = ({ label, short, color, style, count, why }) => {
  const sample = element("i", { className: `addb-key ${style}`, style: { borderColor: color } });
  const made = element("span", {}, sample, count === undefined ? (short ?? label) : `${label} (${count})`);
  if (why ?? (short !== undefined && short !== label)) made.title = why ?? label;
  return made;
};

function draw() {
  const { trial, span } = view();
  if (!trial || !root.isConnected || !plots.clientWidth) return;
  if (cycles) delete area.dataset.addbCharts;
  else Object.assign(area.dataset, { addbCharts: "", first: Math.ceil(span.first), last: Math.floor(span.last) });
  const height = `${heightOfOne()}px`;
  charts.forEach((chart, i) => {
    const canvas = plots.children[i].querySelector("canvas");
    if (canvas.style.height !== height) canvas.style.height = height;
    if (cycles) drawByCycle(canvas, chart, dashes);
    else drawOverTime(canvas, chart, span, dashes);
  });
  const second = (frame) => trial.first_s + frame / trial.rate;
  const [start, end] = cycles ? [0, 100] : [second(span.first), second(span.last)];
  axis.replaceChildren(
    ...niceTicks(start, end, Math.max(width() / 90, 2)).map((at) => {
      const share = (at - start) / (end - start);
      const style = { left: `${GUTTER + width() * share}px`, transform: share > 0.96 ? "translateX(-100%)" : "" };
      return element("span", { style }, tickText(at, end - start));
    }),
    element("span", { className: "addb-axis-name", textContent: cycles ? "%" : "s", title: cycles ? "of the stride" : "" }),
  );
  axis.hidden = !charts.length;
  mark();
}

/** The percent of its stride that the cursor is at; null outside the strides of that foot. */
function percentOf(side, frame) {
  const { trial } = view(), time = trial.first_s + frame / trial.rate;
  const stride = cycles[side].find(([start, end]) => start <= time && time < end);
  return stride ? (100 * (time - stride[0])) / (stride[1] - stride[0]) : null;
}

function mark() {
  const { trial, frame, selection } = view();
  if (!trial || !root.isConnected) return;
  const places = cycles ? ["right", "left"].map((side) => [side, percentOf(side, frame)]) : [["", frame]];
  cursors.replaceChildren(
    ...places
      .filter(([, at]) => at !== null && share(at) >= 0 && share(at) <= 1 && charts.length)
      .map(([side, at]) => {
        const borderColor = charts.flatMap(({ lines }) => lines).find(({ label }) => side && label === side)?.color ?? "";
        return element("i", { style: { left: `${x(at)}px`, borderColor } });
      }),
  );
  tellWhere(trial, pointer ?? (cycles ? null : frame));
  pointed.hidden = pointer === null;
  if (pointer !== null) pointed.style.left = `${x(pointer)}px`;
  band.hidden = !selection || cycles || !charts.length;
  if (!band.hidden) {
    const [left, right] = selection.map((at) => Math.min(Math.max(x(at - 0.5), GUTTER), GUTTER + width()));
    Object.assign(band.style, { left: `${left}px`, width: `${Math.max(right - left, 0)}px` });
  }
  charts.forEach((chart, i) => plots.children[i]?.querySelector(".addb-plot-values").replaceChildren(...valuesOf(chart, frame)));
}

/** Frame and time, or percent of the stride, under the pointer, else at the cursor; kept inside the axis. */
function tellWhere(trial, at) {
  where.hidden = at === null || share(at) < 0 || share(at) > 1 || !charts.length;
  if (where.hidden) return;
  where.textContent = cycles ? `${at} %` : `frame ${at} · ${(trial.first_s + at / trial.rate).toFixed(3)} s`;
  where.style.left = `${x(at)}px`;
  where.style.transform = `translateX(${share(at) < 0.15 ? 0 : share(at) > 0.85 ? -100 : -50}%)`;
}

/** What stands at a chart's right: values under the pointer, else at the cursor. */
function valuesOf(chart, frame) {
  const beforeOf = ({ color }) => chart.lines.find((line) => line.style === "before" && line.color === color);
  const solid = chart.lines.filter(({ style }) => !["bound", "trial", "before"].includes(style)), paired = solid.map(beforeOf);
  const lines = chart.lines.filter((line) => solid.includes(line) || (line.style === "before" && !paired.includes(line)));
  return lines.flatMap((line) => {
    const at = cycles ? (pointer ?? percentOf(line.label, frame)) : (pointer ?? frame);
    if (at === null) return [];
    const k = cycles ? Math.round(at) : Math.round((at - line.first) / line.step), value = (line.mean ?? line.values)[k], spread = (pointer === null ? null : (line.band ?? line.std)?.[k]) ?? null;
    const before = line.style === "before" ? null : beforeOf(line), then = before?.mean ?? before?.values;
    const words = (then ? `${told(then[k])} → ` : "") + (spread === null ? told(value, line.digits) : toldWith(value, spread));
    const counts = cycles || !chart.shaded.some(([start, end]) => start <= at && at < end);
    return [element("span", { textContent: words, title: counts ? "" : "not measured, or not counted", style: { color: counts ? line.ink : "var(--addb-weak)" } })];
  });
}

watch(draw, mark);
window.addb.on("curve-choices", (heard) => {
  choice = { chosen: heard.chosen, by: heard.by, over: heard.over, per_kg: heard.per_kg };
  chooser.show(heard);
  options.show(heard);
});
window.addb.on("curve-charts", (heard) => {
  charts = heard.charts;
  cycles = heard.strides ?? null;
  pointer = null;
  note.textContent = heard.note;
  options.drawn(heard.over);
  chooser.drawn(charts.map(({ id }) => id));
  build();
});
area.addEventListener("pointermove", (event) => {
  const left = event.clientX - plots.getBoundingClientRect().left - GUTTER, { first, last } = shown();
  const inside = view().trial && charts.length && left >= 0 && left <= width();
  pointer = inside ? Math.round(first + (left / width()) * (last - first)) : null;
  mark();
});
area.addEventListener("click", () => {
  if (!cycles || pointer === null) return;
  const { trial, frame } = view(), time = trial.first_s + frame / trial.rate;
  const strides = cycles.right.length ? cycles.right : cycles.left;
  const [start, end] = strides.findLast(([begin]) => begin <= time) ?? strides[0] ?? [];
  if (start !== undefined) window.addb.send("go_to", `${Math.round((start + (pointer / 100) * (end - start) - trial.first_s) * trial.rate)}`);
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
    if (pointer !== null && !cycles) zoom(1.0015 ** event.deltaY, pointer);
  },
  { passive: false },
);
new ResizeObserver(draw).observe(plots);
window.addEventListener("resize", draw);
window.addb.on("theme", draw);
keepIn("[data-addb-curves]", root, draw);
