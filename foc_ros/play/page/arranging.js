// SPDX-FileCopyrightText: 2026 the foc_ros developers
// SPDX-License-Identifier: Apache-2.0
// Arranging the scene: obstacles and goals are dragged, added, resized, turned and removed, by pointer or keys.
const STEP = 0.005;
const TURN = Math.PI / 12;
const GROW = 1.15;
const SIZES = [0.004, 0.2];
const REACH = 0.012;
// Distances of the middle of a new object from others [m], of which the first that is possible counts.
const ROOMS = [0.05, 0.03, 0.01];

const round = (value) => Math.round(value * 1e5) / 1e5;

export class Arranging {
  // changed: called after every change of the scene; refused: called with the reason for which one is impossible.
  constructor(canvas, toScene, changed, refused) {
    this.scene = { obstacles: [], goals: [] };
    this.selected = null;
    this.enabled = false;
    [this.changed, this.refused] = [changed, refused];
    this.canvas = canvas;
    this.grip = null;
    canvas.addEventListener('pointerdown', (event) => {
      if (!this.enabled) return;
      const at = toScene(event);
      this.selected = this.find(at);
      this.grip = this.selected && [this.selected.x - at[0], this.selected.y - at[1]];
      if (this.grip) canvas.setPointerCapture(event.pointerId);
    });
    canvas.addEventListener('pointermove', (event) => {
      if (!this.enabled || !this.grip) return;
      const at = toScene(event);
      this.moveTo(at[0] + this.grip[0], at[1] + this.grip[1]);
    });
    for (const name of ['pointerup', 'pointercancel']) {
      canvas.addEventListener(name, () => { this.grip = null; });
    }
    canvas.addEventListener('keydown', (event) => {
      const act = this.enabled && !event.ctrlKey && !event.metaKey && !event.altKey && this.actionOf(event.key);
      if (act) {
        event.preventDefault();
        act();
      }
    });
  }

  configure({ bounds, most }) {
    [this.bounds, this.most] = [bounds, most];
  }

  setScene(scene) {
    [this.scene, this.selected, this.grip] = [scene, null, null];
  }

  // Returns what a key does, if it does anything.
  actionOf(key) {
    const actions = {
      c: () => this.addCircle(), b: () => this.addBox(), g: () => this.addGoal(), n: () => this.selectNext(), r: () => this.turn(),
      Delete: () => this.remove(), Backspace: () => this.remove(), '+': () => this.resize(GROW), '-': () => this.resize(1 / GROW),
      ArrowLeft: () => this.shift(-STEP, 0), ArrowRight: () => this.shift(STEP, 0), ArrowUp: () => this.shift(0, STEP), ArrowDown: () => this.shift(0, -STEP),
    };
    return actions[key.length === 1 ? key.toLowerCase() : key];
  }

  // Returns the object at a point: the nearest goal or obstacle that contains it, or nearly does, within a distance [m].
  find(at, reach = REACH) {
    const distance = (each) => {
      const [x, y] = [at[0] - each.x, at[1] - each.y];
      if (each.kind !== 'box') return Math.hypot(x, y) - (each.radius || 0);
      const [c, s] = [Math.cos(each.yaw), Math.sin(each.yaw)];
      const [u, v] = [Math.abs(x * c + y * s) - each.size_x / 2, Math.abs(-x * s + y * c) - each.size_y / 2];
      return u > 0 && v > 0 ? Math.hypot(u, v) : Math.max(u, v);
    };
    const found = [...this.scene.goals, ...this.scene.obstacles].map((each) => [distance(each), each]).filter(([far]) => far < reach);
    return found.length ? found.reduce((best, each) => (each[0] < best[0] ? each : best))[1] : null;
  }

  addCircle() { this.add('obstacles', { kind: 'circle', ...this.findRoom(), radius: 0.02 }); }

  addBox() { this.add('obstacles', { kind: 'box', ...this.findRoom(), size_x: 0.05, size_y: 0.02, yaw: 0 }); }

  addGoal() { this.add('goals', this.findRoom()); }

  // Returns the place with room for a new object, or else with some room, that is the nearest to the middle.
  findRoom() {
    const [low, high, bottom, top] = this.bounds;
    const places = [];
    for (let x = low + ROOMS[0]; x < high - ROOMS[0]; x += STEP) for (let y = bottom + ROOMS[0]; y < top - ROOMS[0]; y += STEP) places.push([x, y]);
    const distance = ([x, y]) => Math.hypot(x - (low + high) / 2, y - (bottom + top) / 2);
    places.sort((a, b) => distance(a) - distance(b));
    const [x, y] = ROOMS.map((room) => places.find((at) => !this.find(at, room))).find((at) => at) || places[0];
    return { x: round(x), y: round(y) };
  }

  add(name, object) {
    if (this.scene[name].length >= this.most[name]) {
      this.refused(`${name}: expected at most ${this.most[name]}`);
      return;
    }
    this.scene[name].push(object);
    this.selected = object;
    this.changed();
  }

  remove() {
    if (!this.selected) return;
    const isGoal = this.scene.goals.includes(this.selected);
    if (isGoal && this.scene.goals.length === 1) {
      this.refused('goals: expected at least 1');
      return;
    }
    const name = isGoal ? 'goals' : 'obstacles';
    this.scene[name] = this.scene[name].filter((each) => each !== this.selected);
    this.selected = null;
    this.changed();
  }

  selectNext() {
    const all = [...this.scene.obstacles, ...this.scene.goals];
    this.selected = all[(all.indexOf(this.selected) + 1) % all.length];
  }

  moveTo(x, y) {
    if (!this.selected) return;
    this.selected.x = round(clamp(x, this.bounds[0], this.bounds[1]));
    this.selected.y = round(clamp(y, this.bounds[2], this.bounds[3]));
    this.changed();
  }

  shift(x, y) { if (this.selected) this.moveTo(this.selected.x + x, this.selected.y + y); }

  resize(factor) {
    if (!this.selected) return;
    for (const name of ['radius', 'size_x', 'size_y']) {
      if (name in this.selected) this.selected[name] = round(clamp(this.selected[name] * factor, ...SIZES));
    }
    this.changed();
  }

  turn() {
    if (!this.selected || !('yaw' in this.selected)) return;
    const yaw = this.selected.yaw + TURN;
    this.selected.yaw = round(yaw > Math.PI / 2 ? yaw - Math.PI : yaw);
    this.changed();
  }
}
