// Drawing of the scene on the canvas, with the colours of the page and of the reports.
const FULL = 2 * Math.PI;
const METRES_PER_NEWTON = 0.02;
const HAND_RADIUS = 0.006;

export const letterOf = (slot) => (slot === null ? '' : String.fromCharCode(65 + slot));

export class Drawing {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext('2d');
    this.ink = {};
    this.readColours();
  }

  configure(settings) {
    this.settings = settings;
    this.resize();
  }

  // Reads the colours of the page; to be called after a switch between dark and light.
  readColours() {
    const style = getComputedStyle(document.documentElement);
    for (const name of ['page', 'ink', 'soft', 'line', 'disc', 'ring']) this.ink[name] = style.getPropertyValue(`--${name}`).trim();
  }

  // Fits the canvas to its place on the page.
  resize() {
    const [low, high, bottom, top] = this.settings.bounds;
    const ratio = window.devicePixelRatio || 1;
    this.canvas.width = Math.round(this.canvas.clientWidth * ratio);
    this.canvas.height = Math.round(this.canvas.clientHeight * ratio);
    this.scale = Math.min(this.canvas.width / (high - low), this.canvas.height / (top - bottom));
    this.origin = [this.canvas.width / 2 - (this.scale * (low + high)) / 2, this.canvas.height / 2 + (this.scale * (bottom + top)) / 2];
    this.pixel = ratio;
  }

  // Returns the position [m] of a pointer event.
  toScene(event) {
    const box = this.canvas.getBoundingClientRect();
    return [
      ((event.clientX - box.left - this.canvas.clientLeft) * this.pixel - this.origin[0]) / this.scale,
      (this.origin[1] - (event.clientY - box.top - this.canvas.clientTop) * this.pixel) / this.scale,
    ];
  }

  colourOf(slot) {
    const { colours } = this.settings;
    return slot === null ? this.ink.soft : colours[slot % colours.length];
  }

  // view: scene, selected, goal (the row that is lit, or null), phase, candidates, hand (a Hand), hidden (whether predictions are), touchedMs.
  draw(view, now) {
    const { context: pen, ink, scale, origin, pixel } = this;
    pen.setTransform(1, 0, 0, 1, 0, 0);
    pen.clearRect(0, 0, this.canvas.width, this.canvas.height);
    // lengths are metres from here on, with the second axis up
    pen.setTransform(scale, 0, 0, -scale, origin[0], origin[1]);
    this.line = pixel / scale;
    pen.lineJoin = 'round';
    if (view.phase !== 'none') this.drawDisc(this.settings.start, this.settings.target_radius, view.phase === 'reach' ? null : '#009E73');
    for (const each of view.scene.obstacles) this.drawObstacle(each, each === view.selected);
    view.scene.goals.forEach((goal, row) => this.drawGoal(goal, row, view));
    if (!view.hidden) {
      for (const each of [...view.candidates].reverse()) this.drawCandidate(each);
    }
    this.drawHand(view, now);
  }

  stroke(colour, width, dash = []) {
    const { context: pen, line } = this;
    pen.strokeStyle = colour;
    pen.lineWidth = width * line;
    pen.setLineDash(dash.map((each) => each * line));
    pen.stroke();
  }

  fill(colour, alpha = 1) {
    const { context: pen } = this;
    pen.globalAlpha = alpha;
    pen.fillStyle = colour;
    pen.fill();
    pen.globalAlpha = 1;
  }

  text(words, x, y, colour) {
    const { context: pen, origin, scale, pixel } = this;
    pen.save();
    pen.setTransform(1, 0, 0, 1, origin[0] + scale * x, origin[1] - scale * y);
    pen.font = `${12 * pixel}px system-ui, sans-serif`;
    [pen.textAlign, pen.textBaseline, pen.fillStyle] = ['center', 'middle', colour];
    pen.fillText(words, 0, 0);
    pen.restore();
  }

  drawDisc([x, y], radius, lit) {
    const { context: pen, ink } = this;
    pen.beginPath();
    pen.arc(x, y, radius, 0, FULL);
    if (lit) this.fill(lit, 0.5);
    this.stroke(lit || ink.soft, 2);
  }

  drawObstacle(obstacle, isSelected) {
    const { context: pen, ink } = this;
    for (const [grow, colour] of [[this.settings.radius_stddev, ink.ring], [0, ink.disc]]) {
      pen.beginPath();
      if (obstacle.kind === 'circle') {
        pen.arc(obstacle.x, obstacle.y, obstacle.radius + grow, 0, FULL);
      } else {
        const [width, height] = [obstacle.size_x + 2 * grow, obstacle.size_y + 2 * grow];
        pen.save();
        pen.translate(obstacle.x, obstacle.y);
        pen.rotate(obstacle.yaw);
        pen.roundRect(-width / 2, -height / 2, width, height, grow);
        pen.restore();
      }
      this.fill(colour);
      this.stroke(isSelected ? '#0072B2' : ink.soft, isSelected ? 3 : 1);
    }
  }

  drawGoal(goal, row, view) {
    const isLit = view.goal === row;
    this.drawDisc([goal.x, goal.y], this.settings.target_radius, isLit ? '#E69F00' : null);
    if (goal === view.selected) this.drawDisc([goal.x, goal.y], 1.3 * this.settings.target_radius, null);
    this.text(isLit ? '★' : `${row}`, goal.x, goal.y, this.ink.ink);
  }

  drawCandidate(candidate) {
    const { context: pen } = this;
    const { path, likelihood, slot } = candidate;
    const colour = this.colourOf(slot);
    for (const [x, y, a, b, angle] of candidate.motor) {
      pen.beginPath();
      pen.ellipse(x, y, a, b, angle, 0, FULL);
      this.fill(colour, 0.06 + 0.2 * likelihood);
    }
    for (const [x, y, a, b, angle] of candidate.total) {
      pen.beginPath();
      pen.ellipse(x, y, a, b, angle, 0, FULL);
      this.stroke(colour, 0.7, [4, 4]);
    }
    pen.beginPath();
    path.forEach(([x, y], row) => (row ? pen.lineTo(x, y) : pen.moveTo(x, y)));
    const isSecond = slot !== null && slot >= this.settings.colours.length;
    this.stroke(colour, 1.5 + 5 * likelihood, candidate.compromised ? [2, 4] : isSecond ? [8, 5] : []);
    const [x, y] = path[Math.floor(path.length * 0.6)];
    pen.beginPath();
    pen.arc(x, y, 9 * this.line, 0, FULL);
    this.fill(this.ink.page);
    this.stroke(colour, 2);
    this.text(letterOf(slot), x, y, this.ink.ink);
  }

  drawHand(view, now) {
    const { context: pen, ink } = this;
    const { position, target, force } = view.hand;
    if (!view.hidden && Math.hypot(...force) > 0.01) {
      const tip = position.map((value, axis) => value + METRES_PER_NEWTON * force[axis]);
      pen.beginPath();
      pen.moveTo(...position);
      pen.lineTo(...tip);
      this.stroke('#009E73', 4);
    }
    if (!view.hidden) { // the distance between pointer and hand tells whether there is guidance
      pen.beginPath();
      pen.moveTo(...target);
      pen.lineTo(...position);
      this.stroke(ink.soft, 1, [3, 3]);
      pen.beginPath();
      pen.arc(...target, 0.6 * HAND_RADIUS, 0, FULL);
      this.stroke(ink.soft, 1);
    }
    pen.beginPath();
    pen.arc(...position, HAND_RADIUS, 0, FULL);
    this.fill(now - view.touchedMs < 400 ? '#D55E00' : ink.ink);
  }
}
