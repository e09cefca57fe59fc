// The table: only the rows in sight are elements; they are used again while one scrolls.

import { element } from "/addb/elements.js";
import { at, button, make, put } from "./elements.js";
import { address, ago, key } from "./rows.js";

const HEIGHT = 40, SPARE = 6; // [pixel] of a row; rows beyond the sight
const COLUMNS = [
  ["state", "state"], ["trial", "trial"], [null, ""], ["verdict", "verdict"], ["activity", "activity"], ["assigned", "assigned"],
  ["last", "last edit"], ["comments", "comments", true],
];
const TOLD = {
  verdict: "What the trial is good for, and why. By what it is good for, the worst first; then by how much it needs a person: residual in units of its limit (Hicks et al. 2015), plus the shares left out and under open proposals, plus one where nobody has decided",
  comments: "Comments that are not settled",
};

export class Table {
  // `on`: select(row, event), all(), sort(column), comments(row); `look`: state(row), selected(row), me(), now()
  constructor(on, look) {
    this.on = on;
    this.look = look;
    this.rows = [];
    this.current = 0;
    this.version = 0;
    this.pool = [];
    this.scroll = at("scroll");
    this.space = at("space");
    this.scroll.addEventListener("scroll", () => this.ask(), { passive: true });
    this.scroll.addEventListener("keydown", (event) => this.keyed(event));
    new ResizeObserver(() => {
      this.version += 1; // strips are as wide as their column
      this.ask();
    }).observe(this.scroll);
    this.head();
  }

  head() {
    const onchange = () => this.on.all(this.box.checked);
    this.box = element("input", { type: "checkbox", "aria-label": "Select all that are shown", onchange });
    at("head").append(element("div", { role: "columnheader" }, this.box));
    this.heads = new Map();
    for (const [column, label, figure] of COLUMNS) {
      const head = column ? button(label, () => this.on.sort(column), { title: TOLD[column] ?? "" }) : legend();
      const told = { role: "columnheader", className: figure ? "cell figure" : "cell", dataset: column ? { column } : {} };
      at("head").append(element("div", told, head));
      if (column) this.heads.set(column, [head, label]);
    }
  }

  ordered(column, down) {
    for (const [name, [button, label]] of this.heads) {
      const cell = button.parentElement;
      if (name === column) cell.setAttribute("aria-sort", down ? "descending" : "ascending");
      else cell.removeAttribute("aria-sort");
      put(button, name === column ? `${label} ${down ? "↓" : "↑"}` : label);
    }
  }

  show(rows) {
    this.rows = rows;
    this.version += 1;
    this.current = Math.min(this.current, Math.max(rows.length - 1, 0));
    this.space.style.height = `${HEIGHT * rows.length}px`;
    at("table").setAttribute("aria-rowcount", String(rows.length + 1));
    const chosen = rows.filter((row) => this.look.selected(row)).length;
    this.box.checked = chosen > 0 && chosen === rows.length;
    this.box.indeterminate = chosen > 0 && chosen < rows.length;
    this.paint();
  }

  ask() {
    this.asked ??= requestAnimationFrame(() => {
      this.asked = undefined;
      this.paint();
    });
  }

  paint() {
    const first = Math.max(0, Math.floor(this.scroll.scrollTop / HEIGHT) - SPARE);
    const last = Math.min(this.rows.length, Math.ceil((this.scroll.scrollTop + this.scroll.clientHeight) / HEIGHT) + SPARE);
    while (this.pool.length < last - first) this.pool.push(this.line());
    this.pool.forEach((line, k) => {
      const place = first + ((k - (first % this.pool.length) + this.pool.length) % this.pool.length);
      line.element.hidden = place >= last;
      if (place >= last) return;
      line.element.classList.toggle("current", place === this.current);
      if (line.drawn === this.version && line.place === place) return; // only scrolled
      this.fill(line, this.rows[place], place);
      line.drawn = this.version;
    });
  }

  line() {
    const cells = {
      box: element("input", { type: "checkbox", onclick: (event) => this.on.select(line.row, event) }),
      link: make("a", "strong"), subject: make("span", "quiet"), canvas: make("canvas"), use: make("b"), why: make("span"),
      who: make("span"), when: make("span", "quiet"),
      comments: button("", () => this.on.comments(line.row), { className: "comments" }),
    };
    const cell = (name, className, ...inside) => (cells[name] = element("div", { role: "cell", className, dataset: { column: name } }, ...inside));
    const row = element("div", { role: "row", className: "row" },
      cell("tick", "", cells.box), cell("state", "cell state"), cell("name", "cell two", cells.link, cells.subject),
      cell("strip", "cell", cells.canvas), cell("verdict", "cell verdict", cells.use, cells.why), cell("activity", "cell"),
      cell("assigned", "cell"), cell("last", "cell two", cells.who, cells.when), cell("commentsCell", "figure", cells.comments),
    );
    const line = { element: row, cells, row: null, place: 0, drawn: -1 };
    row.onclick = (event) => {
      if (event.target.closest("a, button, input")) return;
      this.current = line.place;
      this.paint();
    };
    row.ondblclick = () => !line.row.error && location.assign(address(line.row));
    this.space.append(row);
    return line;
  }

