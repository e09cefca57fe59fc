"use strict";
// Asks for what is shown, once a second; everything that comes is put in as text.

const EVERY_MS = 1000, SILENT_MS = 5000, LONG = 60, LONGER = 110; // letters beyond which a sentence is set smaller
const at = (id) => document.getElementById(id);
const STAGES = { first: "first look, the verdict follows", fit: "by the fit alone, the diagnosis follows" };
const SIGNS = { "✓": "good", "!": "with something to do or to know", "✗": "not usable", "–": "not judged" };
let heard = Date.now(), shown = "", listed = null;

// A figure stays with its unit.
const joined = (text) => text.replace(/(\d) %/g, "$1\u00a0%").replace(/% BW/g, "%\u00a0BW").replace(/(\d) N/g, "$1\u00a0N");

function put(id, text) {
  if (at(id).textContent !== text) at(id).textContent = text;
}

function timeOf(when) {
  const time = new Date(when);
  return isNaN(time) ? "" : time.toLocaleTimeString([], { hour: "2-digit", minute: "2-digit", hourCycle: "h23" });
}

function cell(row, text) {
  row.insertCell().textContent = text;
}

function show(state) {
  const last = state.last;
  document.body.dataset.colour = last ? last.colour : "none";
  document.body.dataset.stage = last ? last.stage : "";
  put("place", state.folder + (state.busy ? " · judging a trial" : ""));
  put("sign", last ? last.sign : "…");
  put("trial", last ? [last.subject, last.trial, timeOf(last.when), STAGES[last.stage]].filter(Boolean).join(" · ") : "");
  put("to_do", last ? last.to_do : state.busy ? "Looking at the first trial" : "Waiting for the first trial");
  const letters = at("to_do").textContent.length;
  at("to_do").className = letters > LONGER ? "longer" : letters > LONG ? "long" : "";
  put("words", last ? joined(last.words) : "");
  at("plan").replaceChildren(...state.plan.map((item) => {
    const li = document.createElement("li");
    li.textContent = (item.done ? "✓ " : "") + item.words;
    li.className = item.done ? "done" : item.done === null ? "why" : "";
    return li;
  }));
  listed = state;
  list();
}

// The newest that there is room for, without the one that stands large; the earlier ones in one line.
function list() {
  at("trials").replaceChildren();
  const several = new Set(listed.trials.map((trial) => trial.subject)).size > 1;
  const is_last = (trial) => listed.last && trial.subject === listed.last.subject && trial.trial === listed.last.trial;
  const former = listed.trials.filter((trial) => !is_last(trial));
  for (const trial of former) {
    const row = at("trials").insertRow();
    row.dataset.colour = trial.colour;
    cell(row, trial.sign);
    cell(row, several ? `${trial.subject}/${trial.trial}` : trial.trial);
    cell(row, [trial.to_do, trial.stage in STAGES ? `(${STAGES[trial.stage]})` : ""].filter(Boolean).join(" ") || trial.words);
    cell(row, trial.to_do ? trial.words.split(/ · |, /)[0] : "");
    cell(row, timeOf(trial.when));
  }
  const earlier = listed.unlisted.slice();
  const room = () => at("list").scrollHeight <= at("list").clientHeight;
  put("earlier", inShort(earlier));
  for (let count = former.length; count > 0 && !room(); count--) {
    at("trials").rows[count - 1].remove();
    earlier.unshift(former[count - 1].sign);
    put("earlier", inShort(earlier));
  }
}

function inShort(signs) {
  const counts = Object.keys(SIGNS).map((sign) => [sign, signs.filter((one) => one === sign).length]);
  const words = counts.filter(([, count]) => count).map(([sign, count]) => `${sign} ${count} ${SIGNS[sign]}`);
  return signs.length ? `Earlier: ${words.join(" · ")}` : "";
}

function alarm(troubles) {
  at("alarm").hidden = !troubles.length;
  put("alarm", troubles.join(" "));
}

async function ask() {
  try {
    const answer = await fetch("live.json", { cache: "no-store", signal: AbortSignal.timeout(SILENT_MS) });
    const text = await answer.text();
    const state = JSON.parse(text);
    heard = Date.now();
    if (text !== shown && state.trials) {
      shown = text;
      show(state);
    }
    alarm(state.troubles || []);
  } catch {
    if (Date.now() - heard >= SILENT_MS) {
      alarm([`No word from addb-viewer since ${timeOf(heard)}: what stands here may be old. Is it still running?`]);
    }
  }
  put("clock", timeOf(Date.now()));
  setTimeout(ask, EVERY_MS);
}

ask();
new ResizeObserver(() => listed && list()).observe(at("list"));
