// Finds the command of a key, ahead of the page's own keys, and hides what is ours from them (its camera flies by arrows
// and by W A S D Q E). The table comes over the channel: a key's name, as "Shift+T" or "?", and its action, which is asked for over the channel.
//
// A letter is the one that the keyboard prints, wherever it lies; where the layout has no Latin letters, the one that
// lies there on an American keyboard. Of signs, as "?", it does not matter which keys make them. Digits of keyboards
// that need Shift for them do without it.
import { isTyped } from "./elements.js";
import { stepAhead } from "./timeline.js";

{
  let commands = new Map();
  window.addb.on("keys", (table) => (commands = new Map(Object.entries(table))));
  const WIDGETS = "[role=tab], [role=slider], [role=option], [role=menuitem], [role=radio], [role=button], button, a, summary";
  const OF_WIDGETS = /^(Enter|Space|Home|End|Arrow.*)$/;

  // A widget has its own keys where somebody went to it by Tab. After a click it looks focused to the browser from the
  // next key on, and whoever clicked goes on with the trial.
  let byTab = false;
  window.addEventListener("pointerdown", () => (byTab = false), true);
  window.addEventListener("keydown", (event) => (byTab ||= event.key === "Tab"), true);

  const modified = (event, name, withShift) => {
    const graph = event.getModifierState("AltGraph"); // of a sign: Ctrl and Alt on some systems
    const held = [
      (event.ctrlKey || event.metaKey) && !graph && "Ctrl",
      event.altKey && !graph && "Alt",
      event.shiftKey && withShift && "Shift",
    ];
    return [...held.filter(Boolean), name].join("+");
  };
  const names = (event) => {
    if (event.key === " ") return [modified(event, "Space", true)];
    if (event.key.length > 1) return [modified(event, event.key, true)];
    const printed = event.key.toUpperCase();
    const found = [modified(event, printed, /^[A-Z]$/.test(printed))];
    const [, letter] = event.code.match(/^Key([A-Z])$/) ?? [];
    const [, digit] = event.code.match(/^Digit(\d)$/) ?? [];
    if (letter && event.key.charCodeAt(0) > 127) found.push(modified(event, letter, true));
    if (digit && !event.shiftKey) found.push(modified(event, digit, false));
    return found;
  };
  const isTheWidgets = (event, name) =>
    OF_WIDGETS.test(name) &&
    event.target.checkVisibility?.() && // a dialog that has just gone keeps the focus until the page is drawn again
    (event.target.closest?.("dialog, [role=dialog]") || (byTab && event.target.matches?.(WIDGETS)));

  window.addEventListener(
    "keydown",
    (event) => {
      if (!event.isTrusted || isTyped(event)) return;
      const name = names(event).find((each) => commands.has(each));
      if (!name || isTheWidgets(event, name)) return;
      const { do: action, held, steps } = commands.get(name);
      if (name !== "Escape") {
        event.preventDefault();
        event.stopImmediatePropagation();
      }
      if (event.repeat && !held) return;
      window.addb.send("do", action);
      if (steps) stepAhead(steps);
    },
    true,
  );

  const style = (rules) => {
    const sheet = new CSSStyleSheet();
    sheet.replaceSync(rules);
    document.adoptedStyleSheets = [...document.adoptedStyleSheets, sheet];
  };

  // Where no key prints a command's letter, the help says beside it what the key that lies there prints.
  navigator.keyboard?.getLayoutMap?.().then((layout) => {
    const printed = new Set([...layout.values()].map((text) => text.toUpperCase()));
    const rules = [...layout.entries()].flatMap(([code, text]) => {
      const letter = code.match(/^Key([A-Z])$/)?.[1];
      if (!letter || printed.has(letter)) return [];
      return [`[data-addb-key$="${letter}"]::after { content: " (${CSS.escape(text.toUpperCase())})"; }`];
    });
    style(rules.join("\n"));
  }, () => {});
}
