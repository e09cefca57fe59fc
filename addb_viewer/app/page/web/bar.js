// The bar at the lower edge: where one is, what the next key is about, the solve, work under way, and what was told.
// Everything that is shown is set as text.
import { element } from "./elements.js";

export const strip = element("footer", { id: "addb-strip" });
strip.setAttribute("aria-label", "Timeline and state");
const where = element("span");
const chips = element("span", { id: "addb-chips" });
const solve = element("span", { id: "addb-solve" });
const work = element("span");
const notice = element("span", { id: "addb-notice" });
notice.setAttribute("role", "status");
notice.setAttribute("aria-live", "polite");
const opener = element("button", { id: "addb-notices", textContent: "Notices" });
const notes = element("ul", { id: "addb-notes", hidden: true });
notes.setAttribute("aria-label", "Notices, newest first");
opener.setAttribute("aria-expanded", "false");
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
  for (const [action, what] of keys ?? []) made.append(" · ", ...(key(action) ? [element("kbd", { textContent: key(action) })] : []), what);
  return made;
};
const button = ([action, what, shown = action]) => {
  const made = element("button", {}, ...(key(shown) ? [element("kbd", { textContent: key(shown) })] : []), what);
  made.setAttribute("aria-label", key(shown) ? `${what} (${key(shown)})` : what);
  made.onclick = () => {
    window.addb.send("do", action);
    made.blur();
  };
  return made;
};

const draw = () => {
  if (!state) return;
  const { place, of, open, people } = state;
  where.replaceChildren(word(place, true), word(of ? ` · ${of}` : ""), word(open === null ? "" : ` · ${open}`));
  chips.replaceChildren(...state.chips.map(chip), ...people.map((text) => chip({ text })));
  solve.title = state.solve?.text ?? "";
  where.title = [place, of, open].filter(Boolean).join(" · ");
  solve.replaceChildren(...(state.solve ? [word(state.solve.text, true), ...state.solve.keys.map(button)] : []));
  work.replaceChildren(
    ...state.work.flatMap(({ text, seconds, share }) => {
      const shown = element("progress", share === null ? {} : { value: share, max: 1 });
      shown.setAttribute("aria-label", text);
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
opener.onclick = () => {
  open(notes.hidden);
  opener.blur();
};
window.addEventListener("keydown", (event) => event.key === "Escape" && open(false), true);
