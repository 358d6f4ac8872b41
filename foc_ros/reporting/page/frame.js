// SPDX-FileCopyrightText: 2026 the foc_ros developers
// SPDX-License-Identifier: Apache-2.0
'use strict';
// Colours of the page by name, which are read again after a switch between dark and light.
let inks = {};
const ink = (name) => (inks[name] ??= getComputedStyle(document.documentElement).getPropertyValue(name).trim());
const byId = (name) => document.getElementById(name);
const clamp = (value, low, high) => Math.min(Math.max(value, low), high);
const readData = (name) => JSON.parse(byId(name).textContent);
// Functions that draw the charts again after a switch between dark and light.
const redraws = [];
const root = document.documentElement;
const systemDark = matchMedia('(prefers-color-scheme: dark)');
const redraw = () => {
  inks = {};
  redraws.forEach((each) => each());
};
byId('theme').addEventListener('click', () => {
  const dark = root.dataset.theme ? root.dataset.theme === 'dark' : systemDark.matches;
  root.dataset.theme = dark ? 'light' : 'dark';
  redraw();
});
systemDark.addEventListener('change', redraw);
