// What opens at the right: who has done how much, or the comments on a trial.

import { element } from "/addb/elements.js";
import { button, make } from "./elements.js";
import { address, ago, hours } from "./rows.js";

function table(heads, lines) {
  const row = (kind, texts) => make("tr", "", ...texts.map((text, k) => make(kind, heads[k][1] ? "figure" : "", text)));
  return make("table", "", row("th", heads.map(([text]) => text)), ...lines.map((texts) => row("td", texts)));
}

const titled = (title, close) => make("div", "line", make("h2", "", title), make("span", "fill"), button("Close", close));

export function peopleView(said, rows, now, close) {
  const left = rows.filter((row) => row.status !== "finished" && !row.error).length;
  const time = said.hoursLeft === null ? "" : `, about ${hours(said.hoursLeft)} of work at the pace so far`;
  const parts = [titled("People", close), make("p", "", `${left} of ${rows.length} trials are left${time}.`)];
  parts.push(table(
    [["name"], ["finished", true], ["edits", true], ["at work", true], ["an hour", true], ["assigned, left", true], ["last"]],
    said.people.map((person) => [
      person.name, String(person.finished), String(person.edits), hours(person.hours),
      person.anHour === null ? "" : person.anHour.toFixed(person.anHour < 10 ? 1 : 0),
      String(person.assigned), person.last === null ? "" : ago(now - person.last),
    ]),
  ));
  parts.push(make("p", "quiet", "At work: time between edits, pauses of more than 10 minutes left out."));
  parts.push(make("h2", "", "Agreement"));
  if (!said.pairs.length) parts.push(make("p", "quiet", "No fitted trial has been judged by two people yet."));
  else {
    parts.push(table(
      [["two reviewers"], ["trials", true], ["the same", true], ["κ", true]],
      said.pairs.map((pair) => [
        `${pair.one}, ${pair.other}`, String(pair.trials), `${(100 * pair.same).toFixed(1)} %`,
        pair.kappa === null ? "–" : pair.kappa.toFixed(2),
      ]),
    ));
    parts.push(make("p", "quiet", "Missing forces, all frames and feet of the trials that both have judged; κ is Cohen's: 1 the same, 0 as chance would."));
  }
  return parts;
}

// `act`: comment(text, frame, number), settle(number, open), close()
export function commentsView(row, comments, now, act) {
  const parts = [titled(`Comments on ${row.trial}`, act.close)];
  for (const comment of comments) {
    const { frame, number, said, settledBy } = comment;
    const href = address(row, frame ?? 0);
    const about = make("div", "line",
      frame === null ? make("span", "quiet", "the whole trial") : element("a", { className: "strong", href }, `frame ${frame}`),
      make("span", "fill"),
      button(settledBy ? "Open again" : "Settled", () => act.settle(number, Boolean(settledBy))),
    );
    const thread = make("section", settledBy ? "thread settled" : "thread", about);
    for (const [author, at, text] of said) {
      const who = make("div", "", make("span", "strong", author), make("span", "quiet", ` · ${ago(now - at)}`));
      thread.append(who, make("div", "said", text));
    }
    if (settledBy) thread.append(make("div", "quiet", `Settled by ${settledBy}`));
    thread.append(form("Answer", (text) => act.comment(text, null, number)));
    parts.push(thread);
  }
  const about = { type: "number", min: 0, max: Math.max(row.frames - 1, 0), placeholder: "whole trial" };
  const frame = element("input", { ...about, "aria-label": "Frame that the comment is about" });
  parts.push(make("h2", "", "New comment"), make("label", "line", "At frame ", frame));
  parts.push(form("Comment", (text) => act.comment(text, frame.value === "" ? null : Math.max(0, Math.round(+frame.value)), null)));
  return parts;
}

function form(label, send) {
  const text = element("textarea", { maxLength: 10000, "aria-label": label });
  const say = () => text.value.trim() && send(text.value.trim());
  text.addEventListener("keydown", (event) => {
    if (event.key === "Enter" && (event.ctrlKey || event.metaKey)) say();
  });
  return make("div", "", text, button(label, say));
}
