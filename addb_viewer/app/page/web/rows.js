// Rows of the timeline: a label, and blocks that the timeline puts where their frames are.
const FOOT = 32, ROW = 18; // [pixel] heights: three things lie in a foot's

export const heightOf = (row) => (row.foot ? FOOT : ROW);

export function rowOf(row) {
  const line = document.createElement("div");
  line.className = "addb-row";
  line.style.height = `${heightOf(row)}px`;
  const label = document.createElement("div");
  label.className = "addb-label";
  label.textContent = label.title = row.label;
  const blocks = document.createElement("div");
  blocks.className = "addb-blocks";
  blocks.setAttribute("role", row.blocks.length ? "list" : "group");
  blocks.setAttribute("aria-label", row.label);
  blocks.append(...row.blocks.map((block) => blockOf(block, row)));
  line.append(label, blocks);
  return line;
}

function blockOf(block, row) {
  const made = document.createElement("div");
  made.className = `addb-block${block.outlined ? " outlined" : ""}`;
  made.setAttribute("role", "listitem");
  made.setAttribute("aria-label", `${block.start} to ${block.end - 1}: ${block.told}`);
  Object.assign(made.dataset, { start: block.start, end: block.end, foot: row.foot ?? "" });
  made.textContent = block.text;
  const faded = (percent) => `color-mix(in srgb, ${block.color} ${percent}%, transparent)`;
  Object.assign(made.style, {
    top: `${100 * block.top}%`,
    height: `${100 * block.height}%`,
    borderColor: block.color,
    color: block.hatched ? "var(--addb-ink)" : block.ink,
    background: block.hatched ? `repeating-linear-gradient(135deg, ${faded(55)} 0 3px, ${faded(15)} 3px 7px)` : block.color,
  });
  made.block = block;
  if (block.flag) made.append(edge("start"), edge("end"));
  return made;
}

function edge(side) {
  const made = document.createElement("div");
  made.className = "addb-edge";
  made.style[side === "start" ? "left" : "right"] = 0;
  made.dataset.side = side;
  return made;
}
