const byId = (name) => document.getElementById(name);
const sums = (steps, unit) => { let sum = 0; return steps.map((step) => unit * (sum += step)); };
const LENGTH = data.unit.length;
const SPEED = data.unit.speed;
const TIME = data.unit.time;
const hand = { t: sums(data.hand.t, TIME), x: sums(data.hand.x, LENGTH), y: sums(data.hand.y, LENGTH), v: sums(data.hand.v, SPEED) };
const goals = data.goals.map((places) => places.map(([x, y]) => [LENGTH * x, LENGTH * y]));
const scenes = data.scenes.map((rows) => rows.map(([name, ...shape]) => [name, ...shape.map((value) => LENGTH * value)]));
const frameTimes = data.frames.map((frame) => data.times[frame.at]);
const mostCandidates = Math.max(...data.frames.map((frame) => frame.candidates.length));
const mostUnsolved = Math.max(...data.frames.map((frame) => frame.unsolved.length));
const slotOf = (track) => data.tracks[track].slot;
const letterOf = (track) => (slotOf(track) === null ? '' : String.fromCharCode(65 + slotOf(track)));
// Above this number of points, the likelihoods are drawn without marks.
const MOST_MARKS = 3000;
// Size of an ellipse, in parts of the median, up to which the filter counts as settled.
const MOST_USUAL = 1.5;
const state = { frame: 0, from: 0, to: 0, playing: false, focus: null };

// The row of the first value that is not below a bound.
const first = (values, least) => { const row = values.findIndex((value) => value >= least); return row < 0 ? values.length : row; };
const span = () => [frameTimes[state.from], frameTimes[state.to]];
const shareOf = (track, row) => { const value = data.tracks[track].share[row - data.tracks[track].first]; return value === undefined ? null : value; };

// Returns the outlines of ellipses [x, y, half axes, angle] as one trace: a closed line for each, with gaps between them.
function outlines(ellipses, points = 36) {
  const x = [];
  const y = [];
  for (const [cx, cy, a, b, angle] of ellipses) {
    const [c, s] = [Math.cos(angle), Math.sin(angle)];
    for (let k = 0; k <= points; k += 1) {
      const [u, v] = [a * Math.cos((2 * Math.PI * k) / points), b * Math.sin((2 * Math.PI * k) / points)];
      x.push(cx + u * c - v * s);
      y.push(cy + u * s + v * c);
    }
    x.push(null);
    y.push(null);
  }
  return { x, y, type: 'scatter', mode: 'lines', hoverinfo: 'skip', connectgaps: false };
}

// Returns the outlines of obstacles as one trace: an arc about each corner of its polygon; without corners it is a circle.
function borders(scene, grow, points = 36) {
  const x = [];
  const y = [];
  const turnOf = 2 * Math.PI;
  for (const [, cx, cy, radius, stddev, ...rest] of scene) {
    const corners = rest.length ? rest.flatMap((value, row) => (row % 2 ? [] : [[value, rest[row + 1]]])) : [[0, 0]];
    const after = (row) => corners[(row + 1) % corners.length];
    const normals = corners.map(([u, v], row) => Math.atan2(u - after(row)[0], after(row)[1] - v));
    const begin = x.length;
    corners.forEach(([u, v], row) => {
      const from = normals[(row + corners.length - 1) % corners.length];
      const turn = corners.length > 1 ? (((normals[row] - from) % turnOf) + turnOf) % turnOf : turnOf;
      const steps = Math.max(1, Math.ceil((points * turn) / turnOf));
      for (let k = 0; k <= steps; k += 1) {
        x.push(cx + u + (radius + grow * stddev) * Math.cos(from + (turn * k) / steps));
        y.push(cy + v + (radius + grow * stddev) * Math.sin(from + (turn * k) / steps));
      }
    });
    x.push(x[begin], null);
    y.push(y[begin], null);
  }
  return { x, y, type: 'scatter', mode: 'lines', hoverinfo: 'skip', connectgaps: false };
}

const alpha = (colour, share) => colour + Math.round(255 * share).toString(16).padStart(2, '0');
const faded = (track) => state.focus !== null && state.focus !== track;

// A compromised candidate, whose eta is below the wanted one, is dotted.
const lineOf = (candidate) => (candidate.compromised ? 'dot' : dashOf(slotOf(candidate.track)));
const discsOf = (ellipses) => ellipses.map(([cx, cy, a, b, angle]) => [LENGTH * cx, LENGTH * cy, LENGTH * a, LENGTH * b, (Math.PI * angle) / 180]);

