// SPDX-License-Identifier: Apache-2.0
// Draws the surface. Camera: an orbit about `target`; vertical field of view `fov`.
const VERTEX_SHADER = `
attribute vec3 position; attribute vec3 normal; attribute vec2 place; attribute vec4 value;
uniform mat4 toScreen;
varying vec3 surfaceNormal; varying vec2 spot; varying vec2 measure; varying vec3 inside;
void main() {
  inside = position;
  surfaceNormal = normal; spot = place; measure = value.xy;
  gl_Position = toScreen * vec4(position, 1.0);
}`;
const FRAGMENT_SHADER = `
#ifdef GL_FRAGMENT_PRECISION_HIGH
precision highp float;
#else
precision mediump float;
#endif
uniform vec3 clipLow; uniform vec3 clipHigh;
uniform sampler2D photo; uniform sampler2D ramp; uniform float shade; uniform vec3 light; uniform vec4 ink;
varying vec3 surfaceNormal; varying vec2 spot; varying vec2 measure; varying vec3 inside;
void main() {
  if (any(lessThan(inside, clipLow)) || any(greaterThan(inside, clipHigh))) discard;
  vec3 n = normalize(surfaceNormal);
  float lit = 0.32 + 0.68 * abs(dot(n, light));
  vec3 colour = texture2D(photo, spot).rgb;
  if (shade > 0.5) colour = vec3(0.80, 0.83, 0.82) * lit;
  if (shade > 1.5) colour = 0.5 + 0.5 * n;
  if (shade > 2.5) colour = texture2D(ramp, vec2(measure.x * 0.996 + 0.002, 0.5)).rgb * (0.5 + 0.5 * lit);
  if (shade > 3.5) colour = texture2D(ramp, vec2(measure.y * 0.996 + 0.002, 0.5)).rgb * (0.5 + 0.5 * lit);
  gl_FragColor = vec4(mix(colour, ink.rgb, ink.a), 1.0);
}`;

const view = {
  canvas: element('view'), gl: null, mesh: null, shade: 0, wire: false,
  fromCamera: true, yaw: 0, pitch: 0, distance: 1, target: [0, 0, 0], fov: 0.6, home: null,
  matrix: new Float32Array(16), waiting: false, afterDraw: [], nets: new Map(),
};

function makeProgram(gl) {
  const program = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, VERTEX_SHADER], [gl.FRAGMENT_SHADER, FRAGMENT_SHADER]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
  return program;
}

function uploadAttribute(gl, name, data, size, type, normalised) {
  const where = gl.getAttribLocation(view.program, name);
  gl.bindBuffer(gl.ARRAY_BUFFER, gl.createBuffer());
  gl.bufferData(gl.ARRAY_BUFFER, data, gl.STATIC_DRAW);
  gl.enableVertexAttribArray(where);
  gl.vertexAttribPointer(where, size, type, normalised, 0, 0);
}

function uploadTexture(gl, unit, source) {
  gl.activeTexture(gl.TEXTURE0 + unit);
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  if (source instanceof Uint8Array)
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, 256, 1, 0, gl.RGB, gl.UNSIGNED_BYTE, source);
  else gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGB, gl.RGB, gl.UNSIGNED_BYTE, source);
  for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, side, gl.CLAMP_TO_EDGE);
  for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.LINEAR);
}

function uploadMesh(gl, mesh) {
  uploadAttribute(gl, 'position', mesh.positions, 3, gl.FLOAT, false);
  uploadAttribute(gl, 'normal', mesh.normals, 4, gl.BYTE, true);
  uploadAttribute(gl, 'place', mesh.places, 2, gl.UNSIGNED_SHORT, true);
  uploadAttribute(gl, 'value', mesh.values, 4, gl.UNSIGNED_BYTE, true);
  view.triangleBuffer = gl.createBuffer();
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, view.triangleBuffer);
  gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, mesh.triangles, gl.STATIC_DRAW);
}

// Directions of the viewer's right, up and back in the drawing's frame.
function viewerAxes() {
  const cy = Math.cos(view.yaw), sy = Math.sin(view.yaw), cp = Math.cos(view.pitch), sp = Math.sin(view.pitch);
  return { right: [cy, 0, -sy], up: [sy * sp, cp, cy * sp], back: [sy * cp, -sp, cy * cp] };
}

