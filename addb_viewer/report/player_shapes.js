// Shapes of the player on a WebGL canvas: shaded solids; lines and points of one tint.
const playerShapes = (gl) => {
  "use strict";
  const { sub, cross, unit, dot } = playerNumbers;

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

  const scratch = gl.createBuffer();

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

  return { solid, flat, at, buffered, rod, rodBetween, drawSolid, drawFlat, PLACE, OTHER };
};
