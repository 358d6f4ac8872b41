const data = readData('report-data');
const CLASSES = data.colours;
const colourOf = (slot) => (slot === null || slot === undefined ? ink('--soft') : CLASSES[slot % CLASSES.length]);
// Slots beyond the number of colours use the same colours again, dashed.
const dashOf = (slot) => (slot !== null && Math.floor(slot / CLASSES.length) % 2 ? 'dash' : 'solid');
// Plotly interprets tags and entities in its texts.
const plain = (text) => String(text).replace(/&/g, '&amp;').replace(/</g, '&lt;').replace(/>/g, '&gt;');
// On a touch screen, a finger on a chart scrolls the page.
const TOUCH = matchMedia('(pointer: coarse)').matches;

// Returns a layout in the colours of the page, with the given settings on top.
function layoutOf(own) {
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
