// Rows of the timeline: a label, and blocks that the timeline puts where their frames are.
import { element } from "./elements.js";

const FOOT = 32, ROW = 18, LOWEST = 8; // [pixel] heights: three things lie in a foot's; of what has room for a word

export const heightOf = (row) => (row.foot ? FOOT : ROW);

export function rowOf(row) {
  const label = element("div", { className: "addb-label", title: row.label }, row.label);
  const told = { className: "addb-blocks", role: row.blocks.length ? "list" : "group", "aria-label": row.label };
  const blocks = element("div", told, ...row.blocks.map((block) => blockOf(block, row)));
  return element("div", { className: "addb-row", style: { height: `${heightOf(row)}px` } }, label, blocks);
}

function blockOf(block, row) {
  const inside = block.height * heightOf(row) - 2; // [pixel] between its borders
  const faded = (percent) => `color-mix(in srgb, ${block.color} ${percent}%, transparent)`;
  const style = {
    top: `${100 * block.top}%`,
    height: `${100 * block.height}%`,
    lineHeight: `${inside}px`,
    border: block.hollow ? "1.5px dashed var(--addb-ink)" : `1px solid ${block.color}`,
    color: block.hatched || block.hollow ? "var(--addb-ink)" : block.ink,
    background: block.hollow ? "none" : block.hatched ? `repeating-linear-gradient(135deg, ${faded(55)} 0 3px, ${faded(15)} 3px 7px)` : block.color,
  };
  const told = { className: `addb-block${block.outlined ? " outlined" : ""}`, role: "listitem", "aria-label": `${block.start} to ${block.end - 1}: ${block.told}` };
  const dataset = { start: block.start, end: block.end, foot: row.foot ?? "" };
  return element("div", { ...told, dataset, style, block }, inside < LOWEST ? "" : block.text, ...(block.flag ? [edge("start"), edge("end")] : []));
}

const edge = (side) => element("div", { className: "addb-edge", dataset: { side }, style: { [side === "start" ? "left" : "right"]: 0 } });
