// The page put together: what the server says goes into the table, what people ask goes to the server.

import { connect, system } from "/addb/server.js";
import { peopleView, commentsView } from "./drawer.js";
import { at, button } from "./elements.js";
import { memory } from "./memory.js";
import { CHIPS, CHOICES, hours, INSTEAD, inOrder, key, letThrough, NOBODY, ORDERS, stateOf } from "./rows.js";
import { readColors, Table } from "./table.js";

const nowS = () => Date.now() / 1000;
const TOLD_MS = 6000, ORDER_MS = 300;
const ANY = { source: "any source", cause: "any cause", activity: "any activity", assigned: "assigned: any" };

const rows = new Map(), selected = new Set();
const filter = { words: "", chips: new Set(["todo"]), choices: { source: "", cause: "", activity: "", assigned: "" } };
let live = { present: [], here: new Map(), work: {}, batches: {} }, order = { column: "verdict", down: true };
let several = false, suggested = "", people = null, drawer = null, lastChosen = null, shown = [], comesBack = false;

const state = (row) => stateOf(row, live, memory.name, nowS());
const say = (what, more = {}) => tellServer({ what, ...more });
const table = new Table(
  {
    select: (row, event) => select(row, event.shiftKey),
    all: (on) => {
      for (const row of shown) if (!row.error) on ? selected.add(key(row)) : selected.delete(key(row));
      draw();
    },
    sort: (column) => {
      const down = order.column === column ? !order.down : ORDERS[column][1];
      order = { column, down };
      draw();
    },
    comments: (row) => {
      drawer = { kind: "comments", row, comments: null };
      say("comments", { places: [[row.subject, row.trial]] });
    },
  },
  { state, selected: (row) => selected.has(key(row)), several: () => several, now: nowS },
);

function select(row, upTo) {
  const on = !selected.has(key(row)), places = shown.map(key);
  const from = upTo && lastChosen !== null ? places.indexOf(lastChosen) : -1, to = places.indexOf(key(row));
  const range = from < 0 ? [row] : shown.slice(Math.min(from, to), Math.max(from, to) + 1);
  for (const each of range) if (!each.error) on ? selected.add(key(each)) : selected.delete(key(each));
  lastChosen = key(row);
  draw();
}

function heard(said) {
  if (said.kind === "rows") {
    rows.clear();
    for (const row of said.rows) rows.set(key(row), row);
    ({ several, suggested } = said);
    at("root-name").textContent = said.root;
    at("notes").textContent = said.notes.join(" · ");
    at("notes").hidden = !said.notes.length;
    at("format").replaceChildren(...said.formats.map((name) => new Option(name)));
    at("format").value = "csv";
    hello();
  } else if (said.kind === "changed") {
    for (const [subject, trial] of said.gone) rows.delete(key({ subject, trial }));
    for (const row of said.rows) rows.set(key(row), row);
    if (drawer?.kind === "people") say("people");
    const again = drawer?.kind === "comments" && said.rows.find((row) => key(row) === key(drawer.row));
    if (again) say("comments", { places: [[again.subject, again.trial]] });
  } else if (said.kind === "live") {
    live = { ...said, here: new Map(said.here.map(([subject, trial, names]) => [key({ subject, trial }), names])) };
  } else if (said.kind === "people") {
    people = said;
    if (drawer?.kind === "people") showDrawer();
  } else if (said.kind === "comments") {
    if (drawer?.kind === "comments" && key(drawer.row) === said.place.join("\n")) {
      const typed = at("drawer").contains(document.activeElement) && document.activeElement.value;
      drawer = { kind: "comments", row: rows.get(key(drawer.row)) ?? drawer.row, comments: said.comments };
      if (!typed || comesBack) showDrawer();
      comesBack = false;
    }
  } else if (said.kind === "told") tell(said.text, said.bad);
  ask();
}

let asked = false;
function ask() {
  if (asked) return;
  asked = true;
  requestAnimationFrame(() => {
    asked = false;
    draw();
  });
}