// The vertical field of view into which the photograph fits.
function fieldOfView(aspect) {
  return 2 * Math.atan(Math.max(page.full_height / page.fy, page.full_width / page.f / aspect) / 2 * 1.04);
}

function updateMatrix() {
  const { right, up, back } = viewerAxes();
  const eye = view.target.map((t, i) => t + view.distance * back[i]);
  const dot = (a) => a[0] * eye[0] + a[1] * eye[1] + a[2] * eye[2];
  const aspect = view.canvas.width / view.canvas.height;
  view.fov = fieldOfView(aspect);
  const g = 1 / Math.tan(view.fov / 2), near = view.distance / 100, far = view.distance * 100;
  const rows = [right, up, back].map((a) => [...a, -dot(a)]);
  const a = (far + near) / (near - far), b = 2 * far * near / (near - far);
  for (let c = 0; c < 4; c++) {
    view.matrix[4 * c] = g / aspect * rows[0][c];
    view.matrix[4 * c + 1] = g * rows[1][c];
    view.matrix[4 * c + 2] = a * rows[2][c] + (c === 3 ? b : 0);
    view.matrix[4 * c + 3] = -rows[2][c];
  }
}

function draw() {
  view.waiting = false;
  const { gl, canvas, mesh } = view;
  const ratio = Math.min(2, window.devicePixelRatio || 1);
  const width = Math.max(1, Math.round(canvas.clientWidth * ratio)), height = Math.max(1, Math.round(canvas.clientHeight * ratio));
  if (canvas.width !== width || canvas.height !== height) { canvas.width = width; canvas.height = height; }
  gl.viewport(0, 0, width, height);
  gl.clearColor(0, 0, 0, 0);
  gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  updateMatrix();
  const { right, up, back } = viewerAxes();
  const light = [0, 1, 2].map((i) => 0.35 * up[i] - 0.3 * right[i] + 0.89 * back[i]);
  gl.uniformMatrix4fv(view.uniform.toScreen, false, view.matrix);
  gl.uniform3fv(view.uniform.light, light);
  gl.uniform1f(view.uniform.shade, view.shade);
  gl.uniform3fv(view.uniform.clipLow, clip.low);
  gl.uniform3fv(view.uniform.clipHigh, clip.high);
  gl.uniform4f(view.uniform.ink, 0, 0, 0, 0);
  gl.polygonOffset(1, 1);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, view.triangleBuffer);
  gl.drawElements(gl.TRIANGLES, mesh.triangles.length, gl.UNSIGNED_INT, 0);
  if (view.wire) drawWire(gl, mesh);
  for (const after of view.afterDraw) after();
}

// Rows and columns between the lines of the wireframe: about 7 screen pixels at the target.
function netSpacing() {
  const nodePixels = view.mesh.step * page.step * page.depth_median / page.f * view.canvas.clientHeight / (2 * Math.tan(view.fov / 2) * view.distance);
  return nodePixels >= 5 ? 1 : 2 ** Math.ceil(Math.log2(7 / nodePixels));
}

function drawWire(gl, mesh) {
  const spacing = netSpacing();
  if (!view.nets.has(spacing)) {
    const edges = edgesOf(mesh, spacing);
    const buffer = gl.createBuffer();
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, edges, gl.STATIC_DRAW);
    view.nets.set(spacing, { buffer, count: edges.length });
  }
  const net = view.nets.get(spacing);
  gl.uniform4f(view.uniform.ink, 0.01, 0.08, 0.09, 0.8);
  gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, net.buffer);
  gl.drawElements(gl.LINES, net.count, gl.UNSIGNED_INT, 0);
}

function redraw() {
  if (!view.gl || view.waiting) return;
  view.waiting = true;
  requestAnimationFrame(draw);
}

// Screen position (CSS px) of a drawn point, or null behind the viewer.
function screenOf(x, y, z) {
  const m = view.matrix, w = m[3] * x + m[7] * y + m[11] * z + m[15];
  if (w <= 0) return null;
  return [(0.5 + (m[0] * x + m[4] * y + m[8] * z + m[12]) / w / 2) * view.canvas.clientWidth,
          (0.5 - (m[1] * x + m[5] * y + m[9] * z + m[13]) / w / 2) * view.canvas.clientHeight];
}