function candidateTraces(frame, candidate) {
  const colour = colourOf(slotOf(candidate.track));
  const share = shareOf(candidate.track, frame.at);
  const weight = faded(candidate.track) ? 0.15 : 1;
  const [x, y] = [sums(candidate.x, LENGTH), sums(candidate.y, LENGTH)];
  const solid = colour.startsWith('#') && colour.length === 7;
  const motor = {
    ...outlines(discsOf(candidate.motor)), fill: 'toself', fillcolor: solid ? alpha(colour, weight * (0.04 + 0.16 * share)) : 'rgba(0,0,0,0)',
    line: { color: colour, width: 1 }, opacity: weight * (0.25 + 0.6 * share), meta: { motor: candidate.track },
  };
  const total = {
    ...outlines(discsOf(candidate.total)), line: { color: colour, width: 1, dash: 'dash' }, opacity: weight * (0.25 + 0.6 * share),
    meta: { total: candidate.track },
  };
  const middle = Math.floor(x.length * (0.45 + 0.12 * (candidate.track % 3)));
  const path = {
    x, y, type: 'scatter', mode: 'lines', line: { color: colour, dash: lineOf(candidate), width: 1.5 + 4 * share, shape: 'spline' },
    opacity: weight, hoverinfo: 'text', meta: { candidate: candidate.track },
    text: plain(`${letterOf(candidate.track)} ${percent(share)} ${wordsOf(candidate)} (${data.labels[candidate.label]})`),
  };
  const tag = {
    x: [x[middle]], y: [y[middle]], type: 'scatter', mode: 'markers+text', text: letterOf(candidate.track), textfont: { size: 11, color: ink('--ink') },
    marker: { size: 17, color: ink('--page'), line: { color: colour, width: 2 } }, opacity: weight, hoverinfo: 'skip',
  };
  return { motor, total, path, tag };
}

// Returns the grey path of a candidate without a likelihood.
const unsolvedTrace = (lost) => ({
  x: sums(lost.x, LENGTH), y: sums(lost.y, LENGTH), type: 'scatter', mode: 'lines', line: { color: ink('--soft'), width: 1.2, shape: 'spline' },
  opacity: 0.6, hoverinfo: 'text', text: plain(`${data.labels[lost.label]}: ${data.labels[lost.reason]}`), meta: { unsolved: lost.label },
});

// Returns the class of a candidate in words, for a person who reads no labels.
const wordsOf = (candidate) => data.labels[candidate.description] || 'no obstacle in the way';

const nothing = { x: [], y: [], type: 'scatter', mode: 'lines', hoverinfo: 'skip' };
const filled = (list, most = mostCandidates) => [...list, ...Array(most - list.length).fill(nothing)];

function sceneTraces(frame) {
  const scene = scenes[frame.scene];
  const [from, to] = span();
  const now = data.times[frame.at];
  const [begin, middle, end] = [first(hand.t, from), first(hand.t, now + 1e-6), first(hand.t, to + 1e-6)];
  const part = (low, high, line) => ({
    x: hand.x.slice(low, high), y: hand.y.slice(low, high), type: 'scatter', mode: 'lines', hoverinfo: 'skip', line: { color: ink('--ink'), ...line },
  });
  const drawn = [...frame.candidates].reverse().map((candidate) => candidateTraces(frame, candidate));
  const places = goals[frame.goals];
  return [
    { ...borders(scene, 1), fill: 'toself', fillcolor: ink('--ring'), line: { color: ink('--disc'), width: 1 } },
    { ...borders(scene, 0), fill: 'toself', fillcolor: ink('--disc'), line: { color: ink('--soft'), width: 1 } },
    ...filled(frame.unsolved.map(unsolvedTrace), mostUnsolved),
    ...filled(drawn.map((each) => each.motor)),
    ...filled(drawn.map((each) => each.total)),
    ...filled(drawn.map((each) => each.path)),
    part(begin, middle, { width: 3 }),
    part(Math.max(begin, middle - 1), end, { width: 2, dash: 'dot' }),
    {
      x: scene.map(([, x]) => x), y: scene.map(([, , y]) => y), type: 'scatter', mode: 'text', hoverinfo: 'skip', textfont: { size: 11 },
      text: scene.length > data.named_obstacles ? [] : scene.map(([name]) => plain(name)),
    },
    {
      x: places.map(([x]) => x), y: places.map(([, y]) => y), type: 'scatter', mode: 'markers+text', hoverinfo: 'skip',
      text: places.map((_, row) => `goal${row}`), textposition: 'top center', textfont: { size: 11 },
      marker: { symbol: 'star', size: 13, color: ink('--page'), line: { color: ink('--ink'), width: 1.5 } },
    },
    ...filled(drawn.map((each) => each.tag)),
    { x: hand.x.slice(middle - 1, middle), y: hand.y.slice(middle - 1, middle), type: 'scatter', mode: 'markers', hoverinfo: 'skip', marker: { size: 10, color: ink('--ink') } },
  ];
}

