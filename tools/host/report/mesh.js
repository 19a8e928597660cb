// SPDX-License-Identifier: Apache-2.0
// The surface of the page: the measured pixels on a grid that a browser can draw smoothly, joined
// by the rule of the full mesh (neighbours more than a gap apart are never joined).
const MAX_NODES = 420000;

function meshStep() {
  let step = 1;
  while (Math.ceil(page.width / step) * Math.ceil(page.height / step) > MAX_NODES) step++;
  return step;
}

// True when every pixel from a to b (step pixels apart, `stride` between them) is measured and no
// two successive ones are more than the gap apart.
function joined(a, stride, step) {
  const gap = page.max_gap_q8 * page.step;
  for (let n = 0, i = a; n < step; n++, i += stride) {
    if (measured.reason[i] !== 0 || measured.reason[i + stride] !== 0) return false;
    if (Math.abs(measured.disparity_q8[i] - measured.disparity_q8[i + stride]) > gap) return false;
  }
  return true;
}

// Corners of up to two triangles of the cell whose top left pixel is a, as pixel numbers.
function cellTriangles(a, step, out) {
  const across = step, down = step * page.width;
  const b = a + across, c = a + down, d = a + across + down;
  const top = joined(a, 1, step), bottom = joined(c, 1, step);
  const left = joined(a, page.width, step), right = joined(b, page.width, step);
  const falling = joined(a, page.width + 1, step), rising = joined(b, page.width - 1, step);
  const q = measured.disparity_q8;
  const useFalling = falling && (!rising || Math.abs(q[a] - q[d]) <= Math.abs(q[b] - q[c]));
  out.length = 0;
  if (useFalling) {
    if (left && bottom) out.push(a, c, d);
    if (top && right) out.push(a, d, b);
  } else if (rising) {
    if (left && top) out.push(a, c, b);
    if (bottom && right) out.push(b, c, d);
  }
  return out;
}

function collectTriangles(step) {
  const corners = [], cell = [];
  for (let y = 0; y + step < page.height; y += step)
    for (let x = 0; x + step < page.width; x += step) {
      cellTriangles(y * page.width + x, step, cell);
      for (let i = 0; i < cell.length; i++) corners.push(cell[i]);
    }
  return corners;
}

function vertexNormals(positions, triangles) {
  const sums = new Float32Array(positions.length);
  for (let t = 0; t < triangles.length; t += 3) {
    const a = 3 * triangles[t], b = 3 * triangles[t + 1], c = 3 * triangles[t + 2];
    const ux = positions[b] - positions[a], uy = positions[b + 1] - positions[a + 1], uz = positions[b + 2] - positions[a + 2];
    const vx = positions[c] - positions[a], vy = positions[c + 1] - positions[a + 1], vz = positions[c + 2] - positions[a + 2];
    const nx = uy * vz - uz * vy, ny = uz * vx - ux * vz, nz = ux * vy - uy * vx;
    for (const k of [a, b, c]) { sums[k] += nx; sums[k + 1] += ny; sums[k + 2] += nz; }
  }
  const normals = new Int8Array(positions.length / 3 * 4);
  for (let i = 0, k = 0; i < sums.length; i += 3, k += 4) {
    const size = Math.hypot(sums[i], sums[i + 1], sums[i + 2]) || 1;
    for (let j = 0; j < 3; j++) normals[k + j] = Math.round(127 * sums[i + j] / size);
  }
  return normals;
}

// Positions are in the left camera's frame rotated for drawing: x right, y up, z towards the viewer.
function buildMesh() {
  const step = meshStep();
  const corners = collectTriangles(step);
  const number = new Int32Array(measured.pixels).fill(-1);
  const pixels = [];
  const triangles = new Uint32Array(corners.length);
  for (let i = 0; i < corners.length; i++) {
    if (number[corners[i]] < 0) { number[corners[i]] = pixels.length; pixels.push(corners[i]); }
    triangles[i] = number[corners[i]];
  }
  const positions = new Float32Array(3 * pixels.length);
  const places = new Uint16Array(2 * pixels.length);
  const values = new Uint8Array(4 * pixels.length);
  pixels.forEach((pixel, i) => {
    pointOf(pixel, positions, 3 * i);
    const depth = positions[3 * i + 2];
    const along = (depth - page.depth_low) / (page.depth_high - page.depth_low);
    values[4 * i] = Math.round(255 * Math.min(1, Math.max(0, 1 - along)));  // near is bright, as in the map
    const code = measured.sigmaLength[pixel];
    const sigma = (code - page.sigma_low_code) / Math.max(1, page.sigma_high_code - page.sigma_low_code);
    values[4 * i + 1] = Math.round(255 * Math.min(1, Math.max(0, sigma)));
    positions[3 * i + 1] *= -1;
    positions[3 * i + 2] *= -1;
    const column = pixel % page.width, row = (pixel - column) / page.width;
    places[2 * i] = Math.round((column * page.step + 0.5) / page.full_width * 65535);
    places[2 * i + 1] = Math.round((row * page.step + 0.5) / page.full_height * 65535);
  });
  return { step, pixels, positions, places, values, triangles, normals: vertexNormals(positions, triangles) };
}

// Edges to draw as lines. Spacing 1: every edge; else those along each spacing-th row and column of
// the mesh, so that from afar the lines remain distinguishable.
function edgesOf(mesh, spacing) {
  const lines = [], every = spacing * mesh.step;
  for (let t = 0; t < mesh.triangles.length; t += 3)
    for (let k = 0; k < 3; k++) {
      const a = mesh.triangles[t + k], b = mesh.triangles[t + (k + 1) % 3];
      const pa = mesh.pixels[a], pb = mesh.pixels[b];
      const xa = pa % page.width, xb = pb % page.width, ya = (pa - xa) / page.width, yb = (pb - xb) / page.width;
      if (spacing === 1 || xa === xb && xa % every === 0 || ya === yb && ya % every === 0) lines.push(a, b);
    }
  return new Uint32Array(lines);
}
