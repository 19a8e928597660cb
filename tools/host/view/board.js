// SPDX-License-Identifier: Apache-2.0
// The calibration of two cameras: where the board still has to be shown is drawn into the pictures.
const VIEWS_WANTED = 15, CELLS = 3;
const board = {on: false, found: null, sessions: [], seen: [new Set(), new Set()], widths: []};

const boardSize = () => (element('board-size').value || '9x6').match(/^(\d+)\s*[xX×]\s*(\d+)$/);
const boardPath = (after) => { const size = boardSize() || [0, 0, 0]; return 'board?columns=' + size[1] + '&rows=' + size[2] + '&after=' + after; };

/** Cells of a 3 x 3 grid over a half that corners lie in. */
function cellsOf(corners, width, height) {
  const cells = new Set();
  for (let i = 0; i < corners.length; i += 2) cells.add(Math.floor(CELLS * corners[i] / width) + CELLS * Math.floor(CELLS * corners[i + 1] / height));
  return cells;
}

const cellNames = ['top left', 'top', 'top right', 'left', 'middle', 'right', 'bottom left', 'bottom', 'bottom right'];
const missing = (side) => cellNames.map((_, i) => i).filter((i) => !board.seen[side].has(i));

/** What to do next, one sentence. */
function boardAdvice() {
  const both = board.found && board.found.sides.every((side) => side.corners.length);
  const why = board.found && board.found.sides.map((side, i) => side.corners.length ? '' : ['left: ', 'right: '][i] + (side.why || 'no board')).filter(Boolean).join('; ');
  const left = missing(0), right = missing(1);
  const place = left.length ? cellNames[left[0]] + ' of the left picture' : right.length ? cellNames[right[0]] + ' of the right picture' : '';
  const spread = board.widths.length > 3 && Math.max(...board.widths) < 1.5 * Math.min(...board.widths);
  const next = board.sessions.length === 0 ? 'hold the board still in both pictures' : place ? 'show it at the ' + place : spread ? 'show it nearer and farther' : board.sessions.length < VIEWS_WANTED ? 'tilt it in other directions' : 'calibrate';
  return (both ? 'Board found in both pictures' : why || 'looking for the board') + '. ' + board.sessions.length + ' of ' + VIEWS_WANTED + ' views; next: ' + next + '.';
}
function showBoard() { element('board-state').textContent = boardAdvice(); }

/** Corners, and cells that no view has covered, in a pane of the pictures. */
function drawBoard(pane) {
  if (!board.on || pane.kind !== 'picture') return;
  const side = pane.w * pane.scale / CELLS, down = pane.h * pane.scale / CELLS;
  context2d.strokeStyle = '#ff9f0a';
  context2d.setLineDash([6, 5]);
  for (const cell of missing(pane.side)) context2d.strokeRect(pane.dx + cell % CELLS * side + 4, pane.dy + Math.floor(cell / CELLS) * down + 4, side - 8, down - 8);
  context2d.setLineDash([]);
  if (!board.found) return;
  const {corners} = board.found.sides[pane.side];
  context2d.fillStyle = '#30d158';
  for (let i = 0; i < corners.length; i += 2) context2d.fillRect(pane.dx + (corners[i] + 0.5) * pane.scale - 2, pane.dy + (corners[i + 1] + 0.5) * pane.scale - 2, 4, 4);
}

async function captureBoard() {
  const name = 'board-' + newName().slice(5);
  const found = board.found;
  const answer = await send('capture ' + name + ' static=yes');
  if (!answer || !answer.ok || !found) return;
  board.sessions.push(name);
  found.sides.forEach((side, i) => cellsOf(side.corners, stage.picture.width / 2, stage.picture.height).forEach((cell) => board.seen[i].add(cell)));
  const {corners} = found.sides[0];
  if (corners.length) board.widths.push(Math.hypot(corners[0] - corners.at(-2), corners[1] - corners.at(-1)));
  showBoard();
}

async function calibrate() {
  const size = boardSize();
  const entry = logLine('vergence calibrate', '… calibrating');
  const response = await fetch('calibrate', {method: 'POST', body: JSON.stringify({board: size ? size[1] + 'x' + size[2] : '', square: element('board-square').value || '25', sessions: board.sessions})});
  const answer = await response.json();
  if (!answer.ok) { entry.set(answer.error + ': ' + answer.message, true); return; }
  entry.set(answer.command + ': ' + answer.verdict + ' ', !answer.good);
  entry.item.append(linkTo(answer.report, 'report'));
  if (answer.good) await send('calibration set ' + answer.name);
}

follow('board', boardPath, () => board.on, async (response) => { board.found = await response.json(); showBoard(); draw(); });
element('board-find').addEventListener('click', () => {
  board.on = !board.on;
  board.found = null;
  element('board-find').setAttribute('aria-pressed', board.on);
  showBoard();
  draw();
});
element('board-capture').addEventListener('click', captureBoard);
element('board-calibrate').addEventListener('click', calibrate);
