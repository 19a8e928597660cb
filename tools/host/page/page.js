// SPDX-License-Identifier: Apache-2.0
// What the scripts of every page share.
const element = (id) => document.getElementById(id);

element('theme').addEventListener('click', () => {
  const root = document.documentElement;
  const dark = root.dataset.theme ? root.dataset.theme === 'dark' : matchMedia('(prefers-color-scheme: dark)').matches;
  root.dataset.theme = dark ? 'light' : 'dark';
});
