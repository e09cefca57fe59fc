// Plays the scene of a report: drag turns, wheel or pinch zooms, Shift-drag moves, the bar goes to a frame.
// Everything comes from the page itself: the script element #scene-data, made by scene_data.py;
// player_numbers.js and player_shapes.js stand before it on the page.
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

  const { unpacked, rgb, sub, dot, cross, unit, product, pose, moved, errorColor } = playerNumbers;
  const { solid, flat, at, buffered, rod, rodBetween, drawSolid, drawFlat, PLACE, OTHER } = playerShapes(gl);

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

  function drawArrow(arrow, eye) {
    const start = Array.from(arrow.start.subarray(3 * frame, 3 * frame + 3));
    const force = Array.from(arrow.force.subarray(3 * frame, 3 * frame + 3));
    const along = force.map((f) => f * arrow.scale);
    const length = Math.hypot(...along);
    if (!(length > 0.015)) return;
    const [neck, wide] = [Math.max(1 - 0.1 / length, 0.4), Math.min(0.034, 0.4 * length)];
    const color = arrow.required ? colors.ink : arrow.rgb;
    const point = (share) => start.map((s, i) => s + share * along[i]);
    if (arrow.required) {
      for (let s = 0; s < neck; s += 0.08 / length)
        drawSolid(shaft, rodBetween(point(s), point(Math.min(s + 0.045 / length, neck)), 0.009), color, eye);
    } else {
      drawSolid(shaft, rodBetween(start, point(neck), wide * 0.38), color, eye);
    }
    drawSolid(head, rodBetween(point(neck), point(1), wide), color, eye);
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
