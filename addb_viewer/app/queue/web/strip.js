// A trial's lanes in one strip: above, the frames whose force counts; below, proposals and what people decided.

let colors = {};

export function readColors() {
  const style = getComputedStyle(document.documentElement);
  const names = ["counts", "left", "open", "accepted", "decided", "conflict"];
  colors = Object.fromEntries(names.map((name) => [name, style.getPropertyValue(`--${name}`).trim()]));
}

export function draw(canvas, row) {
  const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * ratio)) canvas.width = Math.round(width * ratio);
  if (canvas.height !== Math.round(height * ratio)) canvas.height = Math.round(height * ratio);
  const pen = canvas.getContext("2d");
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  if (!row.frames) return;
  const bar = (start, end, top, tall, color) => {
    pen.fillStyle = color;
    const left = (width * start) / row.frames, right = (width * end) / row.frames;
    pen.fillRect(left, top, Math.max(right - left, 1.5), tall);
  };
  bar(0, row.frames, 1, 12, colors.left);
  for (const [start, end] of row.used) bar(start, end, 1, 12, colors.counts);
  bar(0, row.frames, 21.5, 0.5, colors.left);
  for (const [start, end, certainty, state] of row.proposals) {
    const tall = 2 + 6 * certainty;
    bar(start, end, 22 - tall, tall, state === "open" ? colors.open : colors.accepted);
  }
  for (const [start, end] of row.reviewed) bar(start, end, 23.5, 4, colors.decided);
  for (const [start, end] of row.conflicts) bar(start, end, 23.5, 4, colors.conflict);
}

export function words(row) {
  if (!row.fitted) return "";
  const said = [`${row.frames} frames; the force counts on ${Math.round(100 * (1 - (row.leftOut ?? 1)))} %`];
  if (row.proposals.length) said.push(`proposals: ${row.open} open of ${row.proposals.length}`);
  if (row.conflicts.length) said.push(`people disagree on ${row.conflicts.length} range${row.conflicts.length > 1 ? "s" : ""}`);
  return said.join(". ");
}
