// SPDX-FileCopyrightText: 2026 the foc_ros developers
// SPDX-License-Identifier: Apache-2.0
// The page: one connection to the server, one frame after the other, and the controls.
import { Arranging } from './arranging.js';
import { Hand } from './hand.js';

const RETRY_MS = 1000;
// Time over which frames are counted [ms], and the number of delays of which the median is shown.
const COUNTED_MS = 2000;
const DELAYS = 200;
// Time since the last position that was sent [ms] after which an event or a frame sends one.
const EVENT_MS = 6;
const FRAME_MS = 12;
const METRES_PER_NEWTON = 0.02;
const HAND_RADIUS = 0.006;
const [START_COLOUR, TOUCHED_COLOUR] = ['#009E73', '#D55E00'];
const TASK_WORDS = {
  none: '', return: 'Go to the green start and rest there.', wait: 'Rest at the start until a goal is lit.', reach: 'Reach the lit goal, and stay there.',
  over: '',
};

const canvas = byId('scene');
const scene = new Scene(canvas);
const toScene = (event) => scene.toScene(event);
const hand = new Hand(canvas, toScene, (time) => moveHand(time, EVENT_MS));
let isSceneChanged = false;
const arranging = new Arranging(canvas, toScene, () => { isSceneChanged = true; }, (text) => refuse(text));
const view = { unknown: 0, other: 0, scene: arranging.scene, selected: null, goal: null, phase: 'none', candidates: [], hand, hidden: false, touchedMs: -Infinity };
// What the page measures: frames per second, the time from an input to the drawn prediction that was made from it [ms], which is the
// median and of nine in ten, and how many predictions were drawn.
const measured = { fps: 0, delayMs: null, mostMs: null, predictions: 0, delays: [] };
// For scripts: what is drawn, what is measured, and a new scene in place of the present one.
globalThis.play = {
  view,
  scene,
  measured,
  settings: null,
  setScene(scene) {
    arranging.setScene(scene);
    isSceneChanged = true;
  },
};

let socket = null;
let settings = null;
let isReplaced = false;
let lastMs = null;
let waitingEvents = [];
const frames = [];
let predictedMs = 0;
const OLD_MS = 1000; // after which a prediction is not shown any more
const LATE_MS = 150; // median time from an input to the drawn prediction above which the status line is not green
let measuredMs = 0; // when this time was measured last
let heardMs = 0; // when the last message of the server came
const REFUSED_MS = 6000; // for which the status line says that something was refused
let task = { phase: 'none' };
let job = null;

const send = (message) => {
  if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
};

// level: whether all is well, it waits for something, or something fails, as long as the job that failed is shown.
let failure = '';
function showStatus(level, text) {
  const box = byId('status');
  const words = failure ? `${failure}${level === 'well' ? '' : `; ${text}`}` : text;
  if (box.textContent !== words) box.textContent = words;
  box.className = `status ${failure ? 'failing' : level}`;
}

function fail(text) {
  failure = text;
  showStatus('well', text);
}

function refuse(text) {
  fail(`refused: ${text}`);
  setTimeout(() => { failure = ''; }, REFUSED_MS);
}

// Lets all controls be used, or none; the server tells afterwards which of them have to wait.
function enableControls(on) {
  for (const each of document.querySelectorAll('main :is(button, input, select)')) each.disabled = !on;
}

// Returns the corners of an obstacle from its centre, none for a circle.
function cornersOf({ kind, size_x: length, size_y: width, yaw }) {
  if (kind !== 'box') return [];
  const [c, s] = [Math.cos(yaw) / 2, Math.sin(yaw) / 2];
  return [[1, 1], [-1, 1], [-1, -1], [1, -1]].map(([u, v]) => [u * length * c - v * width * s, u * length * s + v * width * c]);
}

function draw(now) {
  scene.begin();
  if (view.phase !== 'none') scene.disc(settings.start, settings.target_radius, START_COLOUR, { filled: view.phase === 'reach' ? 0 : 0.5 });
  view.scene.obstacles.forEach((each, row) => scene.obstacle({
    name: `${row}`, x: each.x, y: each.y, radius: each.radius || 0, stddev: settings.radius_stddev, corners: cornersOf(each),
  }, each === view.selected));
  view.scene.goals.forEach((goal, row) => scene.goal([goal.x, goal.y], row, { lit: view.goal === row, selected: goal === view.selected, radius: settings.target_radius }));
  scene.candidates(view.hidden ? [] : view.candidates);
  const { position, target, force } = hand;
  if (!view.hidden) { // the distance between pointer and hand tells whether there is guidance
    if (Math.hypot(...force) > 0.01) scene.line([position, position.map((value, axis) => value + METRES_PER_NEWTON * force[axis])], ink(FORCE.ink), FORCE.width);
    scene.line([target, position], ink('--soft'), 1);
    scene.disc(target, 0.6 * HAND_RADIUS, ink('--soft'), { width: 1 });
  }
  scene.disc(position, HAND_RADIUS, now - view.touchedMs < 400 ? TOUCHED_COLOUR : ink('--ink'), { filled: 1, width: 0 });
}

