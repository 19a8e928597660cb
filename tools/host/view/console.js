// SPDX-License-Identifier: Apache-2.0
// Controls are commands of the console, and each shows its line.
const history = element('lines');

function logLine(command, text, bad) {
  const item = document.createElement('li');
  const code = document.createElement('code');
  code.textContent = command;
  const answer = document.createElement('span');
  answer.className = 'answer' + (bad ? ' bad' : '');
  answer.textContent = text;
  item.append(code, answer);
  const log = element('log');
  log.append(item);
  while (log.children.length > 100) log.firstChild.remove();
  log.scrollTop = log.scrollHeight;
  return {set: (now, wrong) => { answer.textContent = now; answer.className = 'answer' + (wrong ? ' bad' : ''); log.scrollTop = log.scrollHeight; }, item};
}

/** The items of an answer in one line: "left: position 300 counts, ...". */
function flat(value, units, path = '') {
  if (Array.isArray(value)) return value.map((v) => flat(v, units, path + '[]')).join('; ');
  if (value && typeof value === 'object') return Object.entries(value).map(([key, v]) => key + ' ' + flat(v, units, path ? path + '.' + key : key)).join(', ');
  return String(value) + (units && units[path] ? ' ' + units[path] : '');
}

function linkTo(path, text) {
  const link = document.createElement('a');
  link.href = path; link.target = '_blank'; link.rel = 'noopener'; link.textContent = text;
  return link;
}

/** Sends a line of the console, and shows it with its answer. Returns the answer. */
async function send(line) {
  const entry = logLine(line, '…');
  if (![...history.options].some((o) => o.value === line)) history.append(new Option(line, line));
  let answer = null;
  try {
    answer = await ask(line, (p) => { if (p.event === 'progress') entry.set('… ' + p.what + ' ' + p.done + '/' + p.total); });
  } catch (error) {
    entry.set('No answer from "vergence view": ' + error.message, true);
    return null;
  }
  if (!answer) { entry.set('no answer', true); return null; }
  entry.set(answer.ok ? flat(answer.result || {}, answer.units) || 'OK' : answer.error + ': ' + answer.message, !answer.ok);
  if (answer.ok && answer.result && typeof answer.result.file === 'string') entry.item.append(linkTo('file/' + encodeURIComponent(answer.result.file), answer.result.file));
  showState();
  return answer;
}

/** Captures a pair; its surface is made on this machine and its report opens. */
async function surfaceOf(session) {
  const entry = logLine('vergence reconstruct ' + session, '… measuring');
  const response = await fetch('reconstruct', {method: 'POST', body: session});
  const answer = await response.json();
  if (!answer.ok) { entry.set(answer.error + ': ' + answer.message, true); return; }
  entry.set(answer.command + ' ');
  entry.item.append(linkTo(answer.report, 'report'));
  window.open(answer.report, '_blank', 'noopener');
}
function newName() {
  const two = (n) => String(n).padStart(2, '0');
  const now = new Date();
  return 'view-' + now.getFullYear() + two(now.getMonth() + 1) + two(now.getDate()) + '-' + two(now.getHours()) + two(now.getMinutes()) + two(now.getSeconds());
}
async function capture(measures) {
  const name = newName();
  const answer = await send('capture ' + name);
  if (measures && answer && answer.ok) await surfaceOf(name);
}

async function autofocus() {
  const region = stage.region;
  const step = stage.about.step || 1;
  const line = 'autofocus' + (region ? ' region=' + [region.x, region.y, region.w, region.h].map((v) => 2 * Math.round(v * step / 2)).join(',') : '');
  const answer = await send(line);
  if (answer) {
    const curve = await send('focus-curve last=yes');
    if (curve && curve.ok && curve.result.file) element('sweep').replaceChildren(linkTo('file/' + encodeURIComponent(curve.result.file), 'Curve of this search'));
  }
}

