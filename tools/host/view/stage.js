// SPDX-License-Identifier: Apache-2.0
// The canvas: panes that show halves of the picture, rectified images or depths, all with one zoom.
const stage = {mode: 'side', marks: {cross: true, rows: false, peaking: false, zebra: false}, picture: null, about: {}, overlay: null,
  zoom: 1, centre: [0.5, 0.5], region: null, drag: null, pointer: null, blink: 0, aiming: false, panes: [], depth: null};
const canvas = element('stage');
const context2d = canvas.getContext('2d');
const scratch = document.createElement('canvas');
const wantsDepth = () => stage.mode === 'depth' || stage.mode === 'rectified' || (stage.marks.rows && stage.mode !== 'anaglyph');

/** The pixels of the picture. */
function pixelsOf(bitmap) {
  scratch.width = bitmap.width;
  scratch.height = bitmap.height;
  const context = scratch.getContext('2d', {willReadFrequently: true});
  context.drawImage(bitmap, 0, 0);
  return context.getImageData(0, 0, bitmap.width, bitmap.height);
}

/** What each pane shows: an image, the part of it, and what its pixels are. */
function panesOf() {
  const {picture, depth, mode} = stage;
  const half = picture && [0, 1].map((side) => ({kind: 'picture', side, image: picture, x: side * picture.width / 2, w: picture.width / 2, h: picture.height}));
  if ((mode === 'rectified' || mode === 'depth') && depth) {
    const made = (name, kind, side) => ({kind, side, image: depth[name], x: 0, w: depth.width, h: depth.height});
    return mode === 'rectified' ? [made('left', 'rectified', 0), made('right', 'rectified', 1)] : [made('left', 'rectified', 0), made('map', 'depth', 0)];
  }
  if (!half) return [];
  return mode === 'anaglyph' ? [{...half[0], kind: 'anaglyph'}] : mode === 'blink' ? [half[stage.blink]] : half;
}

/** Places the panes side by side, or below each other where there is little room. */
function place(panes) {
  const width = canvas.clientWidth;
  const aspect = panes.length ? panes[0].w / panes[0].h : 4 / 3;
  const below = width < 620;
  const across = below ? 1 : panes.length || 1;
  const gap = 4;
  const w = (width - gap * (across - 1)) / across;
  const h = Math.min(w / aspect, Math.max(240, 0.72 * innerHeight));
  const rows = below ? panes.length || 1 : 1;
  const ratio = devicePixelRatio || 1;
  const size = [Math.round(width * ratio), Math.round((rows * h + gap * (rows - 1)) * ratio)];
  if (canvas.width !== size[0] || canvas.height !== size[1]) {
    [canvas.width, canvas.height] = size;
    canvas.style.height = size[1] / ratio + 'px';
  }
  context2d.setTransform(ratio, 0, 0, ratio, 0, 0);
  context2d.clearRect(0, 0, width, rows * h + gap * (rows - 1));
  panes.forEach((pane, i) => {
    const fit = Math.min(w / pane.w, h / pane.h);
    const scale = fit * stage.zoom;
    const left = below ? 0 : i * (w + gap), top = below ? i * (h + gap) : 0;
    Object.assign(pane, {left, top, width: w, height: h, scale,
      dx: left + w / 2 - stage.centre[0] * pane.w * scale, dy: top + h / 2 - stage.centre[1] * pane.h * scale});
  });
  return panes;
}

/** Calls draw with the pane's clip set. */
function within(pane, draw) {
  context2d.save();
  context2d.beginPath();
  context2d.rect(pane.left, pane.top, pane.width, pane.height);
  context2d.clip();
  draw();
  context2d.restore();
}

function drawImage(pane, image, x) {
  context2d.imageSmoothingEnabled = pane.scale < 2;
  context2d.drawImage(image, x, 0, pane.w, pane.h, pane.dx, pane.dy, pane.w * pane.scale, pane.h * pane.scale);
}

/** Left in red, right in cyan. */
function drawAnaglyph(pane) {
  const tint = (x, colour, into) => {
    scratch.width = pane.w; scratch.height = pane.h;
    const context = scratch.getContext('2d', {willReadFrequently: true});
    context.filter = 'grayscale(1)';
    context.drawImage(pane.image, x, 0, pane.w, pane.h, 0, 0, pane.w, pane.h);
    context.filter = 'none';
    context.globalCompositeOperation = 'multiply';
    context.fillStyle = colour;
    context.fillRect(0, 0, pane.w, pane.h);
    context2d.globalCompositeOperation = into;
    drawImage(pane, scratch, 0);
  };
  tint(0, '#ff0000', 'source-over');
  tint(pane.w, '#00ffff', 'lighter');
  context2d.globalCompositeOperation = 'source-over';
}

/** Lines of the same row: straight in rectified images, curves through the calibration in raw pictures. */
function drawRows(pane) {
  context2d.strokeStyle = '#ffd60a';
  context2d.globalAlpha = 0.75;
  context2d.lineWidth = 1;
  if (pane.kind !== 'picture') {
    for (let i = 0; i < 9; i++) {
      const y = pane.dy + (2 * i + 1) / 18 * pane.h * pane.scale;
      context2d.beginPath(); context2d.moveTo(pane.left, y); context2d.lineTo(pane.left + pane.width, y); context2d.stroke();
    }
  } else if (stage.depth) {
    for (const row of stage.depth.about.rows) {
      const line = row[pane.side];
      context2d.beginPath();
      for (let i = 0; i < line.length; i += 2) context2d.lineTo(pane.dx + (line[i] + 0.5) * pane.scale, pane.dy + (line[i + 1] + 0.5) * pane.scale);
      context2d.stroke();
    }
  }
  context2d.globalAlpha = 1;
}