// Returns a candidate as the scene draws it.
function decode(each) {
  const words = each.description || 'no obstacle in the way';
  return { ...each, words, text: words, path: decodePath(each), motor: decodeEllipses(each.motor), total: decodeEllipses(each.total) };
}

function makeTable(columns, rows) {
  const table = document.createElement('table');
  for (const [tag, row] of [['th', columns], ...rows.map((each) => ['td', each])]) {
    const line = table.insertRow();
    for (const text of row) {
      const cell = document.createElement(tag);
      cell.textContent = text;
      line.append(cell);
    }
  }
  return table;
}

const handlers = {
  hello(message) {
    settings = message;
    globalThis.play.settings = message;
    for (const each of [hand, arranging]) each.configure(message);
    scene.fit(message.bounds);
    enableControls(true);
    failure = '';
    for (const name of ['score', 'result']) byId(name).replaceChildren(); // those of this server follow
  },
  replaced() {
    isReplaced = true;
    socket.close();
    view.candidates = [];
    enableControls(false);
    fail('Another page has taken over. Load this page again to take it back.');
  },
  scene({ obstacles, goals }) {
    arranging.setScene({ obstacles, goals });
  },
  settings(message) {
    byId('guidance').checked = message.guided;
    byId('parameters').value = message.parameters;
    byId('parameters').options[1].disabled = !message.fitted;
    byId('record').dataset.on = message.recording;
    nameRecordButton();
    byId('report').disabled = message.recording || !message.session;
    const lack = message.unguided ? '' : 'needs tasks with trials without guidance';
    for (const [name, reason] of [['fit', lack], ['compare', lack || (message.fitted ? '' : 'needs a fit before')]]) {
      [byId(name).disabled, byId(name).title] = [message.recording || reason !== '', reason];
    }
    const place = `${message.recording ? 'Recording' : 'Recorded'} to ${message.session}`;
    byId('session').textContent = message.session ? place : `Tasks and recordings are kept in ${settings.data}, also earlier ones.`;
    byId('download').hidden = !message.report;
    if (message.recording) byId('score').replaceChildren(); // that of the session before
  },
  status({ level, text }) {
    const isLate = level !== 'failing' && measured.delayMs > LATE_MS && performance.now() - measuredMs < OLD_MS;
    const late = `predictions come ${Math.round(measured.delayMs)} ms late: this computer is busy; end other programs`;
    if (isLate) showStatus('waiting', level === 'well' ? late : `${text}; ${late}`);
    else showStatus(level, text);
  },
  prediction({ event, candidates, unknown, other }) {
    [view.unknown, view.other] = [unknown, other];
    view.candidates = candidates.map(decode);
    predictedMs = performance.now();
    measured.predictions += 1;
    if (event !== null) waitingEvents.push(event);
    draw(predictedMs); // the browser shows it with its next frame, and what is drawn in that frame with the one after
    measureDelays();
  },
  force({ force }) {
    hand.setForce(force, performance.now());
  },
  touched() {
    view.touchedMs = performance.now();
  },
  task(message) {
    task = message;
    const isRunning = message.phase !== 'none';
    view.phase = message.phase;
    view.goal = isRunning ? message.goal : null;
    view.hidden = isRunning && message.blinded;
    byId('begin').textContent = isRunning ? 'end tasks' : 'begin tasks';
    for (const name of ['arrange', 'shuffle', 'restore', 'guidance', 'record', 'parameters']) byId(name).disabled = isRunning;
    if (isRunning) setArranging(false);
    nameRecordButton();
    byId('task').textContent = isRunning ? `${message.trial} of ${message.trials}: ${TASK_WORDS[message.phase]}` : '';
  },
  score({ columns, rows }) {
    byId('score').replaceChildren(rows.length ? makeTable(columns, rows) : 'No trial was finished.');
  },
  job({ name, state, text, seconds }) {
    job = state === 'running' ? { name, text, begunMs: performance.now() - 1000 * seconds } : null;
    failure = state === 'failed' ? `${name} failed` : '';
    showJob();
    if (!job) byId('job').textContent = `${name}: ${text}${seconds ? ` (${seconds} s)` : ''}`;
    for (const each of ['cancel', 'progress']) byId(each).hidden = !job || job.name === 'report';
    if (name === 'report' && state === 'done') byId('download').hidden = false;
  },
  result({ columns, rows }) {
    byId('result').replaceChildren(makeTable(columns, rows));
  },
  error({ text }) {
    byId('job').textContent = `refused: ${text}`;
    refuse(text);
  },
};

