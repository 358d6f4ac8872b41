// SPDX-FileCopyrightText: 2026 the foc_ros developers
// SPDX-License-Identifier: Apache-2.0
const data = readData('report-data');
const SPEED = data.unit.speed;
const TIME = data.unit.time;
const hand = { t: sums(data.hand.t, TIME), v: sums(data.hand.v, SPEED), path: decodePath(data.hand) };
const goals = data.goals.map((places) => places.map(([x, y]) => [LENGTH * x, LENGTH * y]));
const scenes = data.scenes.map((rows) => rows.map(([name, ...shape]) => {
  const [x, y, radius, stddev, ...rest] = shape.map((value) => LENGTH * value);
  return { name: rows.length > data.named_obstacles ? '' : name, x, y, radius, stddev, corners: rest.flatMap((value, row) => (row % 2 ? [] : [[value, rest[row + 1]]])) };
}));
const frameTimes = data.frames.map((frame) => data.times[frame.at]);
const slotOf = (track) => data.tracks[track].slot;
// Returns the slot of a candidate of a frame, null where the candidate is too unlikely for a letter and a colour.
const slotAt = (track, row) => (track !== undefined && shareOf(track, row) >= NOTED ? slotOf(track) : null);
const shareOf = (track, row) => { const value = data.tracks[track].share[row - data.tracks[track].first]; return value === undefined ? null : value; };
// Above this number of points, the likelihoods are drawn without marks.
const MOST_MARKS = 3000;
const state = { frame: 0, from: 0, to: 0, playing: false, focus: null, topSpeed: 1 };

// The row of the first value that is not below a bound.
const first = (values, least) => { const row = values.findIndex((value) => value >= least); return row < 0 ? values.length : row; };
// The value that a share of some values does not exceed.
const quantile = (values, share) => [...values].sort((a, b) => a - b)[Math.min(values.length - 1, Math.floor(share * values.length))] || 0;
const span = () => [frameTimes[state.from], frameTimes[state.to]];
const faded = (track) => state.focus !== null && state.focus !== track;
const alphaOf = (track) => (faded(track) ? 0.15 : 1);
const scene = new Scene(byId('scene'));
const charts = {
  likelihoods: new Chart(byId('likelihoods'), { height: 210, label: 'likelihood', picked: pick }),
  speeds: new Chart(byId('speeds'), { height: 190, label: 'speed [m/s]', picked: pick }),
  times: new Chart(byId('times'), { height: 140, label: 'computation time [ms]', picked: pick }),
};
globalThis.report = { data, scenes, scene, charts, state }; // for scripts

function pick(time) {
  if (state.playing) { play(); }
  show(first(frameTimes, time - 1e-9));
}

// Returns a candidate of a frame, or one without a likelihood, as the scene draws it.
function viewOf(frame, each) {
  const [track, share] = each.track === undefined ? [null, null] : [each.track, shareOf(each.track, frame.at)];
  const slot = slotAt(each.track, frame.at);
  const words = data.labels[each.description] || 'no obstacle in the way';
  const text = `${track === null ? '' : `${letterOf(slot)} ${percent(share)} `.trimStart()}${words} (${data.labels[each.label]})${each.reason ? `: ${data.labels[each.reason]}` : ''}`;
  return {
    ...each, track, share, words, text, slot, likelihood: share, path: decodePath(each),
    motor: decodeEllipses(each.motor), total: decodeEllipses(each.total), ghost: data.labels[each.ghost],
  };
}

function drawScene(frame) {
  const [from, to] = span();
  const now = data.times[frame.at];
  const [begin, middle, end] = [first(hand.t, from), first(hand.t, now + 1e-6), first(hand.t, to + 1e-6)];
  scene.begin();
  scene.grid();
  scenes[frame.scene].forEach((each) => scene.obstacle(each));
  goals[frame.goals].forEach((place, row) => scene.goal(place, row, { radius: 7 * scene.unit }));
  scene.candidates([...frame.candidates, ...frame.unsolved].map((each) => viewOf(frame, each)), ({ track }) => (track === null ? 1 : alphaOf(track)));
  scene.line(hand.path.slice(Math.max(begin, middle - 1), end), ink('--soft'), 1.5);
  scene.line(hand.path.slice(begin, middle), ink('--ink'), 3);
  if (middle) { scene.disc(hand.path[middle - 1], 5 * scene.unit, ink('--ink'), { filled: 1, width: 0 }); }
}

