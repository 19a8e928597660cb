// SPDX-License-Identifier: Apache-2.0
// What the page asks of the program that serves it. Paths are relative: the token is in the address.
const facts = JSON.parse(element('facts').textContent);

const alertLines = new Map();
/** Shows what is wrong in this place; '' when it is right again. */
function report(place, text) {
  if (text) alertLines.set(place, text); else alertLines.delete(place);
  const line = element('alert');
  line.hidden = alertLines.size === 0;
  const shown = [...alertLines.values()].join('  ·  ');
  if (line.textContent !== shown) line.textContent = shown;
}

const pause = (ms) => new Promise((done) => setTimeout(done, ms));

/** Until the page is looked at. */
function visible() {
  return document.hidden ? new Promise((done) => document.addEventListener('visibilitychange', done, {once: true})) : null;
}

/**
 * Asks for one newer item after the other while wanted() holds, the next one while this one is used.
 * Each goes to use(response, about); failures are reported at this place.
 */
async function follow(place, path, wanted, use) {
  let after = 0;
  let next = null;
  for (;;) {
    await visible();
    if (!wanted()) { next = null; report(place, ''); await pause(100); continue; }
    try {
      const response = await (next || fetch(path(after)));
      const about = JSON.parse(response.headers.get('X-Vergence') || '{}');
      after = about.number || after;
      next = response.ok && response.status === 200 ? fetch(path(after)) : null;
      if (next) next.catch(() => 0);
      if (response.status === 200) { await use(response, about); report(place, ''); }
      else if (!response.ok) { report(place, (await response.text()).trim()); await pause(300); }
    } catch (error) {
      next = null;
      report(place, '"vergence view" does not answer. If it has ended, start it again and open the address that it prints.');
      await pause(1000);
    }
  }
}

/** Runs a command of the console; each line of the answer goes to progress() until the last one, which is returned. */
async function ask(line, progress) {
  const response = await fetch('command', {method: 'POST', body: line});
  if (!response.ok) throw new Error((await response.text()).trim());
  const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
  let text = '';
  let last = null;
  for (;;) {
    const {value, done} = await reader.read();
    text += value || '';
    const lines = text.split('\n');
    text = lines.pop();
    for (const one of lines.filter((l) => l.trim())) {
      last = JSON.parse(one);
      if (last.event && progress) progress(last);
    }
    if (done) return last;
  }
}