// Tasks end the recording that belongs to them.
function nameRecordButton() {
  byId('record').textContent = byId('record').dataset.on === 'true' && task.phase === 'none' ? 'end recording' : 'record';
}

// Shows no job: none runs, or what becomes of it is not told.
function endJob() {
  job = null;
  for (const name of ['cancel', 'progress']) byId(name).hidden = true;
  byId('job').textContent = '';
}

// Says what a job does, and for how long; a share of a whole in its words, such as `20 of 60`, moves the bar.
function showJob() {
  if (!job) return;
  const seconds = Math.floor((performance.now() - job.begunMs) / 1000);
  const text = `${job.name}: ${job.text}, for ${seconds} s;${job.name === 'report' ? '' : ' this takes some minutes, and'} you can go on playing`;
  if (byId('job').textContent !== text) byId('job').textContent = text;
  const [, done, whole] = job.text.match(/(\d+) of (\d+)$/) || [];
  if (whole) [byId('progress').max, byId('progress').value] = [Number(whole), Number(done)];
  else byId('progress').removeAttribute('value');
}

function connect() {
  socket = new WebSocket(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/socket`);
  socket.addEventListener('message', ({ data }) => {
    heardMs = performance.now();
    const message = JSON.parse(data);
    handlers[message.type](message);
  });
  socket.addEventListener('close', () => {
    endJob();
    if (isReplaced) return;
    view.candidates = [];
    enableControls(false);
    fail('The server is gone; trying again.');
    setTimeout(connect, RETRY_MS);
  });
}

function setArranging(on) {
  byId('arrange').checked = on;
  byId('editing').hidden = !on;
  canvas.classList.toggle('arranging', on);
  [arranging.enabled, hand.enabled] = [on, !on];
  if (!on) arranging.selected = null;
}

let shownWays = '';
// Writes the table of candidates, with bars in the colours of their paths, if it has changed; by goals and names, so that a bar stays
// where it is while likelihoods change.
function showWays() {
  const known = view.hidden ? [] : view.candidates.filter(({ likelihood }) => likelihood !== null);
  const rows = known.filter((each) => each.likelihood >= NOTED).sort((a, b) => a.goal - b.goal || a.words.localeCompare(b.words));
  const others = known.filter((each) => each.likelihood < NOTED);
  const rest = others.reduce((sum, each) => sum + each.likelihood, 0);
  if (others.length) rows.push({ slot: null, likelihood: rest, words: `${others.length} more, each below 1 %`, ghost: '' });
  for (const [likelihood, words] of [[view.unknown, 'no likelihood is known'], [view.other, 'another goal']]) if (rows.length && likelihood >= 0.005) rows.push({ slot: null, likelihood, words, ghost: '' });
  const key = JSON.stringify(rows.map(({ slot, likelihood, words, ghost, compromised }) => [slot, Math.round(100 * likelihood), words, ghost, compromised]));
  if (key === shownWays) return;
  shownWays = key;
  byId('ways').tBodies[0].replaceChildren(...rows.map((each) => {
    const { likelihood, words, ghost } = each;
    const line = document.createElement('tr');
    const [letter, bar] = makeSigns(each);
    for (const content of [letter, bar, percent(likelihood), `${words}${ghost ? `; ${ghost}` : ''}`]) line.insertCell().append(content);
    return line;
  }));
}

function measureDelays() {
  const now = performance.now();
  measured.delays.push(...waitingEvents.map((event) => now - event));
  if (waitingEvents.length) measuredMs = now;
  measured.delays.splice(0, Math.max(measured.delays.length - DELAYS, 0));
  waitingEvents = [];
}

function measure(time) {
  measureDelays();
  frames.push(time);
  while (frames[0] < time - COUNTED_MS) frames.shift();
  if (frames.length > 1) measured.fps = (1000 * (frames.length - 1)) / (time - frames[0]);
  const sorted = [...measured.delays].sort((a, b) => a - b);
  [measured.delayMs, measured.mostMs] = [0.5, 0.9].map((share) => (sorted.length ? sorted[Math.floor(share * sorted.length)] : null));
}

// Moves the hand until a time [ms], and sends its position, if the last one was sent some time before [ms]; for every event, and for
// every frame, because the hand moves without an event too.
function moveHand(time, sinceMs) {
  if (!settings || (lastMs !== null && time - lastMs < sinceMs)) return;
  const seconds = lastMs === null ? 0 : Math.min((time - lastMs) / 1000, 0.1);
  lastMs = time;
  const event = hand.update(time, seconds);
  send({ type: 'hand', t: time, x: hand.position[0], y: hand.position[1], event });
}

function sendScene() {
  if (isSceneChanged) send({ type: 'scene', ...arranging.scene });
  isSceneChanged = false;
}

let shownMs = 0;
let shownLetters = '';
function frame(time) {
  requestAnimationFrame(frame);
  if (!settings) return;
  moveHand(time, FRAME_MS);
  sendScene();
  if (time - predictedMs > OLD_MS) view.candidates = [];
  const silentS = Math.floor((time - heardMs) / 1000); // the server tells its state twice a second
  if (silentS > 0 && socket.readyState === WebSocket.OPEN) showStatus('failing', `no answer from the server for ${silentS} s`);
  [view.scene, view.selected] = [arranging.scene, arranging.selected];
  draw(time);
  measure(time);
  // four times a second, or at once where the scene has other letters
  const letters = view.candidates.filter(({ likelihood }) => likelihood >= NOTED).map(({ slot }) => slot).sort().join();
  if (letters !== shownLetters || time - shownMs > 250) {
    [shownMs, shownLetters] = [time, letters];
    showWays();
    showJob();
    const [delayMs, mostMs] = [measured.delayMs, measured.mostMs].map(Math.round);
    const delay = measured.delayMs === null ? '' : `, ${delayMs} ms from your hand to the drawn prediction (median; nine in ten within ${mostMs} ms)`;
    byId('numbers').textContent = `${Math.round(measured.fps)} frames a second${delay}`;
  }
}

byId('arrange').addEventListener('change', ({ target }) => setArranging(target.checked));
canvas.addEventListener('keydown', ({ key }) => {
  if (key.toLowerCase() === 'e' && !byId('arrange').disabled) setArranging(!arranging.enabled);
});
for (const [name, key] of Object.entries({ 'add-circle': 'c', 'add-box': 'b', 'add-goal': 'g', larger: '+', smaller: '-', turn: 'r', remove: 'Delete' })) {
  byId(name).addEventListener('click', () => arranging.actionOf(key)());
}
byId('shuffle').addEventListener('click', () => send({ type: 'shuffle', seed: Math.floor(2 ** 31 * Math.random()) }));
byId('restore').addEventListener('click', () => play.setScene(structuredClone(settings.first_scene)));
byId('guidance').addEventListener('change', ({ target }) => send({ type: 'guidance', on: target.checked }));
byId('parameters').addEventListener('change', ({ target }) => send({ type: 'parameters', name: target.value }));
byId('record').addEventListener('click', ({ target }) => send({ type: 'record', on: target.dataset.on !== 'true' }));
byId('begin').addEventListener('click', () => {
  sendScene(); // the server takes none during tasks
  send(task.phase !== 'none' ? { type: 'stop' } : {
    type: 'tasks', trials: Number(byId('trials').value), seed: Number(byId('seed').value), assistance: byId('assistance').value,
    blinded: byId('blinded').checked, shuffled: byId('shuffled').checked,
  });
  canvas.focus();
});
// What was chosen for the tasks survives a reload of the page, as what the server knows does.
for (const name of ['trials', 'seed', 'assistance', 'blinded', 'shuffled']) {
  const [field, kept] = [byId(name), sessionStorage.getItem(name)];
  const part = field.type === 'checkbox' ? 'checked' : 'value';
  if (kept !== null) field[part] = JSON.parse(kept);
  field.addEventListener('input', () => sessionStorage.setItem(name, JSON.stringify(field[part])));
}
for (const name of ['report', 'fit', 'compare']) byId(name).addEventListener('click', () => send({ type: 'job', name }));
byId('cancel').addEventListener('click', () => send({ type: 'cancel' }));
addEventListener('resize', () => settings && scene.resize());
writeLegend(byId('signs'), ['hand', 'pointer', 'force', 'path', 'unlikely', 'compromised', 'ghost', 'motor', 'total', 'obstacle', 'goal', 'lit']);
connect();
requestAnimationFrame(frame);
