// What the rows come to: their state in words, which of them the filters let through, and their order.

export const key = (row) => `${row.subject}\n${row.trial}`;

export const address = (row, frame = 0) => {
  const part = (text) => encodeURIComponent(text).replace(/[!'()*]/g, (c) => `%${c.charCodeAt(0).toString(16).toUpperCase()}`);
  return `/?at=${row.subject.split("/").map(part).join("/")}/${part(row.trial)}/${frame}`;
};

const RECENT_S = 15 * 60; // who edited so short a time ago in another app is still on it

// Sign, words, tone; the first that applies.
export function stateOf(row, live, me, now) {
  if (row.error) return ["⚠", "cannot be read", "bad"];
  const fit = live.batches.fit, others = (live.here.get(key(row)) ?? []).filter((name) => name !== me);
  const batch = Object.entries(live.batches).find(([, b]) => b.running && b.subject === row.subject);
  if (live.work[row.subject]) return ["↻", live.work[row.subject], "busy"];
  if (batch) {
    const words = { fit: "fitting", diagnose: "diagnosing", export: "exporting" }[batch[0]];
    const share = batch[1].fraction;
    return ["↻", share === null ? words : `${words} ${Math.round(100 * share)} %`, "busy"];
  }
  if (others.length) return ["◉", `${others.join(", ")} ${others.length > 1 ? "are" : "is"} on it`, "busy"];
  if (row.status === "finished") {
    return row.conflicts.length ? ["●", "finished, disagreement", "bad"] : ["●", `finished${row.by ? ` by ${row.by}` : ""}`, "good"];
  }
  if (row.conflicts.length) return ["≠", "disagreement", "bad"];
  if (row.waiting.length) return ["◆", `solve of ${row.waiting.join(", ")} waits`, "warn"];
  if (fit?.failures[row.subject] && !row.fitted) return ["⚠", "fit failed", "bad"];
  if (fit?.waiting.includes(row.subject)) return ["…", "waits to be fitted", "busy"];
  if (!row.fitted) return ["○", "no fit", ""];
  if (row.status === "needs a second look") return ["!", "second look", "warn"];
  if (row.last && row.last[0] !== me && !live.present.includes(row.last[0]) && now - row.last[1] < RECENT_S) return ["◉", `${row.last[0]} works on it`, "busy"];
  if (row.status === "in work") return ["◐", `in work${row.last ? ` by ${row.last[0]}` : ""}`, ""];
  if (row.status === "imported") return ["◐", "imported", ""];
  return ["○", "to review", ""];
}

export const CHIPS = {
  todo: ["To do", (row) => row.status !== "finished"],
  finished: ["Finished", (row) => row.status === "finished"],
  open: ["Open proposals", (row) => row.open > 0],
  mine: ["My trials", (row, me) => me !== "" && (row.assigned === me || row.people.includes(me))],
  conflicts: ["Disagreement", (row) => row.conflicts.length > 0],
  unfitted: ["Not fitted", (row) => !row.fitted && !row.error],
  angles: ["Not for torques", (row) => row.fitted && row.verdict?.[1] !== "Torques usable"],
  comments: ["Comments", (row) => row.openComments > 0],
};

/** Of two filters that no row passes together, the one that was chosen last holds. */
export const INSTEAD = { todo: "finished", finished: "todo" };

export const NOBODY = "(nobody)";
export const CHOICES = {
  source: (row) => row.sources,
  cause: (row) => row.causes,
  activity: (row) => (row.activity ? row.activity.split(", ") : []),
  assigned: (row) => [row.assigned || NOBODY],
};

export function letThrough(rows, filter, me) {
  const words = filter.words.toLowerCase().split(/\s+/).filter(Boolean);
  const chips = Object.keys(CHIPS).filter((name) => filter.chips.has(name)).map((name) => CHIPS[name][1]);
  const choices = Object.entries(filter.choices).filter(([, wanted]) => wanted);
  return rows.filter((row) => {
    const name = `${row.subject} ${row.trial}`.toLowerCase();
    return words.every((word) => name.includes(word))
      && chips.every((fits) => fits(row, me))
      && choices.every(([kind, wanted]) => CHOICES[kind](row).includes(wanted));
  });
}

const text = (a, b) => a.localeCompare(b, undefined, { numeric: true });
const number = (of) => (a, b) => (of(a) ?? -Infinity) - (of(b) ?? -Infinity);

// How much a trial needs a person: what cannot be read first, then by score, what has no fit, and what is finished.
const need = (row) => (row.error ? 1e6 : row.status === "finished" ? row.score - 2e6 : row.fitted ? row.score : -1e6);

// By column: how two rows compare, and whether the first click begins with the largest.
export const ORDERS = {
  state: [(a, b, state) => text(state(a)[1], state(b)[1]), false],
  trial: [(a, b) => text(a.trial, b.trial) || text(a.subject, b.subject), false],
  verdict: [number(need), true],
  activity: [(a, b) => text(a.activity, b.activity), true],
  assigned: [(a, b) => text(a.assigned, b.assigned), true],
  last: [number((row) => row.last?.[1]), true],
  comments: [(a, b) => a.openComments - b.openComments || a.comments - b.comments, true],
};

export function inOrder(rows, column, down, state) {
  const [compare] = ORDERS[column];
  return rows
    .map((row, place) => [row, place])
    .sort(([a, i], [b, j]) => (down ? -1 : 1) * compare(a, b, state) || text(a.subject, b.subject) || i - j)
    .map(([row]) => row);
}

export function ago(seconds) {
  if (seconds < 90) return "just now";
  if (seconds < 5400) return `${Math.round(seconds / 60)} min ago`;
  if (seconds < 129600) return `${Math.round(seconds / 3600)} h ago`;
  return `${Math.round(seconds / 86400)} d ago`;
}

export function hours(value) {
  if (value === null) return "";
  return value < 1.5 ? `${Math.max(1, Math.round(60 * value))} min` : `${value.toFixed(value < 10 ? 1 : 0)} h`;
}
