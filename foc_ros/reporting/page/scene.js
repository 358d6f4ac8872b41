// SPDX-FileCopyrightText: 2026 the foc_ros developers
// SPDX-License-Identifier: Apache-2.0
// The drawing of a scene on a canvas, for reports and for `play`. One line style means one thing: a solid line is a path, dotted one
// that is not known to avoid the obstacles as surely as wanted, dashed a total uncertainty; a pale wide line is a ghost, which is no proper prediction.
'use strict';
const FULL = 2 * Math.PI;
const COLOURS = ['#0072B2', '#D55E00', '#009E73', '#CC79A7', '#E69F00', '#56B4E9', '#7E57C2', '#8B5A2B', '#C2185B', '#8BC34A'];
const LIT = '#E69F00';
const FORCE = { ink: '--ink', width: 4 };
const letterOf = (slot) => (slot === null || slot === undefined ? '' : String.fromCharCode(65 + slot));
const colourOf = (slot) => (slot === null || slot === undefined ? ink('--soft') : COLOURS[slot]);
const percent = (share) => (share === null ? '' : share < 0.0005 ? '< 0.1 %' : `${(100 * share).toFixed(share < 0.0095 ? 1 : 0)} %`);
// Likelihood below which a path has no letter, colour or words: those of paths that hardly anybody takes would cover the others.
const NOTED = 0.01;
const PALE = 0.25; // a ghost
// Lengths come as whole tenths of a millimetre, and a list of them as the first value and then the differences.
const LENGTH = 1e-4;
const sums = (steps, unit) => { let sum = 0; return steps.map((step) => unit * (sum += step)); };
const decodePath = ({ x, y }) => { const ys = sums(y, LENGTH); return sums(x, LENGTH).map((value, row) => [value, ys[row]]); };
const decodeEllipses = (list = []) => list.map(([x, y, a, b, angle]) => [LENGTH * x, LENGTH * y, LENGTH * a, LENGTH * b, (Math.PI * angle) / 180]);
// Takes and returns the first of places that is at a distance from all that are taken, undefined where none has room.
function takePlace(places, taken, distance) {
  const found = places.find(([x, y]) => taken.every(([u, v]) => Math.hypot(x - u, y - v) >= distance));
  if (found) taken.push(found);
  return found;
}

class Scene {
  // Attributes: paths, what was drawn since `begin`: points [m], text, kind and width of each path, for texts under the pointer; goals: their
  // names, which are written upon paths; letters, words: where they are [m], of words several places.
  constructor(canvas) {
    this.canvas = canvas;
    this.pen = canvas.getContext('2d');
    [this.paths, this.goals, this.words, this.letters] = [[], [], [], []];
    this.entered = new Set(); // what was written of obstacles that paths lead through
  }

  // Shows at least what is within limits of x, then of y [m].
  fit(bounds) {
    this.bounds = bounds;
    this.resize();
  }

  // Fits the scene to the present size of the canvas; lengths are metres, with the second axis up.
  resize() {
    const [low, high, bottom, top] = this.bounds;
    const { canvas } = this;
    this.pixel = window.devicePixelRatio || 1;
    canvas.width = Math.round(canvas.clientWidth * this.pixel);
    canvas.height = Math.round(canvas.clientHeight * this.pixel);
    this.scale = Math.min(canvas.width / (high - low), canvas.height / (top - bottom));
    this.origin = [canvas.width / 2 - (this.scale * (low + high)) / 2, canvas.height / 2 + (this.scale * (bottom + top)) / 2];
    this.unit = this.pixel / this.scale;
  }

  // Returns the position [m] of a pointer event.
  toScene(event) {
    const box = this.canvas.getBoundingClientRect();
    return [
      ((event.clientX - box.left - this.canvas.clientLeft) * this.pixel - this.origin[0]) / this.scale,
      (this.origin[1] - (event.clientY - box.top - this.canvas.clientTop) * this.pixel) / this.scale,
    ];
  }

  begin() {
    const { pen, scale, origin } = this;
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
    pen.setTransform(scale, 0, 0, -scale, origin[0], origin[1]);
    pen.lineJoin = 'round';
    [this.paths, this.goals, this.words, this.entered] = [[], [], [], new Set()];
  }