// Returns the parts of all tracks within the visible time span. Drawing the rest would take time and not be visible.
function visibleTracks() {
  const [from, to] = [first(data.times, span()[0]), first(data.times, span()[1] + 1e-9)];
  return data.tracks.flatMap((track, number) => {
    const [begin, end] = [Math.max(from, track.first), Math.min(to, track.first + track.share.length)];
    const points = data.times.slice(begin, Math.max(end, begin)).map((time, row) => [time, track.share[begin - track.first + row]]);
    return points.some(([, share]) => share !== null) ? [{ number, points }] : [];
  });
}

function drawLikelihoods() {
  const tracks = visibleTracks();
  const marks = tracks.reduce((sum, { points }) => sum + points.length, 0) <= MOST_MARKS;
  const lines = tracks.map(({ number, points }) => {
    const slot = slotOf(number);
    return { points, marks, name: number, width: 2, colour: colourOf(slot), alpha: alphaOf(number), letter: letterOf(slot) };
  });
  const [from, to] = [first(data.times, span()[0]), first(data.times, span()[1] + 1e-9)];
  const hatched = data.times.slice(from, to).map((time, row) => [time, data.unknown[from + row]]);
  charts.likelihoods.draw({ span: span(), top: 1, lines, hatched, now: frameTimes[state.frame] });
}

// Returns the candidates of a frame that are worth mentioning.
const noted = (frame) => frame.candidates.filter(({ track }) => shareOf(track, frame.at) >= NOTED);

function drawSpeeds(frame) {
  const now = data.times[frame.at];
  const [from, past, to] = [span()[0], now + 1e-6, span()[1] + 1e-6].map((time) => first(hand.t, time));
  const measured = (begin, end) => hand.t.slice(begin, end).map((time, row) => [time, hand.v[begin + row]]);
  const predicted = noted(frame).reverse().map((each) => {
    const speeds = sums(each.v, SPEED);
    const points = sums(each.t, TIME).map((time, row) => [now + time, speeds[row]]);
    return { points: points.filter(([time]) => time <= span()[1]), colour: colourOf(slotAt(each.track, frame.at)), dotted: each.compromised, alpha: alphaOf(each.track), width: 1.2 + 2.5 * shareOf(each.track, frame.at) };
  });
  const lines = [...predicted, { points: measured(Math.max(past - 1, from), to), colour: 'var(--soft)', width: 1.5 }, { points: measured(from, past), colour: 'var(--ink)', width: 2.5 }];
  charts.speeds.draw({ span: span(), top: state.topSpeed, lines, now });
}

function drawTimes() {
  const known = data.solve_ms.filter((value) => value !== null);
  byId('times-part').hidden = !known.length;
  if (!known.length) { return; }
  const top = 1.25 * quantile(known, 0.99) || 1;
  const rows = data.times.map((time, row) => [time, data.solve_ms[row]]).filter(([time, value]) => value !== null && time >= span()[0] && time <= span()[1]);
  const points = rows.map(([time, value]) => [time, Math.min(value, top)]);
  charts.times.draw({ span: span(), top, lines: [{ points, colour: 'var(--soft)', width: 0, marks: points.length <= MOST_MARKS }], now: frameTimes[state.frame] });
}

function cell(row, text, kind = '') {
  const made = row.insertCell();
  made.textContent = text;
  made.className = kind;
  return made;
}

function fillTable(frame) {
  const body = byId('candidates').tBodies[0];
  body.replaceChildren();
  for (const each of frame.candidates) {
    const view = viewOf(frame, each);
    const row = body.insertRow();
    [row.dataset.track, row.dataset.share] = [each.track, view.share];
    row.classList.toggle('faded', faded(each.track));
    row.addEventListener('click', () => { state.focus = state.focus === each.track ? null : each.track; drawLikelihoods(); show(state.frame); });
    const [letter, bar] = makeSigns(view);
    cell(row, '').append(letter);
    cell(row, percent(view.share), 'number');
    cell(row, '').append(bar);
    cell(row, data.labels[each.label], 'label');
    cell(row, view.ghost ? `${view.words}; ${view.ghost}` : view.words);
    cell(row, each.ratio === null ? '' : each.ratio.toFixed(each.ratio < 100 ? 2 : 0), 'number');
    cell(row, each.eta === null ? '' : `${each.eta.toFixed(3)}${each.compromised ? ' *' : ''}`, 'number');
  }
  for (const lost of frame.unsolved) {
    const row = body.insertRow();
    cell(row, '✕');
    cell(row, `${data.labels[lost.label]} (${data.labels[lost.description]}): ${data.labels[lost.reason]}`).colSpan = 6;
  }
}

