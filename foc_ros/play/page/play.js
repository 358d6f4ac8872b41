// The page: one connection to the server, one frame after the other, and the controls.
import { Arranging } from './arranging.js';
import { Drawing, letterOf } from './drawing.js';
import { Hand } from './hand.js';

const byId = (name) => document.getElementById(name);
const RETRY_MS = 1000;
// Time over which frames are counted [ms], and the number of delays of which the median is shown.
const COUNTED_MS = 2000;
const DELAYS = 200;
// Time since the last position that was sent [ms] after which an event or a frame sends one.
const EVENT_MS = 6;
const FRAME_MS = 12;
const TASK_WORDS = {
  none: '', return: 'Go to the green start and rest there.', wait: 'Rest at the start until a goal is lit.', reach: 'Reach the lit goal, and stay there.',
  over: '',
};

const canvas = byId('scene');
const drawing = new Drawing(canvas);
const toScene = (event) => drawing.toScene(event);
const hand = new Hand(canvas, toScene, (time) => moveHand(time, EVENT_MS));
let isSceneChanged = false;
const arranging = new Arranging(canvas, toScene, () => { isSceneChanged = true; });
const view = { scene: arranging.scene, selected: null, goal: null, phase: 'none', candidates: [], hand, hidden: false, touchedMs: -Infinity };
// What the page measures: frames per second, the median time from an input to the drawn prediction that was made from it [ms], and
// how many predictions were drawn.
const measured = { fps: 0, delayMs: null, predictions: 0, delays: [] };
// For scripts: what is drawn, what is measured, and a new scene in place of the present one.
globalThis.play = {
  view,
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
let task = { phase: 'none' };
let job = null;

const send = (message) => {
  if (socket && socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
};

function showStatus(isAlive, text) {
  const box = byId('status');
  if (box.textContent !== text) box.textContent = text;
  box.classList.toggle('gone', !isAlive);
  if (!isAlive) view.candidates = [];
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
    for (const each of [hand, arranging, drawing]) each.configure(message);
    byId('status').dataset.predictor = message.predictor;
  },
  replaced() {
    isReplaced = true;
    socket.close();
    showStatus(false, 'Another page has taken over. Load this page again to take it back.');
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
    for (const name of ['report', 'fit', 'compare']) byId(name).disabled = message.recording || !message.session;
    byId('compare').disabled ||= !message.fitted;
    if (message.session) byId('session').textContent = `${message.recording ? 'Recording' : 'Recorded'} to ${message.session}`;
  },
  status({ alive, text }) {
    showStatus(alive, `${byId('status').dataset.predictor}: ${text}`);
  },
  prediction({ event, candidates }) {
    view.candidates = candidates;
    measured.predictions += 1;
    if (event !== null) waitingEvents.push(event);
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
    byId('begin').textContent = isRunning ? 'end' : 'begin';
    for (const name of ['arrange', 'shuffle', 'restore', 'guidance', 'record', 'parameters']) byId(name).disabled = isRunning;
    if (isRunning) setArranging(false);
    nameRecordButton();
    byId('task').textContent = isRunning ? `${message.trial} of ${message.trials}: ${TASK_WORDS[message.phase]}` : '';
  },
  score({ columns, rows }) {
    byId('score').replaceChildren(rows.length ? makeTable(columns, rows) : 'No trial was finished.');
  },
  job({ name, state, text, columns, rows, seconds }) {
    job = state === 'running' ? { name, begunMs: performance.now() } : null;
    showJob();
    if (!job) byId('job').textContent = `${name}: ${text}${seconds ? ` (${seconds} s)` : ''}`;
    if (name === 'report') byId('download').hidden = state !== 'done';
    if (columns) byId('result').replaceChildren(makeTable(columns, rows));
  },
  error({ text }) {
    byId('job').textContent = `refused: ${text}`;
  },
};

// Tasks end the recording that belongs to them.
function nameRecordButton() {
  byId('record').textContent = byId('record').dataset.on === 'true' && task.phase === 'none' ? 'end the recording' : 'record without tasks';
}

// Says that a job is running, and every 10 s for how long.
function showJob() {
  if (!job) return;
  const seconds = 10 * Math.floor((performance.now() - job.begunMs) / 10_000);
  const time = seconds ? ` for ${seconds} s` : job.name === 'report' ? '' : ', for some minutes';
  const text = `${job.name}: working${time}; you can go on playing`;
  if (byId('job').textContent !== text) byId('job').textContent = text;
}

function connect() {
  socket = new WebSocket(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/socket`);
  socket.addEventListener('message', ({ data }) => {
    const message = JSON.parse(data);
    handlers[message.type](message);
  });
  socket.addEventListener('close', () => {
    if (isReplaced) return;
    showStatus(false, 'The server is gone; trying again.');
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
// Writes the table of candidates if it has changed.
function showWays() {
  const rows = view.hidden ? [] : view.candidates.map((each) => [letterOf(each.slot), each.likelihood, `goal ${each.goal}`]);
  const key = JSON.stringify(rows.map(([letter, likelihood, goal]) => [letter, Math.round(100 * likelihood), goal]));
  if (key === shownWays) return;
  shownWays = key;
  byId('ways').tBodies[0].replaceChildren(...rows.map(([letter, likelihood, goal]) => {
    const line = document.createElement('tr');
    const meter = document.createElement('meter');
    [meter.value, meter.ariaLabel] = [likelihood, 'likelihood'];
    for (const content of [letter, meter, `${Math.round(100 * likelihood)} %`, goal]) {
      line.insertCell().append(content);
    }
    return line;
  }));
}

function measure(time) {
  const now = performance.now();
  measured.delays.push(...waitingEvents.map((event) => now - event));
  measured.delays.splice(0, Math.max(measured.delays.length - DELAYS, 0));
  waitingEvents = [];
  frames.push(time);
  while (frames[0] < time - COUNTED_MS) frames.shift();
  if (frames.length > 1) measured.fps = (1000 * (frames.length - 1)) / (time - frames[0]);
  const sorted = [...measured.delays].sort((a, b) => a - b);
  measured.delayMs = sorted.length ? sorted[Math.floor(sorted.length / 2)] : null;
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

let shownMs = 0;
function frame(time) {
  requestAnimationFrame(frame);
  if (!settings) return;
  moveHand(time, FRAME_MS);
  if (isSceneChanged) {
    send({ type: 'scene', ...arranging.scene });
    isSceneChanged = false;
  }
  [view.scene, view.selected] = [arranging.scene, arranging.selected];
  drawing.draw(view, time);
  measure(time);
  if (time - shownMs > 250) {
    shownMs = time;
    showWays();
    showJob();
    const delay = measured.delayMs === null ? '' : `, ${Math.round(measured.delayMs)} ms from your hand to the drawn prediction`;
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
  send(task.phase !== 'none' ? { type: 'stop' } : {
    type: 'tasks', trials: Number(byId('trials').value), seed: Number(byId('seed').value), assistance: byId('assistance').value,
    blinded: byId('blinded').checked, shuffled: byId('shuffled').checked,
  });
  canvas.focus();
});
for (const name of ['report', 'fit', 'compare']) byId(name).addEventListener('click', () => send({ type: 'job', name }));
addEventListener('resize', () => settings && drawing.resize());
redraws.push(() => drawing.readColours()); // of frame.js, which switches between dark and light
connect();
requestAnimationFrame(frame);
