// SPDX-License-Identifier: Apache-2.0
// Clipping: only the part inside a box of the left camera's frame is drawn and framed. Corners are
// in the drawing's frame (y up, z towards the viewer).
const clip = { low: [-1e30, -1e30, -1e30], high: [1e30, 1e30, 1e30], all: null, central: null, on: false };
const CLIP_SIDES = ['near', 'far', 'left', 'right', 'top', 'bottom'];

// The range of each coordinate without this share of outliers at each end.
function clipRanges(positions, share) {
  const ranges = [];
  for (let axis = 0; axis < 3; axis++) {
    const values = new Float32Array(positions.length / 3);
    for (let i = 0; i < values.length; i++) values[i] = positions[3 * i + axis];
    values.sort();
    const skip = Math.floor(values.length * share);
    ranges.push([values[skip], values[values.length - 1 - skip]]);
  }
  return ranges;
}

function isShown(vertex) {
  const p = view.mesh.positions;
  for (let axis = 0; axis < 3; axis++) {
    const value = p[3 * vertex + axis];
    if (value < clip.low[axis] || value > clip.high[axis]) return false;
  }
  return true;
}

// Depths are spaced like disparities: near objects get more of the range.
function depthAt(share) {
  const [far, near] = clip.all[2];
  if (!(near < 0)) return far + (near - far) * (1 - share);
  return 1 / (1 / near + share * (1 / far - 1 / near));
}

function readClip() {
  const share = {};
  for (const side of CLIP_SIDES) share[side] = element(`clip-${side}`).value / 1000;
  const across = (axis, s) => clip.all[axis][0] + s * (clip.all[axis][1] - clip.all[axis][0]);
  const [near, far] = [depthAt(Math.min(share.near, share.far)), depthAt(Math.max(share.near, share.far))];
  clip.on = false;
  const limit = (ends, at, index, side, value, free) => {
    const moved = share[side] !== at;
    clip.on = clip.on || moved;
    ends[index] = moved ? value : free;
  };
  limit(clip.high, 0, 2, 'near', near, 1e30);
  limit(clip.low, 1, 2, 'far', far, -1e30);
  limit(clip.low, 0, 0, 'left', across(0, share.left), -1e30);
  limit(clip.high, 1, 0, 'right', across(0, share.right), 1e30);
  limit(clip.high, 0, 1, 'top', across(1, 1 - share.top), 1e30);
  limit(clip.low, 1, 1, 'bottom', across(1, 1 - share.bottom), -1e30);
  element('clip-text').textContent = clip.on ? `Z ${lengthText(-Math.min(clip.high[2], clip.all[2][1]))} to ${lengthText(-Math.max(clip.low[2], clip.all[2][0]))}` : '';
}

// Whether a vertex is framed: all that are shown, or, without clipping, most of them.
function isFramed(vertex) {
  const p = view.mesh.positions;
  return clip.on ? isShown(vertex) : clip.central.every(([low, high], axis) => p[3 * vertex + axis] >= low && p[3 * vertex + axis] <= high);
}

// The centre of the box around the framed part; null when nothing is visible.
function framedCentre() {
  const p = view.mesh.positions, low = [Infinity, Infinity, Infinity], high = [-Infinity, -Infinity, -Infinity];
  for (let i = 0; i < p.length / 3; i++)
    if (isFramed(i))
      for (let axis = 0; axis < 3; axis++) {
        low[axis] = Math.min(low[axis], p[3 * i + axis]);
        high[axis] = Math.max(high[axis], p[3 * i + axis]);
      }
  return low[0] <= high[0] ? low.map((v, axis) => (v + high[axis]) / 2) : null;
}

// The distance from which the framed part fits into the view in this direction.
function fittingDistance(centre) {
  const { right, up, back } = viewerAxes(), p = view.mesh.positions;
  const high = Math.tan(view.fov / 2), wide = high * view.canvas.clientWidth / view.canvas.clientHeight;
  let distance = 1e-6;
  for (let i = 0; i < p.length / 3; i++) {
    if (!isFramed(i)) continue;
    const q = [0, 1, 2].map((axis) => p[3 * i + axis] - centre[axis]);
    const along = (a) => a[0] * q[0] + a[1] * q[1] + a[2] * q[2];
    distance = Math.max(distance, along(back) + Math.max(Math.abs(along(right)) / wide, Math.abs(along(up)) / high));
  }
  return 1.05 * distance;
}

function countShown() {
  let count = 0;
  for (let i = 0; i < view.mesh.positions.length / 3; i++) count += isShown(i);
  return count;
}

// Frames the visible part, or most of the surface; without clipping and turning from the camera's
// position.
function frameView() {
  view.canvas.dataset.shown = countShown();
  findHome();
  view.fov = fieldOfView(view.canvas.clientWidth / view.canvas.clientHeight);
  const centre = clip.on || !view.fromCamera ? framedCentre() : null;
  if (centre) view.home = { target: centre, distance: fittingDistance(centre) };
  view.target = view.home.target.slice();
  view.distance = view.home.distance;
}

function startClip() {
  // A few distant points would make the sliders useless, and the first view a distant one.
  clip.all = clipRanges(view.mesh.positions, 0.002);
  clip.central = clipRanges(view.mesh.positions, 0.02);
  const changed = () => { readClip(); frameView(); redraw(); };
  for (const side of CLIP_SIDES) element(`clip-${side}`).addEventListener('input', changed);
  element('clip-reset').addEventListener('click', () => {
    for (const side of CLIP_SIDES) element(`clip-${side}`).value = ['near', 'left', 'top'].includes(side) ? 0 : 1000;
    changed();
  });
}
