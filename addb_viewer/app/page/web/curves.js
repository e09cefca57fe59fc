// Curves of the timeline: each over its bound, with what is not counted shaded, on one canvas.
const TITLE = 15, LETTERS = 12; // [pixel] above a curve; of a figure beside it

export const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const seen = new Map(); // a colour may be one for light and one for dark pages
export const resolved = (color) => {
  const name = `${document.documentElement.dataset.addbTheme} ${color}`;
  if (!seen.has(name)) {
    const probe = document.createElement("i");
    probe.style.color = color;
    document.body.append(probe);
    seen.set(name, getComputedStyle(probe).color);
    probe.remove();
  }
  return seen.get(name);
};
export const told = (value, digits = Math.abs(value) >= 100 ? 0 : Math.abs(value) >= 10 ? 1 : 2) => {
  if (value === null || value === undefined) return "–";
  if (value === 0) return "0";
  return value.toFixed(digits).replace("-", "−");
};
/** A value and how far it may be off, of which two digits are told. */
export const toldWith = (value, spread) => {
  const digits = Math.min(Math.max(1 - Math.floor(Math.log10(spread || 1)), 0), 4);
  return `${told(value, digits)} ± ${told(spread, digits)}`;
};

/** Draws all curves.
 *  place: {left, width, top, height} of all of them [pixel]; x: from a frame to a pixel; span: frames shown. */
export function drawCurves(canvas, curves, place, x, span) {
  const ratio = window.devicePixelRatio || 1;
  const box = canvas.parentElement.getBoundingClientRect();
  canvas.width = Math.round(box.width * ratio);
  canvas.height = Math.round(box.height * ratio);
  canvas.style.width = `${box.width}px`;
  canvas.style.height = `${box.height}px`;
  const pen = canvas.getContext("2d");
  pen.scale(ratio, ratio);
  pen.font = `${LETTERS}px system-ui, sans-serif`;
  const each = place.height / Math.max(curves.length, 1);
  curves.forEach((curve, i) => {
    const top = place.top + i * each + TITLE, height = each - TITLE - 2;
    drawOne(pen, curve, { ...place, top, height }, x, span);
  });
}

function drawOne(pen, curve, { left, width, top, height }, x, span) {
  const y = (value) => top + height * (1 - (value - curve.low) / (curve.high - curve.low));
  pen.fillStyle = css("--addb-weak");
  pen.textAlign = "right";
  const toldAt = Math.max(y(curve.bound ?? curve.high) + 4, top + 9), bottom = top + height;
  pen.fillText(told(curve.bound ?? curve.high), left - 6, toldAt);
  if (bottom - toldAt >= LETTERS) pen.fillText(told(curve.low), left - 6, bottom);
  pen.textAlign = "left";
  pen.save();
  pen.beginPath();
  pen.rect(left, top, width, height);
  pen.clip();
  pen.fillStyle = css("--addb-row");
  pen.fillRect(left, top, width, height);
  pen.fillStyle = "rgba(128, 128, 128, 0.3)";
  for (const [start, end] of curve.shaded) pen.fillRect(x(start - 0.5), top, x(end - 0.5) - x(start - 0.5), height);
  if (curve.bound !== null) {
    pen.strokeStyle = css("--addb-weak");
    pen.setLineDash([5, 4]);
    pen.beginPath();
    pen.moveTo(left, y(curve.bound));
    pen.lineTo(left + width, y(curve.bound));
    pen.stroke();
  }
  if (curve.before) {
    pen.setLineDash([1.5, 2.5]);
    pen.strokeStyle = css("--addb-ink");
    pen.lineWidth = 1.2;
    trace(pen, curve.before, x, y, span);
  }
  pen.setLineDash([]);
  pen.strokeStyle = resolved(curve.color);
  pen.lineWidth = 1.4;
  trace(pen, curve.values, x, y, span);
  pen.restore();
}

/** Of several frames on one pixel column, the lowest and the highest: no peak is lost. */
export function trace(pen, values, x, y, span) {
  const first = Math.max(Math.floor(span.first) - 1, 0), last = Math.min(Math.ceil(span.last) + 1, values.length - 1);
  let column = null, low = 0, high = 0, drawing = false;
  const flush = () => {
    if (column === null) return;
    if (drawing) pen.lineTo(column, y(low));
    else pen.moveTo(column, y(low));
    if (high !== low) pen.lineTo(column, y(high));
    drawing = true;
    column = null;
  };
  pen.beginPath();
  for (let frame = first; frame <= last; frame++) {
    const value = values[frame];
    if (value === null) {
      flush();
      drawing = false;
      continue;
    }
    const at = Math.round(x(frame) * 2) / 2;
    if (at !== column) {
      flush();
      [column, low, high] = [at, value, value];
    } else [low, high] = [Math.min(low, value), Math.max(high, value)];
  }
  flush();
  pen.stroke();
}

/** Titles of all curves, and how high they stand [pixel]. */
export const titles = (curves, place) =>
  curves.map((curve, i) => ({ top: place.top + (i * place.height) / Math.max(curves.length, 1), curve }));
