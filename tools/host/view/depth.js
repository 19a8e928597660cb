// SPDX-License-Identifier: Apache-2.0
// Live depth: what the server measured of a pair at part of its size.
const REASON_VALID = 0;

/** Takes the arrays after the line of JSON. */
function readDepth(buffer) {
  const bytes = new Uint8Array(buffer);
  const end = bytes.indexOf(10);
  const about = JSON.parse(new TextDecoder().decode(bytes.subarray(0, end)));
  const count = about.width * about.height;
  let at = end + 1;
  const part = (Type) => { const size = count * Type.BYTES_PER_ELEMENT; const array = new Type(buffer.slice(at, at + size)); at += size; return array; };
  return {about, width: about.width, height: about.height, disparity: part(Int32Array), sigma: part(Uint16Array), reason: part(Uint8Array), grey: [part(Uint8Array), part(Uint8Array)]};
}

/** Depth in mm at a pixel; NaN: none. */
function depthAt(depth, index) {
  const parallax = depth.disparity[index] / 256 - depth.about.offset;
  return depth.reason[index] === REASON_VALID && parallax > 0 ? depth.about.f * depth.about.baseline / parallax : NaN;
}

function canvasOf(depth, paint) {
  const made = document.createElement('canvas');
  made.width = depth.width; made.height = depth.height;
  const image = new ImageData(depth.width, depth.height);
  paint(new Uint32Array(image.data.buffer));
  made.getContext('2d').putImageData(image, 0, 0);
  return made;
}

const colourTable = new Uint32Array(facts.colours.map(([r, g, b]) => (255 << 24 | b << 16 | g << 8 | r) >>> 0));
const HOLE = 0xff8a8a8a;

/** Near is bright; the range is that of 98 % of the pixels, in inverse depths, and follows slowly. */
let shownRange = null;
function rangeOf(depth) {
  const inverse = [];
  for (let i = 0; i < depth.reason.length; i += 7) { const mm = depthAt(depth, i); if (mm > 0) inverse.push(1 / mm); }
  if (inverse.length < 20) return shownRange;
  inverse.sort((a, b) => a - b);
  const now = [0.01, 0.99].map((share) => inverse[Math.floor(share * (inverse.length - 1))]);
  shownRange = shownRange ? shownRange.map((old, i) => old + 0.2 * (now[i] - old)) : now;
  return shownRange;
}

function paintDepth(depth) {
  const range = rangeOf(depth);
  depth.left = canvasOf(depth, (to) => depth.grey[0].forEach((v, i) => { to[i] = (255 << 24 | v << 16 | v << 8 | v) >>> 0; }));
  depth.right = canvasOf(depth, (to) => depth.grey[1].forEach((v, i) => { to[i] = (255 << 24 | v << 16 | v << 8 | v) >>> 0; }));
  depth.map = canvasOf(depth, (to) => {
    for (let i = 0; i < to.length; i++) {
      const mm = depthAt(depth, i);
      to[i] = mm > 0 && range ? colourTable[Math.min(255, Math.max(0, Math.round(255 * (1 / mm - range[0]) / (range[1] - range[0] || 1))))] : HOLE;
    }
  });
  return range;
}

const lengthText = (mm) => mm >= 10000 ? (mm / 1000).toFixed(2) + ' m' : mm.toFixed(mm < 1000 ? 1 : 0) + ' mm';

/** How well rows agree: the grade, and the reason. In pixels of the picture. */
function rowsGrade(about) {
  const {samples, trend, curve, median} = about.vertical;
  const px = Math.max(trend, curve) / about.scale;
  if (samples < 50) return ['fair', 'rows not known: too little texture in both pictures'];
  const figure = 'rows ' + (median / about.scale).toFixed(2) + ' px apart (median), ' + px.toFixed(2) + ' px of it systematic';
  return px < 0.5 ? ['good', figure] : px < 1.5 ? ['fair', figure + ': a capture is corrected by its own matches'] : ['bad', figure + ': the cameras stand otherwise than calibrated. A capture is corrected by its own matches; else calibrate again'];
}

function showDepth(depth) {
  const range = paintDepth(depth);
  stage.depth = depth;
  const {about} = depth;
  const [grade, why] = rowsGrade(about);
  const line = element('depth-state');
  line.innerHTML = '<span class="pill ' + grade + '">' + {good: 'rows agree', fair: 'rows: fair', bad: 'rows disagree'}[grade] + '</span><span></span><br><b id="depth-here"></b>';
  line.querySelector('span:nth-of-type(2)').textContent = (100 * about.share).toFixed(0) + ' % measured; ' + why + '; ' + about.ms.toFixed(0) + ' ms' +
    (about.common_sigma > 0 ? '; all depths together ± ' + lengthText(about.common_sigma) + ' at ' + lengthText(about.common_at) : '');
  element('depth-legend').hidden = !range;
  if (range) {
    element('depth-ramp').style.background = 'linear-gradient(90deg,' + facts.colours.filter((_, i) => i % 15 === 0).reverse().map((c) => 'rgb(' + c + ')').join(',') + ')';
    element('depth-ticks').innerHTML = [0, 0.5, 1].map((s) => '<span style="left:' + 100 * s + '%">' + lengthText(1 / (range[1] + s * (range[0] - range[1]))) + '</span>').join('');
  }
  showDepthAt(stage.pointer);
}

/** The depth and its standard deviation under the pointer. */
function showDepthAt(at) {
  const here = element('depth-here');
  if (!here || !stage.depth) return;
  const {about} = stage.depth;
  const inside = at && (at.pane.kind === 'depth' || (at.pane.kind === 'rectified' && at.pane.side === 0)) && at.x >= 0 && at.y >= 0 && at.x < about.width && at.y < about.height;
  if (!inside) { here.textContent = ''; return; }
  const index = Math.floor(at.y) * about.width + Math.floor(at.x);
  const mm = depthAt(stage.depth, index);
  const sigma = mm * mm * stage.depth.sigma[index] / 256 / (about.f * about.baseline);
  here.textContent = mm > 0 ? 'Here: ' + lengthText(mm) + (about.refined ? ' ± ' + lengthText(sigma) : '') : 'Here: ' + about.reasons[stage.depth.reason[index]][0];
}
