'use strict';
// Okabe and Ito's colours, in the order of drawing.py; a dash where they begin again.
const CLASSES = ['#0072B2', '#D55E00', '#009E73', '#CC79A7', '#E69F00', '#56B4E9'];
const MARK = '#D55E00';
const colourOf = (slot) => (slot === null || slot === undefined ? ink('--soft') : CLASSES[slot % CLASSES.length]);
const dashOf = (slot) => (slot !== null && Math.floor(slot / CLASSES.length) % 2 ? 'dash' : 'solid');
const ink = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const held = (name) => JSON.parse(document.getElementById(name).textContent);
// plotly reads tags and entities in its texts
const plain = (text) => String(text).replace(/&/g, '&amp;').replace(/</g, '&lt;').replace(/>/g, '&gt;');
// on a touch screen a finger on a chart scrolls the page
const TOUCH = matchMedia('(pointer: coarse)').matches;

function looks(own) {
  const axis = { gridcolor: ink('--line'), zerolinecolor: ink('--line'), linecolor: ink('--soft'), automargin: true, fixedrange: TOUCH };
  const layout = {
    paper_bgcolor: 'rgba(0,0,0,0)', plot_bgcolor: 'rgba(0,0,0,0)', font: { color: ink('--ink'), size: 12 }, colorway: CLASSES,
    margin: { l: 50, r: 12, t: 8, b: 24 }, showlegend: false, dragmode: TOUCH ? false : 'zoom', hoverlabel: { bgcolor: ink('--page') },
    modebar: { bgcolor: 'rgba(0,0,0,0)', color: ink('--soft'), activecolor: ink('--ink') }, ...own,
  };
  for (const name of ['xaxis', 'yaxis']) {
    layout[name] = { ...axis, ...(own[name] || {}) };
  }
  return layout;
}

const CONFIG = { responsive: true, displaylogo: false, displayModeBar: false };
const redraws = [];

function drawCharts() {
  for (const chart of document.querySelectorAll('.chart[id]')) {
    const source = document.getElementById(`${chart.id}-data`);
    if (source) {
      const { traces, layout } = JSON.parse(source.textContent);
      const coloured = traces.map((trace) => {
        const slot = trace.meta && trace.meta.class;
        if (slot === undefined) { return trace; }
        const colour = colourOf(slot);
        return { ...trace, marker: { color: colour, ...trace.marker }, line: { color: colour, dash: dashOf(slot), ...trace.line } };
      });
      Plotly.react(chart, coloured, looks(layout), CONFIG);
    }
  }
}

const root = document.documentElement;
const systemDark = matchMedia('(prefers-color-scheme: dark)');
const redraw = () => redraws.forEach((each) => each());
document.getElementById('theme').addEventListener('click', () => {
  const dark = root.dataset.theme ? root.dataset.theme === 'dark' : systemDark.matches;
  root.dataset.theme = dark ? 'light' : 'dark';
  redraw();
});
systemDark.addEventListener('change', redraw);
redraws.push(drawCharts);
document.addEventListener('DOMContentLoaded', drawCharts);