function drawMarks(pane) {
  const marked = pane.kind === 'picture' || pane.kind === 'anaglyph';
  if (marked && stage.overlay && (stage.marks.peaking || stage.marks.zebra)) drawImage(pane, stage.overlay, pane.x);
  if (stage.marks.rows) drawRows(pane);
  context2d.strokeStyle = '#ffd60a';
  context2d.lineWidth = 1;
  if (stage.marks.cross) {
    const x = pane.dx + pane.w * pane.scale / 2, y = pane.dy + pane.h * pane.scale / 2;
    context2d.beginPath(); context2d.moveTo(x - 14, y); context2d.lineTo(x + 14, y); context2d.moveTo(x, y - 14); context2d.lineTo(x, y + 14); context2d.stroke();
  }
  const region = stage.drag && stage.drag.region || stage.region;
  if (region && marked) context2d.strokeRect(pane.dx + region.x * pane.scale, pane.dy + region.y * pane.scale, region.w * pane.scale, region.h * pane.scale);
  drawBoard(pane);
  drawPointer(pane);
}

/** The pointer, in the other pane too: at the same row, of depth at the same place. */
function drawPointer(pane) {
  const at = stage.pointer;
  if (!at || at.pane.kind === 'anaglyph' || (pane.kind === 'picture') !== (at.pane.kind === 'picture')) return;
  const x = pane.dx + at.x * pane.scale, y = pane.dy + at.y * pane.scale;
  context2d.strokeStyle = '#fff';
  context2d.globalCompositeOperation = 'difference';
  context2d.beginPath(); context2d.moveTo(pane.left, y); context2d.lineTo(pane.left + pane.width, y);
  if (pane.kind !== 'rectified' || stage.mode === 'depth') { context2d.moveTo(x, y - 9); context2d.lineTo(x, y + 9); }
  context2d.stroke();
  context2d.globalCompositeOperation = 'source-over';
}

function draw() {
  stage.panes = place(panesOf());
  for (const pane of stage.panes) {
    within(pane, () => {
      if (pane.kind === 'anaglyph') drawAnaglyph(pane); else drawImage(pane, pane.image, pane.x);
      drawMarks(pane);
    });
  }
  canvas.dataset.mode = stage.mode;
}

/** The pane and the pixel of its image at a place of the canvas; null: none. */
function locate(event) {
  const box = canvas.getBoundingClientRect();
  const x = event.clientX - box.left, y = event.clientY - box.top;
  const pane = stage.panes.find((p) => x >= p.left && x < p.left + p.width && y >= p.top && y < p.top + p.height);
  return pane ? {pane, x: (x - pane.dx) / pane.scale, y: (y - pane.dy) / pane.scale} : null;
}

function zoomBy(factor, at) {
  const zoom = Math.min(16, Math.max(1, stage.zoom * factor));
  const share = at ? [at.x / at.pane.w, at.y / at.pane.h] : stage.centre;
  stage.centre = stage.centre.map((c, i) => zoom === 1 ? 0.5 : share[i] + (c - share[i]) * stage.zoom / zoom);
  stage.zoom = zoom;
  draw();
}

function regionOf(from, to) {
  const clip = (value, limit) => Math.round(Math.min(limit, Math.max(0, value)));
  const x = [from.x, to.x].map((v) => clip(v, from.pane.w)).sort((a, b) => a - b), y = [from.y, to.y].map((v) => clip(v, from.pane.h)).sort((a, b) => a - b);
  return {x: x[0], y: y[0], w: x[1] - x[0], h: y[1] - y[0]};
}

canvas.addEventListener('wheel', (event) => { event.preventDefault(); zoomBy(event.deltaY < 0 ? 1.25 : 0.8, locate(event)); }, {passive: false});
canvas.addEventListener('pointerdown', (event) => {
  const at = locate(event);
  if (!at) return;
  canvas.setPointerCapture(event.pointerId);
  stage.drag = {at, from: [event.clientX, event.clientY], centre: stage.centre, moves: event.shiftKey || event.button === 1, region: null};
});
canvas.addEventListener('pointermove', (event) => {
  const drag = stage.drag;
  stage.pointer = locate(event);
  if (drag && drag.moves) {
    stage.centre = drag.centre.map((c, i) => c - ([event.clientX, event.clientY][i] - drag.from[i]) / ([drag.at.pane.w, drag.at.pane.h][i] * drag.at.pane.scale));
  } else if (drag && stage.pointer && drag.at.pane.kind === 'picture') {
    drag.region = regionOf(drag.at, stage.pointer);
  }
  showDepthAt(stage.pointer);
  draw();
});
canvas.addEventListener('pointerup', () => {
  const drag = stage.drag;
  stage.drag = null;
  if (!drag || drag.moves) return;
  if (drag.region && drag.region.w > 5 && drag.region.h > 5) {
    stage.region = drag.region;
    focusCurve.forEach((curve) => curve.splice(0));
    if (stage.pixels) showAssist(stage.pixels, stage.region);
  } else if (stage.aiming) {
    aimAt(drag.at);
  }
  draw();
});
canvas.addEventListener('pointerleave', () => { stage.pointer = null; draw(); });
new ResizeObserver(draw).observe(canvas.parentElement);

function setMode(mode) {
  stage.mode = mode;
  for (const button of document.querySelectorAll('[data-mode]')) if (button.tagName === 'BUTTON') button.setAttribute('aria-checked', button.dataset.mode === mode);
  draw();
}
function toggleMark(name) {
  stage.marks[name] = !stage.marks[name];
  document.querySelector('[data-mark="' + name + '"]').setAttribute('aria-pressed', stage.marks[name]);
  draw();
}
function setAiming(on) {
  stage.aiming = on;
  element('aim').setAttribute('aria-pressed', on);
}
