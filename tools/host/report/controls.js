// SPDX-License-Identifier: Apache-2.0
// Turning, moving, zooming and measuring in the view of the surface.
const touches = new Map();
const measuring = { a: -1, b: -1 };
let pressedAt = null;

function clampPitch() { view.pitch = Math.max(-1.55, Math.min(1.55, view.pitch)); }

function pan(dx, dy) {
  const { right, up } = viewerAxes();
  const unit = 2 * Math.tan(view.fov / 2) * view.distance / view.canvas.clientHeight;
  for (let i = 0; i < 3; i++) view.target[i] += unit * (dy * up[i] - dx * right[i]);
}

function zoom(factor) {
  const home = view.home.distance;
  view.distance = Math.min(20 * home, Math.max(home / 200, view.distance * factor));
}

function turnOrPan(event, dx, dy) {
  if (event.shiftKey || event.buttons & 6) return pan(dx, dy);
  view.yaw -= dx * 0.006;
  view.pitch -= dy * 0.006;
  clampPitch();
}

function pinch(before, event) {
  const others = [...touches.entries()].filter(([id]) => id !== event.pointerId);
  const other = others[0][1];
  const spread = (p) => Math.hypot(p[0] - other[0], p[1] - other[1]) || 1;
  const now = [event.clientX, event.clientY];
  zoom(spread(before) / spread(now));
  pan((now[0] - before[0]) / 2, (now[1] - before[1]) / 2);
}

function localPlace(event) {
  const box = view.canvas.getBoundingClientRect();
  return [event.clientX - box.left, event.clientY - box.top];
}

function pointerMoved(event) {
  const before = touches.get(event.pointerId);
  if (!before) return hoverSoon(event);
  const dx = event.clientX - before[0], dy = event.clientY - before[1];
  if (touches.size > 1) pinch(before, event);
  else turnOrPan(event, dx, dy);
  touches.set(event.pointerId, [event.clientX, event.clientY]);
  redraw();
}

let hovering = false;
function hoverSoon(event) {
  if (hovering || marked.held) return;
  hovering = true;
  const [x, y] = localPlace(event);
  requestAnimationFrame(() => {
    hovering = false;
    markVertex(vertexAt(x, y));
  });
}

function markVertex(vertex) {
  if (vertex < 0) return mark(-1, 0);
  const pixel = view.mesh.pixels[vertex];
  mark(pixel % page.width, Math.floor(pixel / page.width));
}

function pointerReleased(event) {
  const moved = pressedAt && Math.hypot(event.clientX - pressedAt[0], event.clientY - pressedAt[1]);
  if (touches.size === 1 && event.type === 'pointerup' && event.button === 0 && pressedAt && moved < 4) choosePoint(event);
  touches.delete(event.pointerId);
  view.canvas.classList.toggle('turning', touches.size > 0);
}

function choosePoint(event) {
  const vertex = vertexAt(...localPlace(event));
  if (vertex < 0 || measuring.b >= 0) { measuring.a = vertex; measuring.b = -1; }
  else if (measuring.a < 0) measuring.a = vertex;
  else measuring.b = vertex;
  element('measure').textContent = measuring.b >= 0 ? `A to B: ${distanceText()}.` : measuring.a >= 0 ? 'A is set: click B.' : '';
  redraw();
}

function distanceText() {
  const p = view.mesh.positions, a = 3 * measuring.a, b = 3 * measuring.b;
  const along = [0, 1, 2].map((i) => p[b + i] - p[a + i]);
  const length = Math.hypot(...along);
  // Each end is uncertain only along its own ray, so only that component of sigma counts.
  let variance = 0;
  for (const vertex of [measuring.a, measuring.b]) {
    const code = measured.sigmaLength[view.mesh.pixels[vertex]];
    const q = [0, 1, 2].map((i) => p[3 * vertex + i]), size = Math.hypot(...q);
    const share = length > 0 ? (q[0] * along[0] + q[1] * along[1] + q[2] * along[2]) / (size * length) : 1;
    if (code > 0) variance += (share * sigmaLengthOf(code)) ** 2;
  }
  const sigma = Math.sqrt(variance);
  return sigma > 0 ? `${fixedLength(length, sigma)} ± ${Number(sigma.toPrecision(2))} ${page.unit}` : lengthText(length);
}

function zoomByWheel(event) {
  if (document.activeElement !== view.canvas && !event.ctrlKey) return;
  event.preventDefault();
  zoom(Math.exp(Math.max(-100, Math.min(100, event.deltaY)) * 0.0016));
  redraw();
}

function keyPressed(event) {
  const turns = { ArrowLeft: [0.08, 0], ArrowRight: [-0.08, 0], ArrowUp: [0, 0.08], ArrowDown: [0, -0.08] };
  const turn = turns[event.key];
  if (turn && event.shiftKey) pan(200 * turn[0], 200 * turn[1]);
  else if (turn) { view.yaw -= turn[0]; view.pitch -= turn[1]; clampPitch(); }
  else if (event.key === '+' || event.key === '=') zoom(0.9);
  else if (event.key === '-') zoom(1 / 0.9);
  else if (event.key === '0') return setPose('camera');
  else if (event.key === 'Escape') { measuring.a = measuring.b = -1; element('measure').textContent = ''; }
  else return;
  event.preventDefault();
  redraw();
}

function recentre(event) {
  const vertex = vertexAt(...localPlace(event));
  if (vertex < 0) return;
  view.target = Array.from(view.mesh.positions.subarray(3 * vertex, 3 * vertex + 3));
  redraw();
}