function draw() {
  const all = [...rows.values()];
  shown = inOrder(letThrough(all, filter, memory.name), order.column, order.down, state);
  table.ordered(order.column, order.down);
  table.show(shown);
  const trials = all.filter((row) => !row.error), done = trials.filter((row) => row.status === "finished").length;
  at("progress").firstElementChild.style.width = `${(100 * done) / Math.max(trials.length, 1)}%`;
  at("progress").setAttribute("aria-label", `${done} of ${trials.length} reviewed`);
  at("progress-words").textContent = trials.length ? `Reviewed ${done} of ${trials.length}` : "No trials";
  at("shown").textContent = shown.length === all.length ? "" : `${shown.length} shown`;
  at("clear").hidden = !(filter.words || filter.chips.size || Object.values(filter.choices).some(Boolean));
  const chosen = shown.filter((row) => selected.has(key(row))).length, hidden = selected.size - chosen;
  at("selection").hidden = !selected.size;
  at("selected").textContent = `${chosen} selected${hidden ? `; ${hidden} more are filtered out, and left alone` : ""}`;
  tellOrder();
  drawBatches();
  drawChoices(all);
  document.title = `${done}/${trials.length} · Queue · addb-viewer`;
}

// T in the review page of this browser goes through what is shown here.
let ordering, orderTold = "";
function tellOrder() {
  clearTimeout(ordering);
  ordering = setTimeout(() => {
    const places = shown.filter((row) => !row.error).map((row) => [row.subject, row.trial]), order = JSON.stringify(places);
    if (order === orderTold || !memory.browser) return;
    orderTold = order;
    say("order", { places, text: memory.browser });
  }, ORDER_MS);
}

function drawBatches() {
  const words = { fit: "Fitting", diagnose: "Diagnosing", export: "Exporting" };
  const running = Object.entries(live.batches).filter(([, batch]) => batch.running);
  const told = (what) => Object.values(live.batches)
    .flatMap((batch) => Object.entries(batch[what]).map(([name, why]) => `${name}: ${why}`));
  const failed = told("failures"), warned = told("warnings");
  const said = running.map(([kind, batch]) => {
    const rest = batch.left === null ? "" : `, ${hours(batch.left / 3600)} left`;
    return `${words[kind]} ${Math.min(batch.fitted + 1, batch.total)} of ${batch.total}${batch.held_up ? ", waits its turn" : rest}`;
  });
  if (failed.length) said.push(`${failed.length} failed`);
  if (warned.length) said.push(`${warned.length} with a warning`);
  at("batch-words").textContent = said.join(" · ");
  at("batch-words").title = [...failed, ...warned].join("\n");
  at("cancel").hidden = !running.length;
}

function drawChoices(all) {
  const names = new Set(all.flatMap((row) => [row.assigned, ...row.people]).filter(Boolean));
  if (memory.name) names.add(memory.name);
  options(at("persons"), [...names].sort());
  for (const kind of Object.keys(CHOICES)) {
    const found = [...new Set(all.flatMap((row) => CHOICES[kind](row)))].sort();
    options(at(kind), ["", ...found], (name) => (name === "" ? ANY[kind] : name));
    at(kind).value = filter.choices[kind];
    at(kind).hidden = found.length < 2 && found[0] !== filter.choices[kind] && (!found.length || found[0] === NOBODY);
  }
}

function options(list, names, label = (name) => name) {
  const now = [...list.children].map((option) => option.value).join("\n");
  if (now !== names.join("\n") || list.children.length !== names.length) {
    list.replaceChildren(...names.map((name) => new Option(label(name), name)));
  }
}

function closeDrawer() {
  drawer = null;
  at("drawer").hidden = true;
  at("show-people").setAttribute("aria-expanded", "false");
}

function showDrawer() {
  const close = () => {
    closeDrawer();
    at("scroll").focus();
  };
  at("show-people").setAttribute("aria-expanded", String(drawer.kind === "people"));
  at("drawer").hidden = false;
  if (drawer.kind === "people") return at("drawer").replaceChildren(...peopleView(people, [...rows.values()], nowS(), close));
  const places = [[drawer.row.subject, drawer.row.trial]];
  const act = (what, more) => withName(() => {
    comesBack = true;
    say(what, { places, ...more });
  });
  at("drawer").replaceChildren(...commentsView(drawer.row, drawer.comments, nowS(), {
    comment: (text, frame, number) => act("comment", { text, frame, number }),
    settle: (number, open) => act("settle", { number, text: open ? "open" : "" }),
    close,
  }));
}