  stroke(colour, width, dash = [], alpha = 1) {
    const { pen } = this;
    pen.globalAlpha = alpha;
    [pen.strokeStyle, pen.lineWidth] = [colour, width * this.unit];
    pen.setLineDash(dash.map((each) => each * this.unit));
    pen.stroke();
    pen.globalAlpha = 1;
  }

  fill(colour, alpha = 1) {
    [this.pen.globalAlpha, this.pen.fillStyle] = [alpha, colour];
    this.pen.fill();
    this.pen.globalAlpha = 1;
  }

  text(words, [x, y], colour, { size = 12, up = 0, halo = false, align = 'center' } = {}) {
    const { pen, origin, scale, pixel } = this;
    pen.save();
    pen.setTransform(1, 0, 0, 1, origin[0] + scale * x, origin[1] - scale * y - up * pixel);
    pen.font = `${size * pixel}px system-ui, sans-serif`;
    [pen.textAlign, pen.textBaseline] = [align, 'middle'];
    if (halo) {
      [pen.strokeStyle, pen.lineWidth] = [ink('--page'), 4 * pixel];
      pen.setLineDash([]);
      pen.strokeText(words, 0, 0);
    }
    pen.fillStyle = colour;
    pen.fillText(words, 0, 0);
    const { width } = pen.measureText(words);
    pen.restore();
    for (let along = 0; halo && along < width / scale; along += 9 * this.unit) this.words.push([x - width / scale / 2 + along, y + up * this.unit]);
  }

  trace(points) {
    this.pen.beginPath();
    points.forEach(([x, y], row) => (row ? this.pen.lineTo(x, y) : this.pen.moveTo(x, y)));
  }

  line(points, colour, width) {
    this.trace(points);
    this.stroke(colour, width);
  }

  disc([x, y], radius, colour, { filled = 0, width = 2 } = {}) {
    this.pen.beginPath();
    this.pen.arc(x, y, radius, 0, FULL);
    if (filled) this.fill(colour, filled);
    if (width) this.stroke(colour, width);
  }

  // Draws an obstacle: name, x, y, radius, stddev of the radius [m], and corners from its centre, none for a circle.
  obstacle({ name, x, y, radius, stddev, corners }, isSelected = false) {
    const { pen } = this;
    for (const [grown, colour] of [[radius + stddev, ink('--ring')], [radius, ink('--disc')]]) {
      const around = corners.length ? corners : [[0, 0]];
      const after = (row) => around[(row + 1) % around.length];
      const normals = around.map(([u, v], row) => Math.atan2(u - after(row)[0], after(row)[1] - v));
      pen.beginPath();
      around.forEach(([u, v], row) => {
        const from = corners.length ? normals[(row + around.length - 1) % around.length] : 0;
        const turn = corners.length ? (((normals[row] - from) % FULL) + FULL) % FULL : FULL;
        pen.arc(x + u, y + v, grown, from, from + turn);
      });
      pen.closePath();
      this.fill(colour);
      this.stroke(isSelected ? COLOURS[0] : ink('--soft'), isSelected ? 3 : 1);
    }
    if (name) this.text(name, [x, y], ink('--ink'), { size: 11 });
  }

  // Draws a candidate: slot, likelihood, path [m], motor and total: ellipses [x, y, half axes, angle]; ghost: why it is none, or '', and
  // ghost_at: the share of the path at which that is. place: share of the path for words that are of no such place.
  candidate({ slot, likelihood, path, motor, total, compromised, ghost, ghost_at: ghostAt, text }, alpha = 1, place = 0.5) {
    const [wide, least] = (likelihood ?? 1) < NOTED ? [2, 0.8] : [6, 1.5];
    const [colour, width] = [colourOf(slot), ghost ? wide : least + 4.5 * (likelihood ?? 0)];
    this.paths.push({ points: path, text, width, kind: ghost ? 'ghost' : 'path' });
    if (ghost) {
      this.trace(path);
      this.stroke(ink('--soft'), width, [], PALE * alpha);
      const [x, y] = path[Math.round((path.length - 1) * (ghostAt ?? place))];
      // Words of one obstacle would cover each other.
      if (!this.entered.has(ghost)) this.text(ghost, [x, y], ink('--soft'), { size: 11, up: 14, halo: true });
      if (typeof ghostAt === 'number') this.entered.add(ghost);
      return;
    }
    this.ellipses(motor);
    this.fill(colour, alpha * (0.2 + 0.2 * likelihood)); // once, so that an obstacle is seen under many
    this.stroke(colour, 0.8, [], 0.8 * alpha);
    this.ellipses(total);
    this.stroke(colour, 1, [5, 4], alpha);
    this.trace(path);
    this.stroke(colour, width, compromised ? [1.2 * width, 1.5 * width] : [], alpha);
  }

