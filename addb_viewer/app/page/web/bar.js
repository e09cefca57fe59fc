// The head of the page with the trial's verdict, and the bar at its lower edge: what the next key is about, the solve,
// work under way, and what was told. Everything that is shown is set as text.
import { button, element } from "./elements.js";

export const strip = element("footer", { id: "addb-strip", "aria-label": "Timeline and state" });
const head = element("header", { id: "addb-head", "aria-label": "Trial and verdict" });
const chips = element("span", { id: "addb-chips" });
const solve = element("span", { id: "addb-solve" });
const notice = element("span", { id: "addb-notice", role: "status", "aria-live": "polite" });
const opener = button("Notices", () => open("notes", notes.hidden), { id: "addb-notices", "aria-expanded": "false" });
const worker = button("", () => open("work", works.hidden), { id: "addb-work", "aria-expanded": "false", hidden: true });
const notes = element("ul", { id: "addb-notes", className: "addb-list", hidden: true, "aria-label": "Notices, newest first" });
const works = element("ul", { className: "addb-list", hidden: true, "aria-label": "At work" });
const bar = element("div", { id: "addb-bar" }, chips, solve, notice, worker, opener);
strip.append(bar);
document.body.prepend(head, strip);
strip.after(notes, works);

let keyOf = new Map(); // of an action
let state = null, speed = 0;
const key = (action) => keyOf.get(action)?.replace("+", " ");
export const keyOfAction = key;

const word = (text, bold) => element(bold ? "b" : "span", { textContent: text });
const chip = ({ text, keys }) => {
  const made = element("span", { className: "addb-chip", title: text }, element("span", {}, text));
  for (const [action, what] of keys ?? []) made.append(element("span", { className: "act" }, " · ", ...keyed(action), what));
  return made;
};
const keyed = (action) => (key(action) ? [element("kbd", {}, key(action))] : []);
const act = ([action, what, shown = action]) =>
  button([...keyed(shown), what], () => window.addb.send("do", action), { "aria-label": key(shown) ? `${what} (${key(shown)})` : what });
/** A part of the verdict; a click leads to where it comes from. */
const part = (text, action, title) =>
  !text ? [] : [action ? button(text, () => window.addb.send("do", action), { title }) : element("span", { title: title ?? text }, text)];

const drawHead = () => {
  const { place, of, verdict } = state;
  const chooser = button([word(place, true), word(of ? ` · ${of}` : ""), " ▾"], () => window.addb.send("do", "trials"), {
    id: "addb-place",
    title: `Choose a trial (${key("trials") ?? "Ctrl K"})`,
  });
  const playing = speed ? [element("span", { className: "speed" }, `▶ ${speed < 0 ? "−" : ""}${Math.abs(speed)}×`)] : [];
  if (!verdict) return head.replaceChildren(chooser, ...playing);
  const { sign, use, band, frames, why, open, where, next } = verdict;
  head.dataset.sign = sign;
  head.replaceChildren(
    chooser,
    element("span", { id: "addb-verdict" }, word(`${sign} ${use}`, true), ...part(band, "", "95 % of true torques lie within it, by the markers' errors: median of the frames that count, worse side"), ...part(frames), ...part(why, where, `${why}: show it`), ...part(open, /proposal|disagreement/.test(open) ? "next" : "", "Go to the next one")),
    ...playing,
    ...(next ? [element("span", { id: "addb-next" }, "next: ", act(next))] : []),
  );
};
const draw = () => {
  if (!state) return;
  const { place, people } = state;
  drawHead();
  chips.replaceChildren(...state.chips.map(chip), ...people.map((text) => chip({ text })));
  solve.title = state.solve?.text ?? "";
  solve.className = state.solve?.worse ? "worse" : "";
  solve.replaceChildren(...(state.solve ? [word(state.solve.text, true), ...state.solve.keys.map(act)] : []));
  const [first] = state.work;
  const share = first && first.share !== null ? `${Math.round(100 * first.share)} %` : "";
  worker.hidden = !first;
  worker.textContent = first ? `⟳ ${share || `${first.seconds} s`}` : "";
  worker.title = state.work.map(({ text }) => text).join("\n");
  worker.setAttribute("aria-label", `At work: ${worker.title} ${share}`);
  if (!first) open("work", false);
  works.replaceChildren(
    ...state.work.map(({ text, seconds, share }) => {
      const shown = element("progress", { "aria-label": text, ...(share === null ? {} : { value: share, max: 1 }) });
      return element("li", {}, element("div", {}, text), shown, ` ${seconds} s `);
    }),
    element("li", {}, button("Cancel", () => window.addb.send("do", "cancel"))),
  );
  document.title = `${first ? `${share ? `${share} ` : ""}${first.text} · ` : state.solve ? "● " : ""}${place} · addb-viewer`;
};
window.addb.on("keys", (table) => {
  keyOf = new Map(Object.entries(table).map(([name, { do: action }]) => [action, name]).reverse());
  draw();
});
window.addb.on("bar", (told) => {
  state = told;
  draw();
});
window.addb.on("plays", (now) => {
  const before = speed;
  speed = now;
  if (state && before !== now) drawHead();
});

// A word of the app stays for some seconds, a failure longer or until Escape; all stay in the list.
let told = [], timer = 0;
const begun = new Map(); // when a notice was first seen here; after a new start of the app numbers begin anew
const named = (n) => `${n.at} ${n.number}`;
const drawNotice = () => {
  clearTimeout(timer);
  const now = performance.now();
  const lives = told.filter((n) => !n.gone && (n.seconds === null || begun.get(named(n)) + 1000 * n.seconds > now));
  const shown = lives.at(-1) ?? null;
  const more = lives.length > 1 ? `  (+${lives.length - 1})` : "";
  notice.className = shown?.error ? "error" : "";
  const text = shown ? `${shown.title}  ${shown.body}${more}` : "";
  if (notice.title !== text) {
    notice.title = text;
    notice.replaceChildren(...(shown ? [word(shown.title, true), word(`  ${shown.body}${more}`)] : []));
  }
  notice.classList.toggle("above", notice.scrollWidth > notice.clientWidth);
  if (lives.length) timer = setTimeout(drawNotice, 500);
};
const drawList = () => {
  const failed = told.filter((n) => n.error && !n.gone).length;
  opener.textContent = told.length ? `Notices ${told.length}${failed ? ` · ${failed} failed` : ""}` : "Notices";
  if (notes.hidden) return;
  notes.replaceChildren(
    ...(told.length ? told.toReversed() : [{ title: "Nothing has been told yet", body: "", at: "" }]).map((n) =>
      element(
        "li",
        { className: n.error ? "error" : "" },
        element("time", { textContent: n.at }),
        word(n.title, true),
        element("div", { textContent: n.body }),
      ),
    ),
  );
};
window.addb.on("notices", (list) => {
  told = list;
  for (const n of told) if (!begun.has(named(n))) begun.set(named(n), performance.now());
  drawNotice();
  drawList();
});
const LISTS = { notes: [notes, opener], work: [works, worker] };
function open(which, on) {
  for (const [name, [list, by]] of Object.entries(LISTS)) {
    list.hidden = !(name === which ? on : list.hidden === false && !on);
    by.setAttribute("aria-expanded", String(!list.hidden));
  }
  drawList();
}
window.addEventListener("keydown", (event) => event.key === "Escape" && ["notes", "work"].forEach((name) => open(name, false)), true);