let telling;
function tell(text, bad = false) {
  at("told").textContent = text;
  at("told").className = bad ? "bad" : "";
  at("told").hidden = false;
  clearTimeout(telling);
  telling = setTimeout(() => (at("told").hidden = true), bad ? 2 * TOLD_MS : TOLD_MS);
}

function hello() {
  at("me").textContent = memory.name ? `You: ${memory.name}` : "Say your name";
  say("hello", { text: memory.name });
}

const withName = (then) => (memory.name ? then() : askName(then));

let afterName = () => {};
function askName(then) {
  afterName = then;
  at("name").value = memory.name || suggested;
  at("naming").showModal();
}

function wireName() {
  const named = () => {
    const name = at("name").value.trim();
    if (!name) return;
    memory.name = name;
    at("naming").close();
    hello();
    draw();
    afterName();
  };
  at("named").addEventListener("click", named);
  at("unnamed").addEventListener("click", () => at("naming").close());
  at("name").addEventListener("keydown", (event) => event.key === "Enter" && named());
  at("me").addEventListener("click", () => askName(() => {}));
}

function wire() {
  for (const [name, [label]] of Object.entries(CHIPS)) {
    const chip = button(label, (event) => {
      filter.chips.has(name) ? filter.chips.delete(name) : filter.chips.add(name);
      filter.chips.delete(INSTEAD[name]);
      for (const each of at("chips").children) each.setAttribute("aria-pressed", String(filter.chips.has(each.dataset.chip)));
      draw();
      if (event.detail) at("scroll").focus(); // after a click, Enter and arrows are for the rows
    }, { dataset: { chip: name }, "aria-pressed": String(filter.chips.has(name)) });
    at("chips").append(chip);
  }
  at("words").addEventListener("input", () => {
    filter.words = at("words").value;
    draw();
  });
  for (const kind of Object.keys(CHOICES)) {
    at(kind).addEventListener("change", () => {
      filter.choices[kind] = at(kind).value;
      draw();
      at("scroll").focus();
    });
  }
  at("clear").addEventListener("click", () => {
    Object.assign(filter, { words: "", chips: new Set() });
    for (const kind of Object.keys(filter.choices)) filter.choices[kind] = "";
    at("words").value = "";
    for (const chip of at("chips").children) chip.setAttribute("aria-pressed", "false");
    draw();
  });
  const chosen = () => shown.filter((row) => selected.has(key(row))).map((row) => [row.subject, row.trial]);
  for (const button of document.querySelectorAll("[data-do]")) {
    button.addEventListener("click", () => withName(() => {
      const what = button.dataset.do, text = { export: at("format").value, assign: at("person").value.trim() }[what] ?? "";
      say(what, { places: chosen(), text });
    }));
  }
  at("take").addEventListener("click", () => withName(() => say("assign", { places: chosen(), text: memory.name })));
  at("unselect").addEventListener("click", () => {
    selected.clear();
    draw();
  });
  at("cancel").addEventListener("click", () => withName(() => say("cancel")));
  at("anew").addEventListener("click", () => say("anew"));
  at("show-people").addEventListener("click", () => {
    if (drawer?.kind === "people") return closeDrawer();
    drawer = { kind: "people" };
    say("people");
  });
  const themed = () => {
    theme();
    draw();
  };
  at("theme").addEventListener("click", () => {
    memory.dark = !memory.dark;
    themed();
  });
  system.addEventListener("change", themed);
  document.addEventListener("keydown", (event) => {
    const typing = ["INPUT", "TEXTAREA", "SELECT"].includes(event.target.tagName) && event.target.type !== "checkbox";
    if (event.key === "/" && !typing) {
      at("words").focus();
      event.preventDefault();
    } else if (event.key === "Escape" && typing) at("scroll").focus();
  });
}

function theme() {
  document.documentElement.dataset.theme = memory.dark ? "dark" : "light";
  readColors();
}

window.addEventListener("storage", () => hello()); // the review page has been told a name
theme();
wire();
wireName();
const tellServer = connect("/addb/queue", {
  heard,
  opened: () => (orderTold = ""),
  lost: () => tell("The connection is lost; it is tried again.", true),
});
setInterval(ask, 30000);
at("scroll").focus();
