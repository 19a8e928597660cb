// SPDX-License-Identifier: Apache-2.0
const root = document.documentElement;

document.getElementById('theme').addEventListener('click', () => {
  const dark = root.dataset.theme ? root.dataset.theme === 'dark'
    : matchMedia('(prefers-color-scheme: dark)').matches;
  root.dataset.theme = dark ? 'light' : 'dark';
});

// The row under the pointer, in both rectified images.
for (const pair of document.querySelectorAll('.pair')) {
  const hairs = pair.querySelectorAll('.row-hair');
  const show = event => {
    const frame = event.target.closest('.frame');
    if (!frame) return;
    const box = frame.getBoundingClientRect();
    for (const hair of hairs) {
      hair.style.display = 'block';
      hair.style.top = `${100 * (event.clientY - box.top) / box.height}%`;
    }
  };
  pair.addEventListener('pointermove', show);
  pair.addEventListener('pointerdown', show);
  pair.addEventListener('pointerleave', () => {
    for (const hair of hairs) hair.style.display = 'none';
  });
}

root.dataset.ready = 'yes';