  fill(line, row, place) {
    const { element, cells: c } = line;
    Object.assign(line, { row, place });
    element.style.transform = `translateY(${HEIGHT * place}px)`;
    element.setAttribute("aria-rowindex", String(place + 2));
    const chosen = this.look.selected(row);
    element.classList.toggle("selected", chosen);
    c.box.checked = chosen;
    c.box.disabled = Boolean(row.error);
    c.box.setAttribute("aria-label", `Select ${row.subject} ${row.trial}`);
    const [sign, state, tone] = this.look.state(row);
    put(c.state, state);
    c.state.dataset.sign = sign;
    c.state.dataset.tone = tone;
    c.state.title = state;
    put(c.link, row.trial || row.subject);
    if (row.error) c.link.removeAttribute("href");
    else c.link.href = address(row);
    c.link.title = row.error || `${row.subject} ${row.trial}`;
    put(c.subject, row.error || (this.look.several() ? row.subject : ""));
    c.canvas.title = stripWords(row);
    drawStrip(c.canvas, row);
    const [sign_, use, why] = row.verdict ?? ["", "", ""];
    c.verdict.dataset.sign = sign_;
    c.verdict.title = [`${sign_} ${use}`, why, row.causes.length ? `named: ${row.causes.join(", ")}` : ""].filter(Boolean).join("\n");
    put(c.use, use && `${sign_} ${use}`);
    put(c.why, why && ` · ${why}`);
    for (const [cell, text] of [[c.activity, row.activity], [c.assigned, row.assigned]]) {
      put(cell, text);
      cell.title = text;
    }
    put(c.who, row.last ? row.last[0] : "");
    put(c.when, row.last ? ago(this.look.now() - row.last[1]) : "");
    put(c.comments, row.comments ? String(row.openComments || "✓") : "+");
    c.comments.classList.toggle("open", row.openComments > 0);
    c.comments.hidden = Boolean(row.error);
    c.comments.setAttribute("aria-label", `Comments on ${row.trial}: ${row.openComments} open`);
  }

  keyed(event) {
    const page = Math.max(1, Math.floor(this.scroll.clientHeight / HEIGHT) - 1), row = this.rows[this.current];
    const steps = { ArrowDown: 1, ArrowUp: -1, PageDown: page, PageUp: -page, Home: -Infinity, End: Infinity };
    if (event.ctrlKey || event.metaKey || event.altKey || event.target !== this.scroll) return;
    if (event.key in steps) {
      this.current = Math.min(Math.max(this.current + steps[event.key], 0), this.rows.length - 1);
      const top = HEIGHT * this.current, bottom = top + HEIGHT;
      if (top < this.scroll.scrollTop) this.scroll.scrollTop = top;
      else if (bottom > this.scroll.scrollTop + this.scroll.clientHeight) this.scroll.scrollTop = bottom - this.scroll.clientHeight;
      this.paint();
    } else if (event.key === " " && row) this.on.select(row, event);
    else if (event.key === "Enter" && row && !row.error) location.assign(address(row));
    else return;
    event.preventDefault();
  }
}

function legend() {
  const kinds = { counts: "counts", open: "open", decided: "decided", conflict: "disagree" };
  const title = "Above: frames whose force counts. Below: proposals, higher the surer, and what people decided";
  return element("span", { className: "legend", title }, ...Object.entries(kinds).flatMap(([kind, words]) => [make("i", kind), words]));
}

// A trial's lanes in one strip: above, the frames whose force counts; below, proposals and what people decided.
let colors = {};

export function readColors() {
  const style = getComputedStyle(document.documentElement);
  const names = ["counts", "left", "open", "accepted", "decided", "conflict"];
  colors = Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

function drawStrip(canvas, row) {
  const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio)) canvas.width = Math.round(width * ratio);
  if (canvas.height !== Math.round(height * ratio)) canvas.height = Math.round(height * ratio);
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  if (!row.frames) return;
  const bar = (start, end, top, tall, color) => {
    pen.fillStyle = color;
    const left = (width * start) / row.frames, right = (width * end) / row.frames;
    pen.fillRect(left, top, Math.max(right - left, 1.5), tall);
  };
  bar(0, row.frames, 1, 12, colors.left);
  for (const [start, end] of row.used) bar(start, end, 1, 12, colors.counts);
  bar(0, row.frames, 21.5, 0.5, colors.left);
  for (const [start, end, certainty, state] of row.proposals) {
    const tall = 2 + 6 * certainty;
    bar(start, end, 22 - tall, tall, state === "open" ? colors.open : colors.accepted);
  }
  for (const [start, end] of row.reviewed) bar(start, end, 23.5, 4, colors.decided);
  for (const [start, end] of row.conflicts) bar(start, end, 23.5, 4, colors.conflict);
}

function stripWords(row) {
  if (!row.fitted) return "";
  const said = [`${row.frames} frames; the force counts on ${Math.round(100 * (1 - (row.leftOut ?? 1)))} %`];
  if (row.proposals.length) said.push(`proposals: ${row.open} open of ${row.proposals.length}`);
  if (row.conflicts.length) said.push(`people disagree on ${row.conflicts.length} range${row.conflicts.length > 1 ? "s" : ""}`);
  return said.join(". ");
}
