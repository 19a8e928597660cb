// SPDX-License-Identifier: Apache-2.0
// One pixel, marked in every picture: cross-hairs, the match in the right image, the readout.
const frames = Array.from(document.querySelectorAll('.frame[data-side]'));
const marked = { x: -1, y: -1, held: false, listeners: [] };

function addHairs(frame) {
  for (const kind of frame.dataset.side === 'right' ? ['row', 'dot'] : ['row', 'column', 'dot']) {
    const hair = document.createElement('div');
    hair.className = `hair ${kind}`;
    frame.append(hair);
  }
}

function placeHairs(frame, x, y) {
  const left = `${(x + 0.5) / page.width * 100}%`, top = `${(y + 0.5) / page.height * 100}%`;
  for (const hair of frame.querySelectorAll('.hair')) {
    if (!hair.classList.contains('row')) hair.style.left = left;
    if (!hair.classList.contains('column')) hair.style.top = top;
    hair.hidden = false;
  }
}

// Where a place in a rectified image is in the image as it was taken; null: not known.
function rawOf(side, x, y) {
  if (!page.raw) return null;
  const { step, columns, rows } = page.raw, nodes = page.raw[side];
  const i = Math.min(columns - 2, Math.max(0, Math.floor(x / step)));
  const j = Math.min(rows - 2, Math.max(0, Math.floor(y / step)));
  const u = x / step - i, v = y / step - j, raw = [0, 0];
  for (const [at, weight] of [[0, (1 - u) * (1 - v)], [1, u * (1 - v)], [columns, (1 - u) * v], [columns + 1, u * v]])
    for (let k = 0; k < 2; k++) {
      const value = nodes[2 * (j * columns + i + at) + k];
      if (value === null) return null;
      raw[k] += weight * value;
    }
  return `${raw[0].toFixed(1)},${raw[1].toFixed(1)}`;
}

// The mark of a pixel in both images, as `calibrate --touch-up` takes it.
function rawMark(x, y, disparity) {
  const left = rawOf('left', x, y), right = rawOf('right', x - disparity, y);
  return left && right ? `<span>in the images <b>${left},${right}</b></span>` : '';
}

function readoutParts(index) {
  const x = marked.x * page.step, y = marked.y * page.step;
  const parts = [`<span><b>${x}, ${y}</b> px</span>`];
  const reason = measured.reason[index];
  if (hasDisparity(index)) {
    const disparity = measured.disparity_q8[index] / 256;
    const sigma = measured.sigmaDisparity[index] / 256;
    parts.push(`<span>disparity <b>${disparity.toFixed(2)}</b>` +
               `${sigma > 0 ? ` ± ${sigma.toFixed(2)}` : ''} px</span>`);
    if (reason === 0) {
      const point = [0, 0, 0];
      pointOf(index, point, 0);
      const code = measured.sigmaLength[index];
      const reach = code > 0 ? sigmaLengthOf(code) : 0;
      parts.push(`<span>depth <b>${fixedLength(point[2], reach)}</b>` +
                 `${code > 0 ? ` ± ${Number(reach.toPrecision(2))}` : ''} ${page.unit}</span>`);
      parts.push(`<span>X ${fixedLength(point[0], reach)} Y ${fixedLength(point[1], reach)}</span>`);
    } else {
      parts.push('<span>beyond infinity</span>');
    }
    parts.push(rawMark(x, y, disparity));
    parts.push(`<span>confidence ${Math.round(measured.confidence[index] / 2.55)} %</span>`);
    if (measured.truth_q8 && measured.truth_q8[index] !== NO_TRUTH) {
      const error = disparity - measured.truth_q8[index] / 256;
      parts.push(`<span>error <b>${error >= 0 ? '+' : '−'}${Math.abs(error).toFixed(2)}</b> px</span>`);
    }
  } else {
    parts.push(`<span>${page.reasons[reason]}</span>`);
  }
  return parts;
}

function showMarked() {
  const on = marked.x >= 0;
  element('readout').hidden = !on;
  for (const frame of frames) frame.classList.toggle('live', on);
  if (!on) return;
  const index = marked.y * page.width + marked.x;
  for (const frame of frames) {
    if (frame.dataset.side === 'left') placeHairs(frame, marked.x, marked.y);
    else {
      const valid = hasDisparity(index);
      const shift = valid ? measured.disparity_q8[index] / 256 / page.step : 0;
      placeHairs(frame, marked.x - shift, marked.y);
      frame.querySelector('.dot').hidden = !valid;
    }
  }
  element('readout-text').innerHTML = readoutParts(index).join('');
}

function mark(x, y) {
  marked.x = x < 0 ? -1 : Math.min(page.width - 1, Math.max(0, Math.round(x)));
  marked.y = Math.min(page.height - 1, Math.max(0, Math.round(y)));
  showMarked();
  for (const listener of marked.listeners) listener();
}

// The left pixel whose match is nearest to column x of the right image.
function leftOfRight(x, y) {
  let best = -1, least = 1.5;
  for (let c = 0; c < page.width; c++) {
    const index = y * page.width + c;
    if (!hasDisparity(index)) continue;
    const away = Math.abs(c - measured.disparity_q8[index] / 256 / page.step - x);
    if (away < least) { least = away; best = c; }
  }
  return best;
}

function markFromPointer(frame, event) {
  const box = frame.getBoundingClientRect();
  const x = Math.floor((event.clientX - box.left) / box.width * page.width);
  const y = Math.floor((event.clientY - box.top) / box.height * page.height);
  if (x < 0 || y < 0 || x >= page.width || y >= page.height) return;
  if (frame.dataset.side === 'left') return mark(x, y);
  const c = leftOfRight(x, y);
  if (c >= 0) mark(c, y);
}

function stepMarked(event) {
  const moves = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
  if (event.key === 'Escape') { marked.held = false; return mark(-1, 0); }
  const move = moves[event.key];
  if (!move) return;
  event.preventDefault();
  marked.held = true;
  const far = event.shiftKey ? 10 : 1;
  if (marked.x < 0) mark(page.width / 2, page.height / 2);
  else mark(Math.max(0, marked.x + far * move[0]), marked.y + far * move[1]);
}

function startMaps() {
  for (const frame of frames) {
    addHairs(frame);
    frame.addEventListener('pointermove', (event) => {
      if (!marked.held) markFromPointer(frame, event);
    });
    frame.addEventListener('pointerleave', () => { if (!marked.held) mark(-1, 0); });
    frame.addEventListener('click', (event) => {
      marked.held = !marked.held;
      markFromPointer(frame, event);
    });
    frame.addEventListener('keydown', stepMarked);
  }
}