const now = () => ({ type: 'line', yref: 'paper', y0: 0, y1: 1, x0: frameTimes[state.frame], x1: frameTimes[state.frame], line: { color: ink('--ink'), width: 1.5, dash: 'dot' } });
const timeAxis = (title) => ({ range: span(), title: { text: title, standoff: 6 } });

function drawScene() {
  const [left, right, bottom, top] = data.bounds;
  const box = byId('scene');
  const height = Math.min(Math.max((box.clientWidth * (top - bottom)) / (right - left), 240), 0.75 * innerHeight + 80) + 44;
  Plotly.react(box, sceneTraces(data.frames[state.frame]), layoutOf({
    height, xaxis: { range: [left, right], title: { text: 'x [m]', standoff: 4 } },
    yaxis: { range: [bottom, top], title: { text: 'y [m]', standoff: 4 }, scaleanchor: 'x' }, uirevision: 'scene',
  }), { ...CONFIG, displayModeBar: !TOUCH, modeBarButtons: [['toImage', 'zoom2d', 'pan2d', 'resetScale2d']] });
}

// Returns the parts of all tracks within the visible time span. Drawing the rest would take time and not be visible.
function visibleTracks() {
  const [from, to] = [first(data.times, span()[0]), first(data.times, span()[1] + 1e-9)];
  return data.tracks.flatMap((track, number) => {
    const [begin, end] = [Math.max(from, track.first), Math.min(to, track.first + track.share.length)];
    const share = track.share.slice(begin - track.first, end - track.first);
    return begin < end && share.some((value) => value !== null) ? [{ number, times: data.times.slice(begin, end), share }] : [];
  });
}

// Returns a trace with a letter on each track that has at least three points.
function letters(tracks) {
  const places = tracks.flatMap(({ number, times, share }) => {
    const known = share.flatMap((value, row) => (value === null ? [] : [row]));
    const row = known[Math.floor((((number % 4) + 0.5) * known.length) / 4)];
    return known.length < 3 || slotOf(number) === null ? [] : [[times[row], share[row], number]];
  });
  return {
    x: places.map(([time]) => time), y: places.map(([, share]) => share), type: 'scatter', mode: 'markers+text', hoverinfo: 'skip',
    text: places.map(([, , number]) => letterOf(number)), textfont: { size: 9, color: ink('--ink') },
    marker: { size: 13, color: ink('--page'), line: { color: places.map(([, , number]) => colourOf(slotOf(number))), width: 1.5 } },
  };
}

// Returns the two traces between which the share of the candidates without a likelihood is hatched, down from 1.
function unknownTraces() {
  const [from, to] = [first(data.times, span()[0]), first(data.times, span()[1] + 1e-9)];
  const edge = { x: data.times.slice(from, to), type: 'scatter', mode: 'lines', line: { width: 0, shape: 'hvh' }, hoverinfo: 'skip' };
  return [
    { ...edge, y: edge.x.map(() => 1) },
    {
      ...edge, y: data.unknown.slice(from, to).map((share) => 1 - share), fill: 'tonexty', fillcolor: 'rgba(0,0,0,0)',
      fillpattern: { shape: '/', size: 7, solidity: 0.15, fgcolor: ink('--soft') }, meta: { unknown: true },
    },
  ];
}

