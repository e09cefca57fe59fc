// Numbers of the player: packed series, vectors, matrices by columns, colours.
const playerNumbers = (() => {
  "use strict";

  async function unpacked(series, frames) {
    const bytes = Uint8Array.from(atob(series.data), (c) => c.charCodeAt(0));
    const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
    const planes = new Uint8Array(await new Response(stream).arrayBuffer());
    const { width, step, offset } = series;
    const high = width * frames;
    const values = new Float32Array(high);
    for (let column = 0; column < width; column++) {
      let whole = 0;
      for (let frame = 0; frame < frames; frame++) {
        const i = column * frames + frame;
        whole = (whole + (planes[i] | (planes[high + i] << 8))) & 0xffff;
        const signed = whole > 0x7fff ? whole - 0x10000 : whole;
        values[frame * width + column] = signed === -0x8000 ? NaN : signed * step + offset;
      }
    }
    return values;
  }

  const rgb = (hex) => [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16) / 255);
  const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const cross = (a, b) => [
    a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0],
  ];
  const unit = (a) => {
    const length = Math.hypot(...a) || 1;
    return a.map((x) => x / length);
  };

  // Matrices are by columns, as WebGL takes them.
  function product(a, b) {
    const c = new Float32Array(16);
    for (let j = 0; j < 4; j++)
      for (let i = 0; i < 4; i++)
        for (let k = 0; k < 4; k++) c[4 * j + i] += a[4 * k + i] * b[4 * j + k];
    return c;
  }

  function pose(x, y, z, w, qx, qy, qz) {
    return new Float32Array([
      1 - 2 * (qy * qy + qz * qz), 2 * (qx * qy + w * qz), 2 * (qx * qz - w * qy), 0,
      2 * (qx * qy - w * qz), 1 - 2 * (qx * qx + qz * qz), 2 * (qy * qz + w * qx), 0,
      2 * (qx * qz + w * qy), 2 * (qy * qz - w * qx), 1 - 2 * (qx * qx + qy * qy), 0,
      x, y, z, 1,
    ]);
  }

  const moved = (m, p) => [0, 1, 2].map((i) => m[i] * p[0] + m[4 + i] * p[1] + m[8 + i] * p[2] + m[12 + i]);

  // Blue at no error over orange to vermilion at 4 cm, as everywhere in this program.
  const RAMP = [[0, 114, 178], [86, 180, 233], [230, 159, 0], [213, 94, 0]].map((c) => c.map((v) => v / 255));
  function errorColor(error) {
    const place = Math.min(error / 0.04, 1) * 3;
    const low = Math.min(Math.floor(place), 2);
    return RAMP[low].map((c, i) => c + (place - low) * (RAMP[low + 1][i] - c));
  }

  return { unpacked, rgb, sub, dot, cross, unit, product, pose, moved, errorColor };
})();
