// Small multiples: each chart over its axis, over time or over the gait cycle. Drawn anew for other numbers and other frames.
import { css, resolved, told, trace } from "./curves.js";

export const GUTTER = 46, MARGIN = 10; // [pixel] left and right of every axis
const TICKS = 4; // about so many on an axis
const DASHES = [[7, 4], [3, 3], [9, 3, 2, 3], [2, 5]]; // of trials that are drawn over this one
const BEFORE = [1.5, 2.5]; // of the solve that is compared with
export const dashOf = (number) => DASHES[number % DASHES.length] ?? [];

export function niceTicks(low, high, about) {
  const raw = (high - low) / about || 1, power = 10 ** Math.floor(Math.log10(raw));
  const step = [1, 2, 5, 10].find((factor) => factor * power >= raw * 0.999) * power;
  const ticks = [];
  for (let k = Math.ceil(low / step - 1e-9); k * step <= high + 1e-9 * step; k++) ticks.push(k * step);
  return ticks;
}
export const tickText = (value, range) => {
  const digits = Math.max(0, Math.ceil(1 - Math.log10(range)));
  const text = value.toFixed(digits);
  return (text.includes(".") ? text.replace(/\.?0+$/, "") : text).replace("-", "−");
};

/** An empty plot: ground, axis and grid; gives the pen and the way from a value to a pixel. */
function plot(canvas, { low, high }) {
  const ratio = window.devicePixelRatio || 1, { clientWidth, clientHeight } = canvas;
  canvas.width = Math.round(clientWidth * ratio);
  canvas.height = Math.round(clientHeight * ratio);
  const pen = canvas.getContext("2d"), width = Math.max(clientWidth - GUTTER - MARGIN, 1), height = clientHeight - 2;
  const y = (value) => 1 + height * (1 - (value - low) / (high - low));
  pen.scale(ratio, ratio);
  pen.font = "11px system-ui, sans-serif";
  pen.fillStyle = css("--addb-row");
  pen.fillRect(GUTTER, 1, width, height);
  pen.textAlign = "right";
  pen.textBaseline = "middle";
  for (const tick of niceTicks(low, high, TICKS)) {
    pen.fillStyle = css("--addb-weak");
    pen.fillText(tickText(tick, high - low), GUTTER - 5, Math.min(Math.max(y(tick), 6), height - 5), GUTTER - 6);
    pen.fillStyle = tick === 0 ? css("--addb-weak") : css("--addb-line");
    pen.fillRect(GUTTER, Math.round(y(tick)), width, tick === 0 ? 1 : 0.5);
  }
  pen.beginPath();
  pen.rect(GUTTER, 0, width, clientHeight);
  pen.clip();
  return { pen, y, width, height };
}

/** A translucent band of `half` each way around `middle`, from key to key; none where either is null. */
function fillBand(pen, color, { middle, half, x, y, first, last, step }) {
  const known = (k) => k <= last && middle[k] !== null && half[k] !== null;
  pen.fillStyle = resolved(color);
  pen.globalAlpha = 0.22;
  for (let start = first; start <= last; start += step) {
    const keys = [];
    for (; known(start); start += step) keys.push(start);
    pen.beginPath();
    for (const k of keys) pen.lineTo(x(k), y(middle[k] + half[k]));
    for (const k of keys.reverse()) pen.lineTo(x(k), y(middle[k] - half[k]));
    pen.fill();
  }
  pen.globalAlpha = 1;
}

/** A chart over the frames shown; x: from a frame to a pixel; dashes: of a trial that is drawn over this one. */
export function drawOverTime(canvas, chart, span, dashes) {
  const { pen, y, width, height } = plot(canvas, chart);
  const x = (frame) => GUTTER + (width * (frame - span.first)) / Math.max(span.last - span.first, 1e-6);
  const step = Math.max(Math.floor((span.last - span.first) / (2 * width)), 1), first = step * Math.max(Math.floor(span.first / step), 0);
  for (const { values: middle, band: half, color } of chart.lines) if (half) fillBand(pen, color, { middle, half, x, y, first, last: Math.min(Math.ceil(span.last), half.length - 1), step });
  for (const { values, color, style, step, first, trial } of chart.lines) {
    pen.strokeStyle = resolved(color);
    pen.lineWidth = style ? 1.1 : 1.6;
    pen.setLineDash({ bound: [5, 4], before: BEFORE, trial: dashes(trial) }[style] ?? []);
    trace(pen, values, (at) => x(first + at * step), y, { first: (span.first - first) / step, last: (span.last - first) / step });
  }
  pen.beginPath();
  for (const [start, end] of chart.shaded) pen.rect(x(start - 0.5), 1, x(end - 0.5) - x(start - 0.5), height);
  for (const [color, alpha] of [[css("--addb-row"), 0.6], ["#808080", 0.25]]) { // what nobody measured is faint, on grey
    pen.fillStyle = color;
    pen.globalAlpha = alpha;
    pen.fill();
  }
  pen.globalAlpha = 1;
  pen.setLineDash([]);
  pen.textBaseline = "top";
  for (const [frame, value, color] of chart.peaks) {
    if (frame < span.first || frame > span.last) continue;
    const text = `▲ ${told(value)}`, half = pen.measureText(text).width / 2 + 2;
    const middle = Math.min(Math.max(x(frame), GUTTER + half), GUTTER + width - half);
    pen.fillStyle = css("--addb-row");
    pen.fillRect(middle - half, 1, 2 * half, 13);
    pen.fillStyle = resolved(color);
    pen.textAlign = "center";
    pen.fillText(text, middle, 2);
  }
}

/** A chart over the gait cycle: single strides thin, mean and one standard deviation, and where the foot leaves the ground. */
export function drawByCycle(canvas, chart, dashes) {
  const { pen, y, width, height } = plot(canvas, chart);
  const x = (percent) => GUTTER + (width * percent) / 100;
  const path = (values) => {
    values.forEach((value, percent) => pen.lineTo(x(percent), y(value)));
  };
  for (const { color, strides, foot_off: off, style } of chart.lines) {
    pen.strokeStyle = resolved(color);
    pen.lineWidth = 0.7;
    pen.globalAlpha = Math.min(0.45, Math.max(0.08, 5 / strides.length));
    for (const stride of strides) {
      pen.beginPath();
      path(stride);
      pen.stroke();
    }
    pen.globalAlpha = 1;
    if (off === null || style) continue;
    pen.setLineDash([2, 3]);
    pen.beginPath();
    pen.moveTo(x(off), 1);
    pen.lineTo(x(off), height);
    pen.stroke();
    pen.setLineDash([]);
  }
  for (const { color, mean, std, style } of chart.lines) {
    if (std && !style) fillBand(pen, color, { middle: mean, half: std, x, y, first: 0, last: 100, step: 1 });
  }
  for (const { color, mean, style, trial } of chart.lines) {
    pen.strokeStyle = resolved(color);
    pen.lineWidth = style ? 1.3 : 2;
    pen.setLineDash({ before: BEFORE, trial: dashes(trial) }[style] ?? []);
    pen.beginPath();
    path(mean);
    pen.stroke();
  }
}