function drawLikelihoods() {
  const tracks = visibleTracks();
  const marks = tracks.reduce((sum, { share }) => sum + share.length, 0) <= MOST_MARKS;
  const traces = tracks.map(({ number, times, share }) => ({
    x: times, y: share, type: 'scatter', mode: marks ? 'lines+markers' : 'lines', marker: { size: 3 }, connectgaps: false, hoverinfo: 'text',
    line: { color: colourOf(slotOf(number)), dash: dashOf(slotOf(number)), width: 2 }, opacity: faded(number) ? 0.15 : 1,
    text: share.map((value) => `${letterOf(number)} ${percent(value)}`), meta: { track: number },
  }));
  Plotly.react(byId('likelihoods'), [...traces, letters(tracks), ...unknownTraces()], layoutOf({
    height: 210, xaxis: timeAxis(''), yaxis: { range: [-0.03, 1.03], title: { text: 'likelihood', standoff: 4 } }, shapes: [now()], hovermode: 'closest',
  }), CONFIG);
}

function drawSpeeds() {
  const frame = data.frames[state.frame];
  const [from, past, to] = [span()[0], data.times[frame.at], span()[1]].map((time, row) => first(hand.t, time + (row ? 1e-6 : 0)));
  const measured = { type: 'scatter', mode: 'lines', hoverinfo: 'skip' };
  const predicted = filled([...frame.candidates].reverse().map((candidate) => ({
    x: sums(candidate.t, TIME).map((t) => t + data.times[frame.at]), y: sums(candidate.v, SPEED), type: 'scatter', mode: 'lines', hoverinfo: 'text',
    text: plain(`${letterOf(candidate.track)} ${wordsOf(candidate)}`), opacity: faded(candidate.track) ? 0.15 : 1,
    line: { color: colourOf(slotOf(candidate.track)), dash: lineOf(candidate), width: 1.2 + 2.5 * shareOf(candidate.track, frame.at) },
  })));
  Plotly.react(byId('speeds'), [
    ...predicted,
    { ...measured, x: hand.t.slice(from, to), y: hand.v.slice(from, to), line: { color: ink('--ink'), width: 1.5, dash: 'dot' } },
    { ...measured, x: hand.t.slice(from, past), y: hand.v.slice(from, past), line: { color: ink('--ink'), width: 2.5 } },
  ], layoutOf({ height: 190, xaxis: timeAxis(''), yaxis: { title: { text: 'speed [m/s]', standoff: 4 }, range: [0, topSpeed] }, shapes: [now()] }), CONFIG);
}

function drawTimes() {
  const known = data.solve_ms.filter((value) => value !== null).sort((a, b) => a - b);
  if (!known.length) {
    byId('times-part').hidden = true;
    return;
  }
  const most99 = known[Math.min(known.length - 1, Math.floor(0.99 * known.length))];
  Plotly.react(byId('times'), [{ x: data.times, y: data.solve_ms, type: 'scatter', mode: 'markers', marker: { size: 4, color: ink('--soft') }, hoverinfo: 'x+y' }], layoutOf({
    height: 160, xaxis: timeAxis('time [s]'), yaxis: { title: { text: 'solve [ms]', standoff: 4 }, range: [0, 1.25 * most99] }, shapes: [now()],
  }), CONFIG);
}

const percent = (share) => (share === null ? '' : `${(100 * share).toFixed(share < 0.0095 ? 1 : 0)} %`);

function cell(row, text, kind = '') {
  const made = row.insertCell();
  made.textContent = text;
  made.className = kind;
  return made;
}

function fillTable() {
  const frame = data.frames[state.frame];
  const body = byId('candidates').tBodies[0];
  body.replaceChildren();
  for (const candidate of frame.candidates) {
    const share = shareOf(candidate.track, frame.at);
    const row = body.insertRow();
    row.dataset.track = candidate.track;
    row.dataset.share = share;
    row.classList.toggle('faded', faded(candidate.track));
    row.addEventListener('click', () => { state.focus = state.focus === candidate.track ? null : candidate.track; drawLikelihoods(); show(state.frame); });
    const letter = document.createElement('span');
    letter.className = 'letter';
    letter.textContent = letterOf(candidate.track);
    letter.style.borderColor = colourOf(slotOf(candidate.track));
    cell(row, '').append(letter);
    cell(row, percent(share), 'number');
    const bar = document.createElement('span');
    bar.className = 'bar';
    const filling = document.createElement('i');
    filling.style.cssText = `width: ${100 * share}%; background: ${colourOf(slotOf(candidate.track))}`;
    bar.append(filling);
    cell(row, '').append(bar);
    cell(row, data.labels[candidate.label], 'label');
    cell(row, wordsOf(candidate));
    cell(row, candidate.ratio === null ? '' : candidate.ratio.toFixed(2), 'number');
    cell(row, candidate.eta === null ? '' : `${candidate.eta.toFixed(3)}${candidate.compromised ? ' *' : ''}`, 'number');
  }
  for (const lost of frame.unsolved) {
    const row = body.insertRow();
    cell(row, '✕');
    const text = cell(row, `${data.labels[lost.label]} (${data.labels[lost.description]}): ${data.labels[lost.reason]}`);
    text.colSpan = 6;
  }
}