  ellipses(list) {
    this.pen.beginPath();
    for (const [x, y, a, b, angle] of list) {
      this.pen.moveTo(x + a * Math.cos(angle), y + a * Math.sin(angle));
      this.pen.ellipse(x, y, a, b, angle, 0, FULL);
    }
  }

  // Draws candidates, the most likely last, and upon them the names of goals and letters, those of the most likely first, where there is
  // room; alphaOf: of each.
  candidates(list, alphaOf = () => 1) {
    list.filter(({ ghost }) => ghost).forEach((each, row) => this.candidate(each, alphaOf(each), 0.5 + 0.15 * (row % 3)));
    const paths = list.filter(({ ghost }) => !ghost);
    [...paths].reverse().forEach((each) => this.candidate(each, alphaOf(each)));
    this.goals.forEach(({ name, place, up }) => this.text(name, place, ink('--ink'), { size: 11, up, halo: true }));
    const taken = [...this.words];
    const isFree = ([x, y]) => this.goals.every(({ place: [u, v], radius }) => Math.hypot(x - u, y - v) > radius + 10 * this.unit);
    for (const each of paths.filter(({ likelihood, slot }) => likelihood >= NOTED && letterOf(slot))) {
      const { slot, path } = each;
      const shares = Array.from({ length: 10 }, (_, row) => 0.3 + 0.05 * ((3 + 2 * slot + row) % 10));
      const places = shares.map((share) => path[Math.round((path.length - 1) * share)]);
      // A hand at its goal leaves no room upon the path.
      const beside = each === paths[0] ? [30, -30].flatMap((up) => places.map(([x, y]) => [x, y + up * this.unit])) : [];
      const at = takePlace([...places, ...beside].filter(isFree), taken, 20 * this.unit);
      if (!at) continue;
      this.disc(at, 9 * this.unit, ink('--page'), { filled: 1, width: 0 });
      this.disc(at, 9 * this.unit, colourOf(slot));
      this.text(letterOf(slot), at, ink('--ink'));
    }
    this.letters = taken.slice(this.words.length);
  }

  goal(place, row, { lit = false, selected = false, radius = 0.009 } = {}) {
    this.disc(place, radius, lit ? LIT : ink('--ink'), { filled: lit ? 0.5 : 0, width: 1.5 });
    if (selected) this.disc(place, 1.3 * radius, COLOURS[0]);
    this.text(lit ? '★' : '☆', place, ink('--ink'), { size: 13 });
    this.goals.push({ name: `goal${row}`, place, radius, up: radius / this.unit + 8 });
  }

  // Draws lines at round lengths with their lengths [m] at the border.
  grid() {
    const { unit } = this;
    const step = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5].find((each) => each > 60 * unit) || 10;
    const places = (from, to) => Array.from({ length: Math.max(0, Math.floor(to / step) - Math.ceil(from / step) + 1) }, (_, row) => step * (Math.ceil(from / step) + row));
    const [left, base] = [-this.origin[0] / this.scale, (this.origin[1] - this.canvas.height) / this.scale];
    const [right, ceiling] = [left + this.canvas.width / this.scale, base + this.canvas.height / this.scale];
    const digits = step < 0.1 ? 2 : 1;
    for (const x of places(left, right)) {
      this.line([[x, base], [x, ceiling]], ink('--line'), 0.6);
      if (x < right - 70 * unit) this.text(x.toFixed(digits), [x, base], ink('--soft'), { size: 10, up: 8 });
    }
    for (const y of places(base, ceiling)) {
      this.line([[left, y], [right, y]], ink('--line'), 0.6);
      this.text(y.toFixed(digits), [left + 4 * unit, y], ink('--soft'), { size: 10, up: 6, align: 'left' });
    }
    this.text('x, y [m]', [right - 6 * unit, base], ink('--soft'), { size: 10, up: 8, align: 'right' });
  }

  // Returns the text of the path under a position [m], or ''.
  find([x, y]) {
    const far = ([u, v], [p, q]) => {
      const share = clamp(((x - u) * (p - u) + (y - v) * (q - v)) / Math.max((p - u) ** 2 + (q - v) ** 2, 1e-12), 0, 1);
      return Math.hypot(x - u - share * (p - u), y - v - share * (q - v));
    };
    const found = this.paths.filter(({ points, width }) => points.some((point, row) => row && far(points[row - 1], point) < (4 + width / 2) * this.unit));
    return found.length ? found[found.length - 1].text : '';
  }
}

