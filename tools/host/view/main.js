// SPDX-License-Identifier: Apache-2.0
// Puts the parts together: pictures and depths as they come, buttons, keys.
const times = [];
let assistedAt = 0;

async function usePicture(response, about) {
  const bitmap = await createImageBitmap(await response.blob());
  if (stage.picture) stage.picture.close();
  stage.picture = bitmap;
  stage.about = about;
  const now = performance.now();
  const marks = stage.marks.peaking || stage.marks.zebra;
  const due = now - assistedAt > 200;
  if (marks || due) stage.pixels = pixelsOf(bitmap);
  if (due) { assistedAt = now; showAssist(stage.pixels, stage.region); }
  if (marks) {
    stage.overlay = stage.overlay || document.createElement('canvas');
    stage.overlay.width = bitmap.width; stage.overlay.height = bitmap.height;
    stage.overlay.getContext('2d').putImageData(markPixels(stage.pixels, stage.marks.peaking, stage.marks.zebra), 0, 0);
  }
  draw();
  times.push(now);
  while (now - times[0] > 2000) times.shift();
  const rate = times.length > 1 ? 1000 * (times.length - 1) / (now - times[0]) : 0;
  element('pace').textContent = facts.live ? rate.toFixed(0) + ' pictures/s, number ' + about.number : 'pair ' + about.pair + ' of ' + about.pairs;
  canvas.dataset.number = about.number;
  canvas.dataset.rate = rate.toFixed(1);
  if (!facts.live) element('pair').textContent = about.pair + ' of ' + about.pairs;
}

for (const id of ['near', 'far']) element(id).value = facts[id] || '';
const depthNumber = (id) => { const value = parseFloat(element(id).value); return value > 0 ? value : 0; };
follow('pictures', (after) => 'picture?after=' + after, () => true, usePicture);
follow('depth', (after) => 'depth?after=' + after + '&near=' + depthNumber('near') + '&far=' + depthNumber('far') + '&refined=' + (stage.pointer && stage.pointer.pane.kind !== 'picture' ? 1 : 0), wantsDepth, async (response, about) => {
  showDepth(readDepth(await response.arrayBuffer()));
  canvas.dataset.depths = about.number;
  draw();
});

for (const button of document.querySelectorAll('button[data-mode]')) button.addEventListener('click', () => setMode(button.dataset.mode));
for (const button of document.querySelectorAll('[data-mark]')) button.addEventListener('click', () => toggleMark(button.dataset.mark));
element('aim').addEventListener('click', () => setAiming(!stage.aiming));
element('whole').addEventListener('click', () => { stage.zoom = 1; stage.centre = [0.5, 0.5]; draw(); });
element('cancel').addEventListener('click', () => fetch('cancel', {method: 'POST'}));
element('line').addEventListener('submit', (event) => {
  event.preventDefault();
  const line = event.target.elements.line.value.trim();
  event.target.elements.line.value = '';
  if (line) send(line);
});
for (const part of document.querySelectorAll('.instrument')) part.hidden = !facts.live;
for (const part of document.querySelectorAll('.recorded')) part.hidden = facts.live;
const choosePair = (step) => send('pair ' + Math.min(stage.about.pairs, Math.max(1, stage.about.pair + step)));
element('pair-before').addEventListener('click', () => choosePair(-1));
element('pair-after').addEventListener('click', () => choosePair(1));
element('pair-surface').addEventListener('click', () => surfaceOf(String(stage.about.pair)));

const keys = {
  1: () => setMode('side'), 2: () => setMode('anaglyph'), 3: () => setMode('blink'), 4: () => setMode('rectified'), 5: () => setMode('depth'),
  c: () => toggleMark('cross'), r: () => toggleMark('rows'), p: () => toggleMark('peaking'), z: () => toggleMark('zebra'),
  a: () => setAiming(!stage.aiming), 0: () => element('whole').click(), '+': () => zoomBy(1.25), '-': () => zoomBy(0.8),
  Escape: () => setAiming(false),
  ArrowLeft: () => facts.live ? turnBy(-AIM_SIGN * 0.5) : choosePair(-1), ArrowRight: () => facts.live ? turnBy(AIM_SIGN * 0.5) : choosePair(1),
};
document.addEventListener('keydown', (event) => {
  const typing = event.target.closest('input');
  if (typing || event.ctrlKey || event.metaKey || event.altKey || !keys[event.key]) return;
  if (event.key.startsWith('Arrow') && event.target !== canvas && event.target !== document.body) return;
  event.preventDefault();
  keys[event.key]();
});
setInterval(() => { stage.blink = 1 - stage.blink; if (stage.mode === 'blink') draw(); }, 400);
setInterval(showState, 3000);
if (facts.live) { makeControls(); showState(); }