// A scale bar of round length at the distance of the target.
function drawScale() {
  const perPixel = 2 * Math.tan(view.fov / 2) * view.distance / view.canvas.clientHeight;
  const wished = 140 * perPixel, power = 10 ** Math.floor(Math.log10(wished));
  const round = [5, 2, 1].map((k) => k * power).find((k) => k <= wished) || power;
  const bar = element('view-scale');
  bar.hidden = false;
  bar.firstElementChild.style.width = `${round / perPixel}px`;
  bar.lastElementChild.textContent = page.unit === 'mm' && round >= 1000 ? `${round / 1000} m` : `${Number(round.toPrecision(1))} ${page.unit}`;
}

function dotAt(vertex, letter) {
  const p = view.mesh.positions;
  const place = screenOf(p[3 * vertex], p[3 * vertex + 1], p[3 * vertex + 2]);
  if (!place) return ['', null];
  const at = `${place[0].toFixed(1)}" cy="${place[1].toFixed(1)}"`;
  const text = letter ? `<text x="${(place[0] + 9).toFixed(1)}" y="${(place[1] - 7).toFixed(1)}">${letter}</text>` : '';
  return [`<circle cx="${at} r="6" fill="none" stroke="#000" stroke-width="4" stroke-opacity="0.55"/>` +
          `<circle cx="${at} r="6" fill="none" stroke="#ffd60a" stroke-width="2"/>${text}`, place];
}

function axesMarks() {
  const { right, up } = viewerAxes(), x = view.canvas.clientWidth - 46, y = 92;
  const axes = [['X', [1, 0, 0], '#d9483b'], ['Y', [0, -1, 0], '#3a9a4a'], ['Z', [0, 0, -1], '#3b7dd9']];
  return axes.map(([name, axis, colour]) => {
    const dx = 26 * axis.reduce((s, v, i) => s + v * right[i], 0), dy = -26 * axis.reduce((s, v, i) => s + v * up[i], 0);
    return `<line x1="${x}" y1="${y}" x2="${x + dx}" y2="${y + dy}" stroke="${colour}" stroke-width="2.5" stroke-linecap="round"/>` +
           `<text x="${x + 1.35 * dx - 4}" y="${y + 1.35 * dy + 4}" style="fill:${colour}">${name}</text>`;
  }).join('');
}

function drawMarks() {
  drawScale();
  let marks = axesMarks();
  const ends = [];
  for (const [vertex, letter] of [[measuring.a, 'A'], [measuring.b, 'B']]) {
    if (vertex < 0) continue;
    const [text, place] = dotAt(vertex, letter);
    marks += text;
    if (place) ends.push(place);
  }
  if (ends.length === 2)
    marks += `<line x1="${ends[0][0]}" y1="${ends[0][1]}" x2="${ends[1][0]}" y2="${ends[1][1]}" stroke="#ffd60a" stroke-width="1.5"/>` +
             `<text x="${(ends[0][0] + ends[1][0]) / 2 + 8}" y="${(ends[0][1] + ends[1][1]) / 2 - 8}">${distanceText()}</text>`;
  if (marked.x >= 0) {
    const index = marked.y * page.width + marked.x;
    if (measured.reason[index] === 0) {
      const point = [0, 0, 0];
      pointOf(index, point, 0);
      const place = screenOf(point[0], -point[1], -point[2]);
      if (place) marks += `<circle cx="${place[0].toFixed(1)}" cy="${place[1].toFixed(1)}" r="5" fill="#ffd60a" stroke="#000" stroke-width="1.5"/>`;
    }
  }
  element('view-marks').innerHTML = marks;
}

function chooseShade(button) {
  view.shade = Number(button.dataset.shade);
  for (const other of document.querySelectorAll('[data-shade]')) other.setAttribute('aria-checked', String(other === button));
  const legend = element('view-legend');
  const range = { 3: [page.depth_high, page.depth_low], 4: [sigmaLengthOf(page.sigma_low_code), sigmaLengthOf(page.sigma_high_code)] }[view.shade];
  legend.hidden = !range;
  if (range)
    legend.innerHTML = `<div class="ramp" style="background:${page.ramp_css}"></div><div class="ticks"><span style="left:0">${lengthText(range[0])}</span><span style="left:100%">${lengthText(range[1])}</span></div>`;
  redraw();
}

function startControls() {
  const canvas = view.canvas;
  canvas.addEventListener('pointerdown', (event) => {
    canvas.setPointerCapture(event.pointerId);
    touches.set(event.pointerId, [event.clientX, event.clientY]);
    pressedAt = touches.size === 1 ? [event.clientX, event.clientY] : null;
    canvas.classList.add('turning');
  });
  canvas.addEventListener('pointermove', pointerMoved);
  for (const name of ['pointerup', 'pointercancel']) canvas.addEventListener(name, pointerReleased);
  canvas.addEventListener('pointerleave', () => { if (!marked.held && touches.size === 0) mark(-1, 0); });
  canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  canvas.addEventListener('wheel', zoomByWheel, { passive: false });
  canvas.addEventListener('keydown', keyPressed);
  canvas.addEventListener('dblclick', recentre);
  for (const button of document.querySelectorAll('[data-shade]')) button.addEventListener('click', () => chooseShade(button));
  for (const button of document.querySelectorAll('[data-pose]')) button.addEventListener('click', () => setPose(button.dataset.pose));
  element('wire').addEventListener('click', (event) => {
    view.wire = !view.wire;
    event.currentTarget.setAttribute('aria-pressed', String(view.wire));
    redraw();
  });
  element('full').addEventListener('click', () => {
    if (document.fullscreenElement) document.exitFullscreen();
    else element('viewer').requestFullscreen();
  });
  view.afterDraw.push(drawMarks);
  marked.listeners.push(redraw);
  new ResizeObserver(redraw).observe(canvas);
}