// Returns the letter of a candidate and a bar as long as its likelihood, both as its path is drawn, for a row of a table.
function makeSigns({ slot, likelihood, ghost, compromised }) {
  const [letter, bar, filling] = ['span', 'span', 'i'].map((tag) => document.createElement(tag));
  const [colour, alpha] = ghost ? [ink('--soft'), PALE] : [colourOf(slot), 1];
  [letter.className, letter.textContent, letter.style.borderColor] = ['letter', letterOf(slot), colour];
  [bar.className, filling.className] = ['bar', compromised && !ghost ? 'dotted' : ''];
  [filling.style.width, filling.style.backgroundColor, filling.style.opacity] = [`${100 * likelihood}%`, colour, alpha];
  bar.append(filling);
  return [letter, bar];
}

// Writes what the signs of a scene mean; names: the signs that are used.
const SIGNS = {
  hand: ['<circle cx="14" cy="7" r="4" fill="var(--ink)"/>', 'hand'],
  pointer: ['<circle cx="14" cy="7" r="4" fill="none" stroke="var(--soft)"/>', 'your pointer, which the hand follows; guidance pulls it away'],
  force: [`<path d="M4 7H24" stroke="var(${FORCE.ink})" stroke-width="${FORCE.width}"/>`, 'force of guidance'],
  past: ['<path d="M2 7H26" stroke="var(--ink)" stroke-width="3"/>', 'hand before'],
  later: ['<path d="M2 7H26" stroke="var(--soft)" stroke-width="1.5"/>', 'hand later, which was not known to the prediction'],
  path: ['<path d="M2 7H26" stroke="#0072B2" stroke-width="4"/>', 'predicted path, the thicker the more likely'],
  unlikely: ['<path d="M2 7H26" stroke="var(--soft)" stroke-width="0.8"/>', 'thin and grey, without a letter: less likely than 1 %'],
  compromised: ['<path d="M2 7H26" stroke="#0072B2" stroke-width="3" stroke-dasharray="3 4"/>', 'dotted: not known to avoid the obstacles as surely as wanted'],
  ghost: ['<path d="M2 7H26" stroke="var(--soft)" stroke-width="7" opacity=".3"/>', 'pale: no proper prediction, for the reason beside it'],
  motor: ['<ellipse cx="14" cy="7" rx="11" ry="5" fill="#0072B2" fill-opacity=".3" stroke="#0072B2"/>', 'motor noise, which η is about: one standard deviation; of finished paths with at least 5 %'],
  total: ['<ellipse cx="14" cy="7" rx="11" ry="5" fill="none" stroke="#0072B2" stroke-dasharray="4 3"/>', 'all uncertainty of the most likely path, likewise'],
  obstacle: ['<circle cx="14" cy="7" r="6.5" fill="var(--ring)"/><circle cx="14" cy="7" r="5" fill="var(--disc)" stroke="var(--soft)"/>', 'obstacle; ring: standard deviation of its radius'],
  goal: ['<circle cx="14" cy="7" r="6" fill="none" stroke="var(--ink)"/><text x="14" y="10.5" font-size="9" text-anchor="middle" fill="var(--ink)">☆</text>', 'goal'],
  lit: [`<circle cx="14" cy="7" r="6" fill="${LIT}" fill-opacity=".5" stroke="${LIT}"/><text x="14" y="10.5" font-size="9" text-anchor="middle" fill="var(--ink)">★</text>`, 'goal to reach'],
};
function writeLegend(box, names) {
  box.innerHTML = names.map((name) => `<span><svg viewBox="0 0 28 14" aria-hidden="true">${SIGNS[name][0]}</svg> ${SIGNS[name][1]}</span>`).join('');
}
