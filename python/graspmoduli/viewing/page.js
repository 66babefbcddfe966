// Draws the object, and one of its grasps, with nothing but WebGL.
const data = JSON.parse(document.getElementById("data").textContent);
const at = (id) => document.getElementById(id);
const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
const floats = (text) => new Float32Array(bytes(text));
const canvas = at("scene"), labels = at("labels");
const gl = canvas.getContext("webgl2", { antialias: true, alpha: true, premultipliedAlpha: false });
let chosen = 0, target = [0, 0, 0], way = [1, 0, 0], far = 3, draw = () => {};

const add = (a, b, t = 1) => a.map((x, k) => x + t * b[k]);
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => { const n = Math.hypot(...a) || 1; return a.map((x) => x / n); };
const FOV = 0.7, turned = () => { const right = unit(cross([0, 0, 1], way)); return [right, cross(way, right)]; };

// Eye and target such that all points are in the picture.
const home = () => {
  const one = data.grasps[chosen], points = data.outline.concat(one ? one.points : []);
  way = one ? one.way : [0.9, 0.3, 0.3];
  const [right, up] = turned(), tall = Math.tan(FOV / 2) * 0.88;
  const wide = tall * Math.max(canvas.clientWidth, 1) / Math.max(canvas.clientHeight, 1);
  const xs = points.map((p) => dot(p, right)), ys = points.map((p) => dot(p, up)), zs = points.map((p) => dot(p, way));
  const middle = (v) => (Math.min(...v) + Math.max(...v)) / 2, x = middle(xs), y = middle(ys);
  far = Math.max(...points.map((_, k) => zs[k] + Math.max(Math.abs(xs[k] - x) / wide, Math.abs(ys[k] - y) / tall)));
  target = add(add([0, 0, 0], right, x), up, y);
  draw();
};

const show = (rank) => {
  chosen = rank;
  const one = data.grasps[rank];
  at("state").innerHTML = one ? one.state : data.none;
  at("contacts").innerHTML = one ? one.contacts : "";
  at("which").textContent = data.grasps.length ? `${rank + 1} of ${data.grasps.length}` : "none";
  document.querySelectorAll("[data-rank]").forEach((row, k) => {
    row.style.fontWeight = k === rank ? "bold" : "";
    row.firstElementChild.textContent = k === rank ? "▸" : "";
    row.toggleAttribute("aria-current", k === rank);
  });
  home();
};
at("rank").disabled = data.grasps.length < 2;
at("rank").addEventListener("input", (event) => show(Number(event.target.value) - 1));
at("home").addEventListener("click", home);
document.querySelectorAll("[data-rank]").forEach((row, k) => {
  row.style.cursor = "pointer";
  row.addEventListener("click", () => { at("rank").value = k + 1; show(k); });
});

