// SPDX-License-Identifier: Apache-2.0
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

document.documentElement.dataset.ready = 'yes';
