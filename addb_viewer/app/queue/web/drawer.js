// What opens at the right: who has done how much, or the comments on a trial.

import { button, make } from "./elements.js";
import { address, ago, hours } from "./rows.js";

function table(heads, lines) {
  const element = make("table"), head = make("tr");
  for (const [text, figure] of heads) head.append(make("th", figure ? "figure" : "", text));
  element.append(head);
  for (const line of lines) {
    const row = make("tr");
    line.forEach((text, k) => row.append(make("td", heads[k][1] ? "figure" : "", text)));
    element.append(row);
  }
  return element;
}

const titled = (title, close) => {
  const line = make("div", "line");
  line.append(make("h2", "", title), make("span", "fill"), button("Close", close));
  return line;
};

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
    const thread = make("section", comment.settledBy ? "thread settled" : "thread");
    const about = make("div", "line");
    if (comment.frame === null) about.append(make("span", "quiet", "the whole trial"));
    else {
      const link = make("a", "strong", `frame ${comment.frame}`);
      link.href = address(row, comment.frame);
      about.append(link);
    }
    about.append(make("span", "fill"));
    about.append(comment.settledBy
      ? button("Open again", () => act.settle(comment.number, true))
      : button("Settled", () => act.settle(comment.number, false)));
    thread.append(about);
    for (const [author, at, text] of comment.said) {
      const who = make("div");
      who.append(make("span", "strong", author), make("span", "quiet", ` · ${ago(now - at)}`));
      thread.append(who, make("div", "said", text));
    }
    if (comment.settledBy) thread.append(make("div", "quiet", `Settled by ${comment.settledBy}`));
    thread.append(form("Answer", (text) => act.comment(text, null, comment.number)));
    parts.push(thread);
  }
  const frame = make("input");
  Object.assign(frame, { type: "number", min: 0, max: Math.max(row.frames - 1, 0), placeholder: "whole trial" });
  frame.setAttribute("aria-label", "Frame that the comment is about");
  const line = make("label", "line", "At frame ");
  line.append(frame);
  parts.push(make("h2", "", "New comment"), line);
  parts.push(form("Comment", (text) => act.comment(text, frame.value === "" ? null : Math.max(0, Math.round(+frame.value)), null)));
  return parts;
}

function form(label, send) {
  const box = make("div"), text = make("textarea");
  text.maxLength = 10000;
  text.setAttribute("aria-label", label);
  const say = () => text.value.trim() && send(text.value.trim());
  text.addEventListener("keydown", (event) => {
    if (event.key === "Enter" && (event.ctrlKey || event.metaKey)) say();
  });
  box.append(text, button(label, say));
  return box;
}