if (!gl) {
  at("lost").style.display = "flex";
} else {
  const compile = (kind, source) => {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    return shader;
  };
  const program = gl.createProgram();
  gl.attachShader(program, compile(gl.VERTEX_SHADER, `#version 300 es
    in vec3 place; in vec3 normal; in vec4 paint; uniform mat4 view; uniform float size;
    out vec3 facing; out vec4 color;
    void main() { facing = normal; color = paint; gl_Position = view * vec4(place, 1.0); gl_PointSize = size; }`));
  gl.attachShader(program, compile(gl.FRAGMENT_SHADER, `#version 300 es
    precision mediump float; in vec3 facing; in vec4 color; uniform vec3 light; uniform vec3 towards; out vec4 shown;
    void main() {
      float n = length(facing);
      vec3 f = n > 0.0 ? facing / n : towards;
      if (dot(f, towards) < 0.0) f = -f;
      shown = vec4(color.rgb * (n > 0.0 ? 0.5 + 0.55 * max(dot(f, light), 0.0) : 1.0), color.a);
    }`));
  gl.linkProgram(program);
  gl.useProgram(program);
  const places = ["place", "normal", "paint"].map((name) => gl.getAttribLocation(program, name));
  const [view, light, towards, size] = ["view", "light", "towards", "size"].map((name) => gl.getUniformLocation(program, name));

  // Vertices with normals and colours (RGBA, 0 to 255), as triangles, lines or points.
  const part = (kind, vertices, normals, colors, faces) => {
    const array = gl.createVertexArray();
    gl.bindVertexArray(array);
    [[vertices, 3, gl.FLOAT], [normals, 3, gl.FLOAT], [colors, 4, gl.UNSIGNED_BYTE]].forEach(([values, wide, type], k) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ARRAY_BUFFER, values, gl.STATIC_DRAW);
      gl.enableVertexAttribArray(places[k]);
      gl.vertexAttribPointer(places[k], wide, type, k === 2, 0, 0);
    });
    if (faces) {
      gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, gl.createBuffer());
      gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, faces, gl.STATIC_DRAW);
    }
    return { array, kind, count: faces ? faces.length : vertices.length / 3, indexed: !!faces };
  };
  const painted = (count, color) => Uint8Array.from({ length: 4 * count }, (_, k) => color[k % 4]);
  const faceNormals = (v) => {
    const normals = new Float32Array(v.length);
    for (let k = 0; k < v.length; k += 9) {
      const a = [v[k], v[k + 1], v[k + 2]], b = [v[k + 3], v[k + 4], v[k + 5]], c = [v[k + 6], v[k + 7], v[k + 8]];
      const n = unit(cross(add(b, a, -1), add(c, a, -1)));
      for (let j = 0; j < 9; ++j) normals[k + j] = n[j % 3];
    }
    return normals;
  };
  const object = floats(data.object.vertices);
  let body;
  if (data.object.faces) {
    const faces = new Uint32Array(bytes(data.object.faces)), normals = new Float32Array(object.length);
    for (let k = 0; k < faces.length; k += 3) {
      const [a, b, c] = [0, 1, 2].map((j) => Array.from(object.subarray(3 * faces[k + j], 3 * faces[k + j] + 3)));
      const n = cross(add(b, a, -1), add(c, a, -1));
      for (let j = 0; j < 3; ++j) for (let i = 0; i < 3; ++i) normals[3 * faces[k + j] + i] += n[i];
    }
    body = part(gl.TRIANGLES, object, normals, painted(object.length / 3, data.object.color), faces);
  } else body = part(gl.POINTS, object, new Float32Array(object.length), painted(object.length / 3, data.object.color));
  const lines = floats(data.net.vertices);
  const net = part(gl.LINES, lines, new Float32Array(lines.length), painted(lines.length / 3, data.net.color));
  const grasps = data.grasps.map((one) => {
    const solid = floats(one.solid), glass = floats(one.glass);
    return [
      part(gl.TRIANGLES, solid, faceNormals(solid), new Uint8Array(bytes(one.solidColors))),
      part(gl.TRIANGLES, glass, faceNormals(glass), new Uint8Array(bytes(one.glassColors))),
    ];
  });

  draw = () => {
    const scale = window.devicePixelRatio || 1;
    const w = Math.round(canvas.clientWidth * scale), h = Math.round(canvas.clientHeight * scale);
    if (canvas.width !== w || canvas.height !== h) { canvas.width = w; canvas.height = h; }
    const [right, up] = turned(), eye = add(target, way, far), f = 1 / Math.tan(FOV / 2), a = w / Math.max(h, 1);
    const near = Math.max(far - 4, 0.02), end = far + 4, p = (near + end) / (near - end), q = 2 * near * end / (near - end);
    const row = (v, k) => [k * v[0], k * v[1], k * v[2], -k * dot(v, eye)];
    const x = row(right, f / a), y = row(up, f), z = row(way, p), d = row(way, -1);
    z[3] += q;
    const matrix = [x, y, z, d];
    gl.viewport(0, 0, w, h);
    gl.clearColor(0, 0, 0, 0);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.BLEND);
    gl.blendFuncSeparate(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.uniformMatrix4fv(view, false, Float32Array.from({ length: 16 }, (_, k) => matrix[k % 4][k >> 2]));
    gl.uniform3fv(towards, way);
    gl.uniform3fv(light, unit(add(add(way, up, 0.6), right, -0.5)));
    gl.uniform1f(size, 3 * scale);
    const paint = (one, glass) => {
      gl.depthMask(!glass);
      gl.bindVertexArray(one.array);
      one.indexed ? gl.drawElements(one.kind, one.count, gl.UNSIGNED_INT, 0) : gl.drawArrays(one.kind, 0, one.count);
    };
    const now = grasps[chosen];
    if (now) paint(now[0], false);
    paint(body, false);
    if (at("net").checked) paint(net, false);
    if (now) {
      paint(now[1], true);
      // What the object hides shines through it.
      gl.depthMask(true);
      gl.depthFunc(gl.GREATER);
      gl.blendColor(0, 0, 0, 0.35);
      gl.blendFuncSeparate(gl.CONSTANT_ALPHA, gl.ONE_MINUS_CONSTANT_ALPHA, gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
      paint(now[0], true);
      gl.depthFunc(gl.LESS);
    }
    gl.depthMask(true);
    labels.replaceChildren();
    for (const [text, place, color] of data.grasps[chosen]?.labels || []) {
      const v = [...place, 1], on = matrix.map((r) => r[0] * v[0] + r[1] * v[1] + r[2] * v[2] + r[3]);
      const label = document.createElement("div");
      label.className = "label";
      label.textContent = text;
      label.style.left = `${50 + 50 * on[0] / on[3]}%`;
      label.style.top = `${50 - 50 * on[1] / on[3]}%`;
      if (color) label.style.borderBottom = `3px solid ${color}`;
      labels.append(label);
    }
  };

  const turn = (dx, dy) => {
    const azimuth = Math.atan2(way[1], way[0]) - dx, high = Math.max(-1.5, Math.min(1.5, Math.asin(way[2]) + dy));
    way = [Math.cos(azimuth) * Math.cos(high), Math.sin(azimuth) * Math.cos(high), Math.sin(high)];
    draw();
  };
  const near = (by) => { far = Math.max(0.5, Math.min(12, far * by)); draw(); };
  const down = new Map();
  let apart = 0;
  canvas.addEventListener("pointerdown", (event) => { canvas.setPointerCapture(event.pointerId); down.set(event.pointerId, event); apart = 0; });
  for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (event) => { down.delete(event.pointerId); apart = 0; });
  canvas.addEventListener("pointermove", (event) => {
    const before = down.get(event.pointerId);
    if (!before) return;
    down.set(event.pointerId, event);
    if (down.size === 1) turn(0.008 * (event.clientX - before.clientX), 0.008 * (event.clientY - before.clientY));
    else {
      const [one, other] = [...down.values()], now = Math.hypot(one.clientX - other.clientX, one.clientY - other.clientY);
      if (apart) near(apart / now);
      apart = now;
    }
  });
  canvas.addEventListener("wheel", (event) => { event.preventDefault(); near(Math.exp(0.001 * event.deltaY)); }, { passive: false });
  canvas.addEventListener("keydown", (event) => {
    const step = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, 0.1], ArrowDown: [0, -0.1] }[event.key];
    if (step) turn(...step);
    else if (event.key === "+" || event.key === "-") near(event.key === "+" ? 0.9 : 1.1);
    else if (event.key === "Home") home();
    else return;
    event.preventDefault();
  });
  at("net").addEventListener("change", draw);
  new ResizeObserver(home).observe(canvas);
}
show(0);