async function turnBy(degrees) {
  const now = await ask('pan');
  const at = (side) => ((now && now.ok && now.result[side]) || 0) + degrees;
  return send('pan ' + at('left').toFixed(3) + ' right=' + at('right').toFixed(3));
}

/** Turns both cameras to put the pixel that was clicked into the middle. */
async function aimAt(at) {
  setAiming(false);
  const zoom = await ask('zoom');
  const focal = zoom && zoom.ok && zoom.result.left && zoom.result.left.focal_length;
  if (!focal || at.pane.kind !== 'picture') { logLine('aim', 'this instrument has no pan, or click into a picture', true); return; }
  const PIXEL_MM = 0.0032;  // of the MT9T001
  const apart = (at.x - at.pane.w / 2) * stage.about.step * PIXEL_MM / focal;
  await turnBy(AIM_SIGN * Math.atan(apart) * 180 / Math.PI);
}
const AIM_SIGN = 1;  // a positive pan turns to the right

/** [label, placeholder, line of the value]. */
const fields = [
  ['Pan', '0 deg', (v) => 'pan ' + v],
  ['Zoom', '1x', (v) => 'zoom ' + v],
  ['Focus', '1800 mm', (v) => 'focus ' + v],
  ['Iris', 'f/8', (v) => 'iris ' + v],
  ['Exposure', '10 ms', (v) => 'exposure ' + v],
  ['Gain', '2', (v) => 'gain ' + v],
];
const buttons = [
  ['Bring up', () => send('bringup')],
  ['Autoexpose', () => send('autoexpose')],
  ['Autofocus', autofocus],
  ['Measure', () => send('measure ' + newName())],
  ['Capture', () => capture(false)],
  ['Capture and measure', () => capture(true)],
];

function makeControls() {
  const box = element('controls');
  for (const [label, example, line] of fields) {
    const form = document.createElement('form');
    form.className = 'row';
    form.innerHTML = '<label></label><input autocomplete="off"><button title="sends the line that is shown in the log"></button>';
    const [name, input, button] = form.children;
    name.textContent = label; input.placeholder = example; input.setAttribute('aria-label', label);
    button.textContent = line('…').split(' ')[0];
    form.addEventListener('submit', (event) => { event.preventDefault(); send(line(input.value.trim() || example)); });
    box.append(form);
  }
  const wide = document.createElement('div');
  wide.className = 'wide';
  for (const [label, run] of buttons) {
    const button = document.createElement('button');
    button.type = 'button'; button.textContent = label; button.dataset.run = label;
    button.addEventListener('click', async () => { button.disabled = true; try { await run(); } finally { button.disabled = false; } });
    wide.append(button);
  }
  box.append(wide);
}

/** Rows of a table: what both cameras have in two columns, everything else in one. */
function stateRows(result, units) {
  const cell = (kind, text, columns) => Object.assign(document.createElement(kind), {textContent: text, colSpan: columns || 1});
  const row = (...cells) => { const tr = document.createElement('tr'); tr.append(...cells); return tr; };
  const {left = {}, right = {}, ...rest} = result;
  const sides = [...new Set([...Object.keys(left), ...Object.keys(right)])].filter((key) => !key.endsWith('_sigma'));
  return [...Object.keys(rest).map((key) => row(cell('th', key), cell('td', flat(rest[key], units, key), 2))),
    ...(sides.length ? [row(cell('th', ''), cell('td', 'left'), cell('td', 'right'))] : []),
    ...sides.map((key) => row(cell('th', key.replaceAll('_', ' ')), cell('td', flat(left[key] ?? '', units, 'left.' + key)), cell('td', flat(right[key] ?? '', units, 'right.' + key))))];
}

let stateAsked = false;
async function showState() {
  if (stateAsked || !facts.live) return;
  stateAsked = true;
  try {
    const answer = await ask('status');
    if (answer && answer.ok) {
      element('state').replaceChildren(...stateRows(answer.result, answer.units || {}));
    }
  } catch (error) { /* the pictures report it */ }
  stateAsked = false;
}