// The vertex at a screen position: the nearest to the viewer of those within a few pixels.
function vertexAt(x, y) {
  const p = view.mesh.positions, m = view.matrix, reach = 7;
  const wide = view.canvas.clientWidth / 2, high = view.canvas.clientHeight / 2;
  let best = -1, least = Infinity;
  for (let i = 0; i < p.length; i += 3) {
    const px = p[i], py = p[i + 1], pz = p[i + 2];
    const w = m[3] * px + m[7] * py + m[11] * pz + m[15];
    if (w <= 0) continue;
    const dx = (1 + (m[0] * px + m[4] * py + m[8] * pz + m[12]) / w) * wide - x;
    const dy = (1 - (m[1] * px + m[5] * py + m[9] * pz + m[13]) / w) * high - y;
    const away2 = dx * dx + dy * dy;
    if (away2 > reach * reach || !isShown(i / 3)) continue;
    const rank = w * (1 + 0.004 * Math.sqrt(away2));
    if (rank < least) { least = rank; best = i / 3; }
  }
  return best;
}

function setPose(name) {
  const poses = { camera: [0, 0], orbit: [0.36, -0.18], top: [0, -1.35], side: [1.35, -0.05] };
  [view.yaw, view.pitch] = poses[name];
  view.fromCamera = name === 'camera';
  frameView();
  redraw();
}

// Looks from the left camera: the target is on its axis at the median depth, so that the picture
// equals the photograph and rotations are about the middle of the surface.
function findHome() {
  const depth = page.depth_median;
  const R = page.R_left_rect;
  const cx = (page.full_width / 2 - page.cx_left) / page.f, cy = (page.full_height / 2 - page.cy) / page.fy;
  const rect = [cx * depth, cy * depth, depth];
  const left = [0, 3, 6].map((k) => R[k] * rect[0] + R[k + 1] * rect[1] + R[k + 2] * rect[2]);
  view.home = { target: [left[0], -left[1], -left[2]], distance: Math.hypot(...left) };
}

function viewFailed(text) {
  element('view-text').textContent = text;
  if (element('still')) element('still').hidden = false;
  element('view-text').hidden = false;
  for (const tool of document.querySelectorAll('.viewer-tools, .clip')) tool.hidden = true;
}

function startView(photo) {
  if (!page.has_surface) return viewFailed('No surface was found: there is nothing to draw.');
  const options = { antialias: true, alpha: true, premultipliedAlpha: true };
  let gl = view.canvas.getContext('webgl2', options);
  if (!gl) {
    gl = view.canvas.getContext('webgl', options);
    if (gl && !gl.getExtension('OES_element_index_uint')) gl = null;
  }
  if (!gl) return viewFailed('WebGL is not available in this browser, so the surface cannot be drawn. Open mesh.glb in a 3D program instead.');
  view.gl = gl;
  view.program = makeProgram(gl);
  gl.useProgram(view.program);
  view.uniform = {};
  for (const name of ['toScreen', 'photo', 'ramp', 'shade', 'light', 'ink', 'clipLow', 'clipHigh']) view.uniform[name] = gl.getUniformLocation(view.program, name);
  view.mesh = buildMesh();
  view.canvas.dataset.triangles = view.mesh.triangles.length / 3;
  uploadMesh(gl, view.mesh);
  gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
  uploadTexture(gl, 0, photo);
  uploadTexture(gl, 1, Uint8Array.from(atob(page.ramp), (c) => c.charCodeAt(0)));
  gl.uniform1i(view.uniform.photo, 0);
  gl.uniform1i(view.uniform.ramp, 1);
  gl.enable(gl.DEPTH_TEST);
  gl.enable(gl.POLYGON_OFFSET_FILL);
  view.canvas.addEventListener('webglcontextlost', (event) => { event.preventDefault(); viewFailed('The graphics context was lost. Reload the page to draw the surface again.'); });
  element('view-text').hidden = true;
  if (element('still')) element('still').hidden = true;
  startControls();
  startClip();
  setPose('orbit');
}
