// Plays the scene of a report: drag turns, wheel or pinch zooms, Shift-drag moves, the bar goes to a frame.
// Everything comes from the page itself: the script element #scene-data, made by scene_data.py.
(async () => {
  "use strict";
  const root = document.getElementById("player");
  const data = JSON.parse(document.getElementById("scene-data").textContent);
  const find = (name) => root.querySelector(`[data-role="${name}"]`);
  const canvas = find("canvas");
  const gl = canvas.getContext("webgl", { antialias: true });
  if (!gl || typeof DecompressionStream === "undefined") {
    find("message").textContent =
      "This browser cannot play the scene (it needs WebGL and DecompressionStream); see the still pictures.";
    return;
  }
  gl.getExtension("OES_element_index_uint");

  // --- numbers ----------------------------------------------------------------------------------------

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

  // --- shapes -----------------------------------------------------------------------------------------

  const PLACE = 0, OTHER = 1; // attributes: where, and normal or tint

  function program(vertex, fragment, other) {
    const made = gl.createProgram();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(made, shader);
    }
    gl.bindAttribLocation(made, PLACE, "place");
    gl.bindAttribLocation(made, OTHER, other);
    gl.linkProgram(made);
    return made;
  }

  const solid = program(
    `attribute vec3 place; attribute vec3 normal; uniform mat4 view, model; uniform mat3 turn; varying vec3 n;
     void main() { n = turn * normal; gl_Position = view * model * vec4(place, 1.0); }`,
    `precision mediump float; varying vec3 n; uniform vec3 color, light;
     void main() { float d = abs(dot(normalize(n), light)); gl_FragColor = vec4(color * (0.38 + 0.62 * d), 1.0); }`,
    "normal",
  );
  const flat = program(
    `attribute vec3 place; attribute vec4 tint; uniform mat4 view; uniform float size; varying vec4 c;
     void main() { c = tint; gl_Position = view * vec4(place, 1.0); gl_PointSize = size / gl_Position.w; }`,
    `precision mediump float; varying vec4 c; uniform bool round;
     void main() { if (round && length(gl_PointCoord - 0.5) > 0.5) discard; gl_FragColor = c; }`,
    "tint",
  );
  const at = (made, name) => gl.getUniformLocation(made, name);

  function buffered(vertices, faces) {
    const normals = new Float32Array(vertices.length);
    for (let f = 0; f < faces.length; f += 3) {
      const [a, b, c] = [0, 1, 2].map((k) => vertices.slice(3 * faces[f + k], 3 * faces[f + k] + 3));
      const n = cross(sub(b, a), sub(c, a));
      for (let k = 0; k < 3; k++) for (let i = 0; i < 3; i++) normals[3 * faces[f + k] + i] += n[i];
    }
    const put = (kind, values) => {
      const buffer = gl.createBuffer();
      gl.bindBuffer(kind, buffer);
      gl.bufferData(kind, values, gl.STATIC_DRAW);
      return buffer;
    };
    return {
      vertices: put(gl.ARRAY_BUFFER, new Float32Array(vertices)),
      normals: put(gl.ARRAY_BUFFER, normals),
      faces: put(gl.ELEMENT_ARRAY_BUFFER, new Uint16Array(faces)),
      count: faces.length,
    };
  }

  // A rod of radius and length 1 along y, and a cone likewise.
  function rod(top) {
    const vertices = [], faces = [], sides = 12;
    for (let i = 0; i < sides; i++) {
      const [x, z] = [Math.cos((2 * Math.PI * i) / sides), Math.sin((2 * Math.PI * i) / sides)];
      vertices.push(x, 0, z, top * x, 1, top * z);
      const [a, b] = [2 * i, 2 * ((i + 1) % sides)];
      faces.push(a, a + 1, b, b, a + 1, b + 1);
    }
    const middle = vertices.length / 3;
    vertices.push(0, 0, 0);
    for (let i = 0; i < sides; i++) faces.push(middle, 2 * i, 2 * ((i + 1) % sides));
    return buffered(vertices, faces);
  }

  const shaft = rod(1), head = rod(0.001);
  const meshes = await Promise.all(
    data.meshes.map(async (mesh) => {
      if (!mesh) return null;
      const faces = Array.from(await unpacked(mesh.faces, mesh.faceCount), Math.round);
      return buffered(await unpacked(mesh.vertices, mesh.count), faces);
    }),
  );

  // --- state ------------------------------------------------------------------------------------------

  const HOME = { up: 0.19, distance: 4.1, height: 0.92 };
  const AHEAD = 1.08; // [rad] from where the person faces, as the still pictures
  const FIELD = 0.49; // [rad] vertical field of view
  let trial = null, index = 0, frame = 0, playing = false, clock = 0, isDirty = true;
  const camera = { turn: 0, up: HOME.up, distance: HOME.distance, target: [0, HOME.height, 0], follows: true };
  const loaded = new Map();

  async function load(which) {
    const source = data.trials[which];
    const series = async (packed) => (packed ? unpacked(packed, source.frames) : null);
    const arrows = source.arrows.map(async (arrow) => ({
      ...arrow, rgb: rgb(arrow.color), start: await series(arrow.start), force: await series(arrow.force),
    }));
    return {
      ...source,
      markers: await series(source.markers),
      positions: await series(source.positions),
      quaternions: await series(source.quaternions),
      arrows: await Promise.all(arrows),
      width: source.markers.width / 3,
      bodies: source.positions ? source.positions.width / 3 : 0,
    };
  }

  async function select(which, at = 0) {
    if (!loaded.has(which)) loaded.set(which, await load(which));
    index = which;
    trial = loaded.get(which);
    find("trial").value = String(which);
    find("bar").max = String(trial.frames - 1);
    drawMarks();
    go(at / trial.every);
    home();
  }

  function home() {
    const pelvis = poses()[trial.root];
    const heading = pelvis ? Math.atan2(pelvis[2], pelvis[0]) : 0;
    Object.assign(camera, { turn: heading + AHEAD, up: HOME.up, distance: HOME.distance, follows: true });
    find("follow").checked = true;
    isDirty = true;
  }

  function go(to) {
    frame = Math.min(Math.max(Math.round(to), 0), trial.frames - 1);
    const at = frame * trial.every;
    find("bar").value = String(frame);
    const seconds = (trial.start + frame / trial.rate).toFixed(2);
    const flags = trial.flags.filter((flag) => flag.start <= at && at < flag.end);
    const counts = trial.kept.some(([start, end]) => start <= at && at < end);
    find("where").textContent = `frame ${at} of ${trial.last}, ${seconds} s`;
    find("bar").setAttribute("aria-valuetext", `frame ${at}, ${seconds} s`);
    const status = find("status");
    status.className = counts ? "status good" : "status bad";
    status.textContent = counts
      ? "✓ usable"
      : `✗ left out — ${flags.map((flag) => flag.words).join("; ") || "no reason recorded"}`;
    for (const line of document.querySelectorAll(".timeline")) {
      const cursor = line.querySelector(".cursor");
      cursor.hidden = Number(line.dataset.trial) !== index;
      cursor.style.setProperty("--share", trial.last ? at / trial.last : 0);
    }
    isDirty = true;
  }

  function play(on) {
    playing = on;
    clock = 0;
    if (on && frame >= trial.frames - 1) go(0);
    find("play").textContent = on ? "❚❚ Pause" : "▶ Play";
    find("play").setAttribute("aria-pressed", String(on));
  }

  function drawMarks() {
    const marks = find("marks");
    marks.replaceChildren();
    for (const flag of trial.flags) {
      const mark = document.createElement("i");
      mark.style.left = `${(100 * flag.start) / (trial.last + 1)}%`;
      mark.style.width = `${(100 * (flag.end - flag.start)) / (trial.last + 1)}%`;
      mark.style.background = flag.color;
      mark.title = flag.words;
      marks.append(mark);
    }
  }

  // --- drawing ----------------------------------------------------------------------------------------

  const scratch = gl.createBuffer();
  let colors = {};

  function readColors() {
    const style = getComputedStyle(root);
    const probe = document.createElement("canvas").getContext("2d", { willReadFrequently: true });
    for (const name of ["paper", "line", "faint", "ink"]) {
      probe.fillStyle = style.getPropertyValue(`--scene-${name}`);
      probe.fillRect(0, 0, 1, 1);
      colors[name] = Array.from(probe.getImageData(0, 0, 1, 1).data.slice(0, 3), (c) => c / 255);
    }
    isDirty = true;
  }

  function view() {
    const eye = [
      camera.target[0] + camera.distance * Math.cos(camera.up) * Math.cos(camera.turn),
      camera.target[1] + camera.distance * Math.sin(camera.up),
      camera.target[2] + camera.distance * Math.cos(camera.up) * Math.sin(camera.turn),
    ];
    const back = unit(sub(eye, camera.target));
    const right = unit(cross([0, 1, 0], back));
    const up = cross(back, right);
    const look = new Float32Array([
      right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0,
      -dot(right, eye), -dot(up, eye), -dot(back, eye), 1,
    ]);
    const [near, far, f] = [0.05, 80, 1 / Math.tan(FIELD / 2)];
    const lens = new Float32Array(16);
    lens[0] = (f * canvas.height) / canvas.width;
    lens[5] = f;
    lens[10] = (near + far) / (near - far);
    lens[11] = -1;
    lens[14] = (2 * near * far) / (near - far);
    return { matrix: product(lens, look), right, up, back };
  }

  function drawSolid(shape, model, color, eye) {
    gl.bindBuffer(gl.ARRAY_BUFFER, shape.vertices);
    gl.vertexAttribPointer(PLACE, 3, gl.FLOAT, false, 0, 0);
    gl.bindBuffer(gl.ARRAY_BUFFER, shape.normals);
    gl.vertexAttribPointer(OTHER, 3, gl.FLOAT, false, 0, 0);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, shape.faces);
    gl.uniformMatrix4fv(at(solid, "view"), false, eye.matrix);
    gl.uniformMatrix4fv(at(solid, "model"), false, model);
    const turn = [];
    for (const column of [0, 4, 8]) turn.push(...unit([model[column], model[column + 1], model[column + 2]]));
    gl.uniformMatrix3fv(at(solid, "turn"), false, turn);
    gl.uniform3fv(at(solid, "color"), color);
    gl.drawElements(gl.TRIANGLES, shape.count, gl.UNSIGNED_SHORT, 0);
  }

  // places: x y z r g b a, one after another.
  function drawFlat(kind, places, eye, size = 0) {
    if (!places.length) return;
    gl.bindBuffer(gl.ARRAY_BUFFER, scratch);
    gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(places), gl.DYNAMIC_DRAW);
    gl.vertexAttribPointer(PLACE, 3, gl.FLOAT, false, 28, 0);
    gl.vertexAttribPointer(OTHER, 4, gl.FLOAT, false, 28, 12);
    gl.uniformMatrix4fv(at(flat, "view"), false, eye.matrix);
    gl.uniform1f(at(flat, "size"), size);
    gl.uniform1i(at(flat, "round"), kind === gl.POINTS);
    gl.drawArrays(kind, 0, places.length / 7);
  }

  function rodBetween(start, end, radius) {
    const y = sub(end, start);
    const x = unit(cross(y, Math.abs(y[1]) < 0.9 * Math.hypot(...y) ? [0, 1, 0] : [1, 0, 0]));
    const z = unit(cross(x, y));
    return new Float32Array([
      ...x.map((v) => v * radius), 0, ...y, 0, ...z.map((v) => v * radius), 0, ...start, 1,
    ]);
  }

  function drawArrow(arrow, eye) {
    const start = Array.from(arrow.start.subarray(3 * frame, 3 * frame + 3));
    const force = Array.from(arrow.force.subarray(3 * frame, 3 * frame + 3));
    const along = force.map((f) => f * arrow.scale);
    const length = Math.hypot(...along);
    if (!(length > 0.015)) return;
    const [neck, wide] = [Math.max(1 - 0.1 / length, 0.4), Math.min(0.034, 0.4 * length)];
    const color = arrow.demanded ? colors.ink : arrow.rgb;
    const point = (share) => start.map((s, i) => s + share * along[i]);
    if (arrow.demanded) {
      for (let s = 0; s < neck; s += 0.08 / length)
        drawSolid(shaft, rodBetween(point(s), point(Math.min(s + 0.045 / length, neck)), 0.009), color, eye);
    } else {
      drawSolid(shaft, rodBetween(start, point(neck), wide * 0.38), color, eye);
    }
    drawSolid(head, rodBetween(point(neck), point(1), wide), color, eye);
  }

  // Blue at no error over orange to vermilion at 4 cm, as everywhere in this program.
  const RAMP = [[0, 114, 178], [86, 180, 233], [230, 159, 0], [213, 94, 0]].map((c) => c.map((v) => v / 255));
  function errorColor(error) {
    const place = Math.min(error / 0.04, 1) * 3;
    const low = Math.min(Math.floor(place), 2);
    return RAMP[low].map((c, i) => c + (place - low) * (RAMP[low + 1][i] - c));
  }

  function poses() {
    const found = [];
    for (let body = 0; body < trial.bodies; body++) {
      const p = trial.positions.subarray(3 * (frame * trial.bodies + body));
      const q = trial.quaternions.subarray(4 * (frame * trial.bodies + body));
      const scale = 1 / Math.hypot(q[0], q[1], q[2], q[3]);
      found.push(
        Number.isNaN(p[0] + q[0]) ? null : pose(p[0], p[1], p[2], ...[q[0], q[1], q[2], q[3]].map((v) => v * scale)),
      );
    }
    return found;
  }

  function draw() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2);
    const size = [canvas.clientWidth, canvas.clientHeight].map((v) => Math.max(Math.round(v * ratio), 1));
    if (canvas.width !== size[0] || canvas.height !== size[1]) [canvas.width, canvas.height] = size;
    const bodies = poses();
    const pelvis = bodies[trial.root];
    if (camera.follows && pelvis) camera.target = [pelvis[12], HOME.height, pelvis[14]];
    const eye = view();
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(...colors.paper, 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enableVertexAttribArray(PLACE);
    gl.enableVertexAttribArray(OTHER);
    gl.useProgram(flat);
    const lines = [];
    const line = (points, color) => {
      for (let i = 1; i < points.length; i++) lines.push(...points[i - 1], ...color, 1, ...points[i], ...color, 1);
    };
    for (const ends of trial.floor) line(ends, colors.faint);
    const trace = [];
    for (const plate of trial.plates) {
      line(plate.outline, colors.ink);
      for (const point of plate.trace) trace.push(point[0], point[1] + 0.002, point[2], ...colors.line, 1);
    }
    const points = [];
    const where = (marker) => Array.from(trial.markers.subarray(3 * (frame * trial.width + marker)).subarray(0, 3));
    const errors = new Map();
    for (const own of trial.modelMarkers) {
      const [measured, body] = [where(own.marker), bodies[own.body]];
      if (!body || Number.isNaN(measured[0])) continue;
      const model = moved(body, own.at);
      errors.set(own.marker, Math.hypot(...sub(model, measured)));
      line([measured, model], colors.ink);
    }
    for (let marker = 0; marker < trial.width; marker++) {
      const place = where(marker);
      const error = errors.get(marker);
      if (!Number.isNaN(place[0])) points.push(...place, ...(error === undefined ? colors.line : errorColor(error)), 1);
    }
    const pixels = canvas.height / Math.tan(FIELD / 2) / 2;
    drawFlat(gl.LINES, lines, eye);
    drawFlat(gl.POINTS, trace, eye, 0.008 * pixels * 2);
    drawFlat(gl.POINTS, points, eye, 0.011 * pixels * 2);
    gl.useProgram(solid);
    const light = [0, 1, 2].map((i) => -0.35 * eye.right[i] + 0.5 * eye.up[i] + 0.79 * eye.back[i]);
    gl.uniform3fv(at(solid, "light"), light);
    const now = frame * trial.every;
    const flagged = new Map();
    for (const flag of trial.flags)
      if (flag.foot !== null && flag.start <= now && now < flag.end) flagged.set(flag.foot, rgb(flag.color));
    const bone = data.bone.map((c) => c / 255);
    bodies.forEach((model, body) => {
      if (model && meshes[body]) drawSolid(meshes[body], model, flagged.get(body) || bone, eye);
    });
    for (const arrow of trial.arrows) drawArrow(arrow, eye);
  }

  function tick(time) {
    if (playing) {
      if (clock) {
        const next = clock.frame + ((time - clock.time) / 1000) * trial.rate * Number(find("speed").value);
        if (next >= trial.frames - 1) {
          go(trial.frames - 1);
          play(false);
        } else if (Math.floor(next) !== frame) go(Math.floor(next));
      } else clock = { time, frame };
    }
    if (isDirty && canvas.clientWidth) {
      isDirty = false;
      draw();
    }
    requestAnimationFrame(tick);
  }

  // --- hands ------------------------------------------------------------------------------------------

  const fingers = new Map();
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  for (const end of ["pointerup", "pointercancel"])
    canvas.addEventListener(end, (event) => fingers.delete(event.pointerId));
  const spread = () => {
    const [a, b] = [...fingers.values()];
    return Math.hypot(a[0] - b[0], a[1] - b[1]);
  };
  canvas.addEventListener("pointermove", (event) => {
    const before = fingers.get(event.pointerId);
    if (!before) return;
    const was = fingers.size === 2 ? spread() : 0;
    const [dx, dy] = [event.clientX - before[0], event.clientY - before[1]];
    fingers.set(event.pointerId, [event.clientX, event.clientY]);
    if (fingers.size === 2) camera.distance = Math.min(Math.max((camera.distance * was) / (spread() || 1), 0.4), 30);
    else if (event.shiftKey || event.buttons & 6) {
      const eye = view();
      const scale = (camera.distance * Math.tan(FIELD / 2) * 2) / canvas.clientHeight;
      camera.target = camera.target.map((v, i) => v - scale * (dx * eye.right[i] - dy * eye.up[i]));
      camera.follows = find("follow").checked = false;
    } else {
      camera.turn += dx * 0.008;
      camera.up = Math.min(Math.max(camera.up + dy * 0.008, -1.2), 1.5);
    }
    isDirty = true;
  });
  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    camera.distance = Math.min(Math.max(camera.distance * Math.exp(event.deltaY * 0.001), 0.4), 30);
    isDirty = true;
  }, { passive: false });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("keydown", (event) => {
    const steps = { ArrowLeft: -1, ArrowRight: 1, PageUp: -trial.rate, PageDown: trial.rate };
    if (event.key === " ") play(!playing);
    else if (event.key === "Home") go(0);
    else if (event.key === "End") go(trial.frames - 1);
    else if (event.key in steps) go(frame + steps[event.key]);
    else return;
    event.preventDefault();
  });
  find("play").addEventListener("click", () => play(!playing));
  find("bar").addEventListener("input", (event) => {
    play(false);
    go(Number(event.target.value));
  });
  find("speed").addEventListener("change", () => { clock = 0; });
  find("home").addEventListener("click", home);
  find("follow").addEventListener("change", (event) => {
    camera.follows = event.target.checked;
    isDirty = true;
  });
  find("trial").addEventListener("change", (event) => {
    play(false);
    select(Number(event.target.value));
  });
  for (const link of document.querySelectorAll("[data-seek]"))
    link.addEventListener("click", () => {
      const [which, at] = link.dataset.seek.split(":").map(Number);
      play(false);
      if (which === index) go(at / trial.every);
      else select(which, at);
    });
  for (const line of document.querySelectorAll(".timeline"))
    line.addEventListener("click", async (event) => {
      const area = line.querySelector(".area").getBoundingClientRect();
      const share = Math.min(Math.max((event.clientX - area.left) / area.width, 0), 1);
      const which = Number(line.dataset.trial);
      play(false);
      if (which !== index) await select(which);
      go((share * trial.last) / trial.every);
    });
  window.addEventListener("resize", () => { isDirty = true; });
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", readColors);
  find("message").hidden = true;
  readColors();
  await select(0, Number(root.dataset.frame));
  root.dataset.ready = "true";
  requestAnimationFrame(tick);
})();
