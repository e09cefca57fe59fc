// The bar at the lower edge: where one is, what the next key is about, the solve, work under way, and what was told.
// Everything that is shown is set as text.
import { button, element } from "./elements.js";

export const strip = element("footer", { id: "addb-strip", "aria-label": "Timeline and state" });
const where = element("span");
const chips = element("span", { id: "addb-chips" });
const solve = element("span", { id: "addb-solve" });
const work = element("span");
const notice = element("span", { id: "addb-notice", role: "status", "aria-live": "polite" });
const opener = button("Notices", () => open(notes.hidden), { id: "addb-notices", "aria-expanded": "false" });
const notes = element("ul", { id: "addb-notes", hidden: true, "aria-label": "Notices, newest first" });
const bar = element("div", { id: "addb-bar" }, where, chips, solve, work, notice, opener);
strip.append(bar);
document.body.prepend(strip);
strip.after(notes);

let keyOf = new Map(); // of an action
let state = null;
const key = (action) => keyOf.get(action)?.replace("+", " ");

const word = (text, bold) => element(bold ? "b" : "span", { textContent: text });
const chip = ({ text, keys }) => {
  const made = element("span", { className: "addb-chip", title: text }, text);
  for (const [action, what] of keys ?? []) made.append(" · ", ...keyed(action), what);
  return made;
};
const keyed = (action) => (key(action) ? [element("kbd", {}, key(action))] : []);
const act = ([action, what, shown = action]) =>
  button([...keyed(shown), what], () => window.addb.send("do", action), { "aria-label": key(shown) ? `${what} (${key(shown)})` : what });

const draw = () => {
  if (!state) return;
  const { place, of, open, people } = state;
  where.replaceChildren(word(place, true), word(of ? ` · ${of}` : ""), word(open === null ? "" : ` · ${open}`));
  chips.replaceChildren(...state.chips.map(chip), ...people.map((text) => chip({ text })));
  solve.title = state.solve?.text ?? "";
  where.title = [place, of, open].filter(Boolean).join(" · ");
  solve.replaceChildren(...(state.solve ? [word(state.solve.text, true), ...state.solve.keys.map(act)] : []));
  work.replaceChildren(
    ...state.work.flatMap(({ text, seconds, share }) => {
      const shown = element("progress", { "aria-label": text, ...(share === null ? {} : { value: share, max: 1 }) });
      return [shown, word(` ${text} ${seconds} s `)];
    }),
  );
  const [first] = state.work;
  const share = first && first.share !== null ? `${Math.round(100 * first.share)} % ` : "";
  document.title = `${first ? `${share}${first.text} · ` : state.solve ? "● " : ""}${place} · addb-viewer`;
};
window.addb.on("keys", (table) => {
  keyOf = new Map(Object.entries(table).map(([name, { do: action }]) => [action, name]).reverse());
  draw();
});
window.addb.on("bar", (told) => {
  state = told;
  draw();
});

// A word of the app stays for some seconds, a failure longer or until Escape; all stay in the list.
let told = [], timer = 0;
const begun = new Map(); // when a notice was first seen here; after a new start of the app numbers begin anew
const named = (n) => `${n.at} ${n.number}`;
const drawNotice = () => {
  clearTimeout(timer);
  const now = performance.now();
  const lives = told.filter((n) => !n.gone && (n.seconds === null || begun.get(named(n)) + 1000 * n.seconds > now));
  const shown = lives.findLast((n) => n.error) ?? lives.at(-1);
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
  opener.textContent = told.length ? `Notices ${told.length}` : "Notices";
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
const open = (on) => {
  notes.hidden = !on;
  opener.setAttribute("aria-expanded", String(on));
  drawList();
};
window.addEventListener("keydown", (event) => event.key === "Escape" && open(false), true);
