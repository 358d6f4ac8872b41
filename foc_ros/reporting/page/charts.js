// SPDX-FileCopyrightText: 2026 the foc_ros developers
// SPDX-License-Identifier: Apache-2.0
// A chart over time, drawn as SVG.
class Chart {
  // height [px]; label: of the second axis; picked: called with a time [s] that was clicked on.
  constructor(box, { height, label, picked }) {
    [this.box, this.height, this.label] = [box, height, label];
    box.addEventListener('click', (event) => picked(this.timeAt(event.clientX - box.getBoundingClientRect().left)));
  }

  timeAt(x) {
    const { left, right, span: [from, to] } = this;
    return from + ((clamp(x, left, right) - left) / (right - left)) * (to - from);
  }

  x(time) { return this.left + ((time - this.span[0]) / Math.max(this.span[1] - this.span[0], 1e-9)) * (this.right - this.left); }

  y(value) { return this.base - (value / this.top) * (this.base - 6); }

  // Draws lines (points [time, value or null], colour, width, dotted, alpha, marks, letter, name), a hatched share (points), both under the
  // time now [s]. A letter is where its line is highest and has room, those of the highest lines first.
  draw({ span, top, lines, hatched = [], now }) {
    const width = Math.max(this.box.clientWidth, 200);
    Object.assign(this, { span, top, left: 44, right: width - 20, base: this.height - 22 });
    const line = (points) => points.map(([t, v], row) => (v === null ? '' : `${row && points[row - 1][1] !== null ? 'L' : 'M'}${this.x(t).toFixed(2)} ${this.y(v).toFixed(2)}`)).join('');
    const parts = [...this.ticks(), ...this.hatch(hatched)];
    for (const { points, colour, width: thick, dotted, alpha = 1, marks, letter, name = '' } of lines) {
      parts.push(`<g data-name="${name}" opacity="${alpha}"><path d="${line(points)}" fill="none" stroke="${colour}" stroke-width="${thick}"${dotted ? ' stroke-dasharray="2 4"' : ''}/>`);
      if (marks) parts.push(...points.filter(([, v]) => v !== null).map(([t, v]) => `<circle cx="${this.x(t).toFixed(2)}" cy="${this.y(v).toFixed(2)}" r="1.6" fill="${colour}"/>`));
      parts.push('</g>');
    }
    const taken = [];
    const lettered = lines.filter(({ letter }) => letter).map((line) => [line, line.points.filter(([, v]) => v >= NOTED).sort((a, b) => b[1] - a[1])]);
    for (const [{ colour, alpha = 1, letter }, high] of lettered.filter(([, high]) => high.length).sort(([, a], [, b]) => b[0][1] - a[0][1])) {
      const [x, y] = takePlace(high.map(([t, v]) => [this.x(t), this.y(v)]), taken, 16) || [];
      if (x) parts.push(`<g class="tag" opacity="${alpha}"><circle cx="${x}" cy="${y}" r="7" fill="var(--page)" stroke="${colour}" stroke-width="1.5"/><text x="${x}" y="${y + 3.5}">${letter}</text></g>`);
    }
    parts.push(`<path class="now" d="M0 6V${this.base}" stroke="var(--ink)" stroke-width="1.2"/>`);
    this.box.innerHTML = `<svg width="${width}" height="${this.height}" role="img" aria-label="${this.label} over time">${parts.join('')}</svg>`;
    this.move(now);
  }

  move(now) {
    const mark = this.box.querySelector('.now');
    if (mark) mark.setAttribute('transform', `translate(${this.x(now)} 0)`);
  }

  ticks() {
    const steps = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000];
    const places = (from, to, count) => {
      const step = steps.find((each) => (to - from) / each <= count) || to - from || 1;
      return Array.from({ length: Math.floor(to / step + 1e-9) - Math.ceil(from / step - 1e-9) + 1 }, (_, row) => [step * (Math.ceil(from / step - 1e-9) + row), step < 0.1 ? 2 : step < 1 ? 1 : 0]);
    };
    return [
      ...places(...this.span, (this.right - this.left) / 60).map(([t, digits]) => `<path d="M${this.x(t)} 6V${this.base}" stroke="var(--line)"/><text x="${this.x(t)}" y="${this.base + 14}" text-anchor="middle">${t.toFixed(digits)} s</text>`),
      ...places(0, this.top, 4).map(([v, digits]) => `<path d="M${this.left} ${this.y(v)}H${this.right}" stroke="var(--line)"/><text x="${this.left - 5}" y="${this.y(v) + 4}" text-anchor="end">${v.toFixed(digits)}</text>`),
    ];
  }

  // Returns the share of the candidates without a likelihood, down from one.
  hatch(points) {
    if (!points.some(([, share]) => share)) return [];
    const middle = (row) => (row < 0 ? this.x(points[0][0]) : row >= points.length - 1 ? this.x(points[points.length - 1][0]) : (this.x(points[row][0]) + this.x(points[row + 1][0])) / 2);
    const bars = points.map(([, share], row) => (share ? `<rect x="${middle(row - 1)}" y="${this.y(1)}" width="${Math.max(middle(row) - middle(row - 1), 0.5)}" height="${this.y(1 - share) - this.y(1)}" fill="url(#hatch)"/>` : ''));
    return ['<pattern id="hatch" width="6" height="6" patternUnits="userSpaceOnUse"><path d="M0 6L6 0" stroke="var(--soft)" stroke-width=".7"/></pattern>', `<g class="unknown">${bars.join('')}</g>`];
  }
}
