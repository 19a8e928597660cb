// SPDX-License-Identifier: Apache-2.0
async function start() {
  element('theme').addEventListener('click', redraw);
  if (typeof DecompressionStream === 'undefined') {
    viewFailed('This browser is too old for the interactive parts (no DecompressionStream). The pictures and figures below are complete.');
    return;
  }
  await loadLayers();
  startMaps();
  const photo = element('photo');
  await photo.decode();
  startView(photo);
  document.documentElement.dataset.ready = 'yes';
}

start().catch((error) => {
  viewFailed(`The interactive view failed: ${error.message}`);
  console.error(error);
});