function show(frame) {
  state.frame = Math.min(Math.max(frame, state.from), state.to);
  const time = frameTimes[state.frame];
  byId('time').value = state.frame;
  byId('clock').textContent = `${time.toFixed(2)} s`;
  drawScene();
  drawSpeeds();
  fillTable();
  for (const name of ['likelihoods', 'times']) {
    if (byId(name).data) { Plotly.relayout(byId(name), { 'shapes[0].x0': time, 'shapes[0].x1': time }); }
  }
}

// Returns the first frame of a span whose largest ellipse is of the usual size: before it, the filter of the hand has not settled.
function settledFrame(from, to) {
  const sizes = data.frames.slice(from, to + 1).map((frame) => Math.max(0, ...frame.candidates.flatMap((each) => (each.total.length ? each.total : each.motor).map((ellipse) => ellipse[2]))));
  const usual = [...sizes].sort((a, b) => a - b)[Math.floor(sizes.length / 2)];
  return from + Math.max(0, sizes.findIndex((size) => size > 0 && size <= MOST_USUAL * usual));
}

function choose(movement) {
  const [from, to] = movement < 0 ? [-Infinity, Infinity] : data.movements[movement];
  const inside = frameTimes.flatMap((time, row) => (time >= from && time <= to ? [row] : []));
  [state.from, state.to] = inside.length ? [inside[0], inside[inside.length - 1]] : [0, frameTimes.length - 1];
  state.focus = null;
  [byId('time').min, byId('time').max] = [state.from, state.to];
  state.frame = settledFrame(state.from, state.to);
  drawAll();
}

function drawAll() {
  drawLikelihoods();
  drawTimes();
  show(state.frame);
}

function play() {
  state.playing = !state.playing;
  byId('play').textContent = state.playing ? '❚❚' : '▶';
  byId('play').setAttribute('aria-label', state.playing ? 'pause' : 'play');
  if (!state.playing) { return; }
  if (state.frame >= state.to) { show(state.from); }
  let [before, time] = [null, frameTimes[state.frame]];
  const step = (stamp) => {
    if (!state.playing) { return; }
    time += before === null ? 0 : (Number(byId('pace').value) * (stamp - before)) / 1000;
    before = stamp;
    let next = state.frame;
    while (next < state.to && frameTimes[next + 1] <= time) { next += 1; }
    if (next !== state.frame) { show(next); }
    if (state.frame >= state.to) { play(); } else { requestAnimationFrame(step); }
  };
  requestAnimationFrame(step);
}

const topSpeed = 1.15 * Math.max(0.01, ...hand.v, ...data.frames.map((frame) => (frame.candidates.length ? Math.max(...sums(frame.candidates[0].v, SPEED)) : 0)));
if (data.frames.length < data.times.length) {
  byId('decimated').textContent = `The slider stops at ${data.frames.length} of the ${data.times.length} predictions; likelihoods are drawn for all of them. `;
}
const choice = byId('movement');
data.movements.forEach((_, row) => choice.add(new Option(`movement ${row + 1}`, row)));
choice.add(new Option('whole recording', -1));
choice.hidden = data.movements.length < 2;
choice.addEventListener('change', () => choose(Number(choice.value)));
byId('play').addEventListener('click', play);
byId('time').addEventListener('input', () => { if (state.playing) { play(); } show(Number(byId('time').value)); });
choose(data.movements.length > 1 ? 0 : -1);
for (const name of ['likelihoods', 'speeds', 'times']) {
  if (byId(name).data) {
    byId(name).on('plotly_click', ({ points }) => {
      const row = first(frameTimes, points[0].x);
      show(Math.min(row, state.to));
    });
  }
}
// A warning leads to its first moment.
for (const button of document.querySelectorAll('.moment')) {
  button.addEventListener('click', () => {
    if (state.playing) { play(); }
    choice.value = -1;
    choose(-1);
    show(Math.min(first(frameTimes, Number(button.dataset.time)), state.to));
    byId('scene').scrollIntoView({ block: 'center' });
  });
}
redraws.push(drawAll);
document.body.dataset.ready = 'yes';
