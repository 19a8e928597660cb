// SPDX-License-Identifier: Apache-2.0
function startTheme() {
  element('theme').addEventListener('click', () => {
    const root = document.documentElement;
    const dark = root.dataset.theme ? root.dataset.theme === 'dark' : matchMedia('(prefers-color-scheme: dark)').matches;
    root.dataset.theme = dark ? 'light' : 'dark';
    redraw();
  });
}

async function start() {
  startTheme();
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
