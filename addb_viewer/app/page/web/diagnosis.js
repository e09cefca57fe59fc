// The tab "Diagnosis" on one screen: verdict, before and after, one card a cause. viser makes the tab, with a place
// for us in it that comes and goes. Everything that is shown is set as text.
import { button as plain, element, keepIn } from "./elements.js";
import { view, watch } from "./timeline.js";

const WIDE = 400, HIGH = 60; // of a curve's own coordinates
const SVG = "http://www.w3.org/2000/svg";
let state = null, picture = null;
const head = element("div"), drawn = element("div", { id: "addb-before-after" }), cards = element("div");
const root = element("section", { id: "addb-diagnosis", "aria-label": "Diagnosis" }, head, drawn, cards);

const say = (does, card) => window.addb.send("cause", [does, card.key]);
const button = (text, act, { title = "", off = false, name = text } = {}) => plain(text, act, { title, disabled: off, "aria-label": name });
const line = (className, text, title = text) => (text ? [element("p", { className, textContent: text, title })] : []);

function verdict({ verdict: { sign, word, color, ink }, text, use, changed, fit, fit_again }) {
  const mark = element("i", { style: { background: color, color: ink } }, sign);
  const again = button("Diagnose again", () => window.addb.send("do", "diagnose"), { title: "Key X" });
  const solve = fit_again ? [button("Solve again", () => window.addb.send("do", "solve"), { title: "Key G" })] : [];
  const head = element("h3", {}, mark, word, element("small", { textContent: fit_again ? "not in the fit" : fit, title: fit }), ...solve, again);
  const box = element("header", { style: { borderColor: color } }, head, ...line("text", text), ...line("text", use));
  if (changed.length) box.append(...line("warn", `⚠ Out of date. Changed since: ${changed.join(", ")}. Diagnose again.`));
  return box;
}

function card(of, i) {
  const name = `cause ${i + 1}, ${of.title}`;
  const flag = of.flags.length > 1 ? `Flag these ${of.flags.length} ranges` : "Flag these frames";
  const keys = [
    ...(of.goes ? [button("Go to", () => say("go", of), { title: "The frame where it begins", name: `Go to ${name}` })] : []),
    ...(of.flags.length
      ? [
          button(of.flagged ? "✓ Flagged" : flag, () => say("flag", of), {
            title: `No fit uses them then. ${of.flags.join("; ")}`,
            off: of.flagged,
            name: `${flag}: ${name}`,
          }),
        ]
      : []),
    button("Accept", () => say("accept", of), {
      title: of.why_not || "Later fits use this cause beside the forces; what was decided about others stays",
      off: !of.can_accept,
      name: `Accept ${name}`,
    }),
    button("Reject", () => say("reject", of), {
      title: "Later fits do without this cause; what was decided about others stays",
      off: !of.can_reject,
      name: `Reject ${name}`,
    }),
  ];
  const decided = element("span", { className: `decided ${of.standing}`, textContent: of.decided, title: `${of.decided}, ${of.when}` });
  return element(
    "article",
    { "aria-label": name },
    element("h4", {}, element("b", { textContent: `${i + 1} · ${of.title}`, title: of.title }), element("span", { textContent: of.sure, title: of.certainty })),
    ...line("size", of.size, of.sizes),
    ...line("else", of.else && `or else: ${of.else}`),
    ...line("todo", of.todo),
    element("div", { className: "keys" }, ...keys, decided),
  );
}

const shape = (tag, attributes) => {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, value);
  return made;
};
const figure = (value) => (value === null ? "–" : value.toFixed(value < 9.95 ? 1 : 0));
const across = (at) => (WIDE * at) / Math.max(picture.last, 1);

/** The path of a curve that is broken where nothing is known; down to the axis where it is to be filled. */
function path(values, most, filled) {
  const up = (value) => (HIGH * (1 - value / most)).toFixed(2);
  const pieces = [];
  let piece = [];
  for (const point of [...values, null]) {
    if (point) piece.push(point);
    else if (piece.length) {
      const along = piece.map(([at, value]) => `${across(at).toFixed(2)},${up(value)}`).join("L");
      const ends = `L${across(piece.at(-1)[0]).toFixed(2)},${HIGH}L${across(piece[0][0]).toFixed(2)},${HIGH}Z`;
      pieces.push(`M${along}${filled ? ends : ""}`);
      piece = [];
    }
  }
  return pieces.join("");
}

function chart({ title, unit, lines }) {
  const most = Math.max(...lines.flatMap(({ values }) => values.map((point) => point?.[1] ?? 0)), 1e-9);
  const svg = shape("svg", { viewBox: `0 0 ${WIDE} ${HIGH}`, preserveAspectRatio: "none", role: "img" });
  for (const { color, dashed, values } of lines) {
    if (!dashed) svg.append(shape("path", { d: path(values, most, true), class: "area", style: `fill:${color}` }));
    svg.append(shape("path", { d: path(values, most), class: dashed ? "dashed" : "", style: `stroke:${color}` }));
  }
  svg.append(shape("line", { y1: 0, y2: HIGH, class: "cursor" }));
  const [before, ...others] = lines, after = others.find(({ dashed }) => !dashed), ordinary = lines.at(-1);
  const number = (of) => element("b", { style: { color: of.text } }, figure(of.rms));
  const words = element("figcaption", {}, `${title.replace("Residual ", "")} `, number(before), ...(after ? [" → ", number(after)] : []), ` ${unit}`);
  words.append(element("small", { textContent: ` usual ${figure(ordinary.rms)}` }));
  svg.setAttribute("aria-label", `${title} over time, as recorded${after ? " and with the named causes" : ""}: ${words.textContent}`);
  return element("figure", {}, words, svg);
}

function draw() {
  head.replaceChildren(...(state ? [verdict(state)] : []));
  cards.replaceChildren(...(state ? state.cards.map(card) : []));
  drawn.hidden = !picture || !state;
  if (drawn.hidden) return;
  const worst = button("Worst half second", () => window.addb.send("go_to", `${picture.worst}`), { title: "Go where it begins" });
  const charts = element("div", { className: "charts" }, ...picture.charts.map(chart));
  for (const drawing of charts.querySelectorAll("svg")) drawing.onclick = (event) => {
    const box = drawing.getBoundingClientRect();
    window.addb.send("go_to", `${Math.round((picture.last * (event.clientX - box.left)) / box.width)}`);
  };
  const after = picture.charts[0].lines.length > 2;
  const title = `Residual of ${picture.trial}${after ? ", before → after" : ""}`;
  const meaning = "Root mean squares. Before: as recorded; after: with the named causes; usual: what a good recording shows";
  drawn.replaceChildren(element("h4", {}, element("b", { textContent: title, title: meaning }), worst), charts);
  mark();
}
const mark = () => {
  for (const cursor of picture ? drawn.querySelectorAll(".cursor") : []) {
    cursor.setAttribute("x1", across(view().frame));
    cursor.setAttribute("x2", across(view().frame));
  }
};

window.addb.on("diagnosis", (news) => {
  state = news;
  draw();
});
window.addb.on("diagnosis-picture", (news) => {
  picture = news;
  draw();
});
watch(() => {}, mark);
keepIn("[data-addb-diagnosis]", root);