function show(number) {
  state.frame = clamp(number, state.from, state.to);
  const frame = data.frames[state.frame];
  const time = frameTimes[state.frame];
  byId('time').value = state.frame;
  byId('clock').textContent = `${time.toFixed(2)} s`;
  drawScene(frame);
  drawSpeeds(frame);
  fillTable(frame);
  for (const name of ['likelihoods', 'times']) { charts[name].move(time); }
}

// Returns the rows of the first and the last frame of a movement, of the whole recording for -1.
function framesOf(movement) {
  const [from, to] = movement < 0 ? [-Infinity, Infinity] : data.movements[movement];
  const inside = frameTimes.flatMap((time, row) => (time >= from && time <= to ? [row] : []));
  return inside.length ? [inside[0], inside[inside.length - 1]] : [0, frameTimes.length - 1];
}

function choose(movement) {
  [state.from, state.to] = framesOf(movement);
  state.focus = null;
  [byId('time').min, byId('time').max] = [state.from, state.to];
  const fastest = data.frames.slice(state.from, state.to + 1).flatMap(noted).map(({ v }) => Math.max(...sums(v, SPEED)));
  state.topSpeed = 1.05 * Math.max(0.01, ...fastest, ...hand.v.filter((_, row) => hand.t[row] >= span()[0] && hand.t[row] <= span()[1]));
  state.frame = data.openings[movement < 0 ? data.opened : movement] ?? state.from;
  drawAll();
}

function drawAll() {
  scene.resize();
  drawLikelihoods();
  drawTimes();
  show(state.frame);
}

// Shows the scene within limits of x, then of y [m]; without them, all of it.
function zoom(bounds) {
  const [left, right, bottom, top] = data.bounds;
  scene.canvas.style.aspectRatio = `${right - left} / ${top - bottom}`;
  scene.fit(bounds || data.bounds);
  if (bounds) { drawScene(data.frames[state.frame]); }
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

if (data.frames.length < data.count) {
  const drawn = data.times.length < data.count ? `${data.times.length} of them` : 'all of them';
  byId('decimated').textContent = `The slider stops at ${data.frames.length} of the ${data.count} predictions; likelihoods are drawn for ${drawn}. `;
}
const choice = byId('movement');
data.movements.forEach((_, row) => choice.add(new Option(`movement ${row + 1}`, row)));
choice.add(new Option('whole recording', -1));
choice.hidden = data.movements.length < 2;
choice.addEventListener('change', () => choose(Number(choice.value)));
byId('play').addEventListener('click', play);
byId('time').addEventListener('input', () => { if (state.playing) { play(); } show(Number(byId('time').value)); });
scene.canvas.addEventListener('pointermove', (event) => { scene.canvas.title = scene.find(scene.toScene(event)); });
scene.canvas.addEventListener('wheel', (event) => {
  if (!event.ctrlKey && !event.shiftKey) { return; } // a wheel alone scrolls the page
  event.preventDefault();
  const factor = event.deltaY < 0 ? 0.8 : 1.25;
  const at = scene.toScene(event);
  zoom(scene.bounds.map((edge, row) => at[row >> 1] + factor * (edge - at[row >> 1])));
}, { passive: false });
scene.canvas.addEventListener('dblclick', () => { zoom(); drawScene(data.frames[state.frame]); });
writeLegend(byId('signs'), ['hand', 'past', 'later', 'path', 'unlikely', 'compromised', 'ghost', 'motor', 'total', 'obstacle', 'goal']);
zoom();
choice.value = data.movements.length > 1 ? data.opened : -1;
choose(Number(choice.value));
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
addEventListener('resize', drawAll);
document.body.dataset.ready = 'yes';
