// SPDX-FileCopyrightText: 2026 the foc_ros developers
// SPDX-License-Identifier: Apache-2.0
// The hand: pointer, keys and gamepad move a target, which the hand follows no faster than a hand can move.
const KEYS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
// Speed at full deflection of keys or stick [m/s], time constant at which it builds up [s], and the part of a stick that is no deflection.
const STICK_SPEED = 0.35;
const STICK_TIME = 0.08;
const DEAD_ZONE = 0.15;
// Time constant of the pull of guidance [s]; a force older than FORCE_MS is over.
const PULL_TIME = 0.1;
const FORCE_MS = 300;

export class Hand {
  // moved: called with the time of an event [ms] that has moved the target.
  constructor(canvas, toScene, moved) {
    this.target = [0, 0];
    this.position = [0, 0];
    this.force = [0, 0];
    this.enabled = true;
    this.event = null;
    this.seenMs = -1;
    this.followed = [0, 0];
    this.pull = [0, 0];
    this.velocity = [0, 0];
    this.forceMs = 0;
    this.pressed = new Set();
    const point = (event) => {
      if (this.enabled && event.timeStamp > this.seenMs) {
        [this.target, this.event, this.seenMs] = [toScene(event), event.timeStamp, event.timeStamp];
        moved(event.timeStamp);
      }
    };
    // pointerrawupdate does not wait for the next frame, unlike pointermove, which repeats it
    for (const name of ['pointerrawupdate', 'pointermove', 'pointerdown']) canvas.addEventListener(name, point);
    canvas.addEventListener('keydown', (event) => {
      if (this.enabled && event.key in KEYS) {
        event.preventDefault();
        this.pressed.add(event.key);
      }
    });
    addEventListener('keyup', (event) => this.pressed.delete(event.key));
    addEventListener('blur', () => this.pressed.clear());
  }

  // bounds: of the scene [m]; hand: where it was [m]; max_speed [m/s]; coupling: stiffness of the spring between pointer and hand [N/m].
  configure(settings) {
    this.settings = settings;
    [this.target, this.followed, this.position] = [settings.hand, settings.hand, settings.hand];
  }

  setForce(force, now) {
    [this.force, this.forceMs] = [force, now];
  }

  // Moves the hand until a time [ms] and returns the time of the input that moved it, or null.
  update(time, seconds) {
    const { bounds, max_speed: maxSpeed, coupling } = this.settings;
    const stick = this.readStick();
    const share = 1 - Math.exp(-seconds / STICK_TIME);
    this.velocity = this.velocity.map((value, axis) => value + share * (STICK_SPEED * stick[axis] - value));
    if (Math.hypot(...this.velocity) > 1e-3) {
      [this.target, this.event] = [this.target.map((value, axis) => value + this.velocity[axis] * seconds), time];
    }
    this.target = this.target.map((value, axis) => clamp(value, bounds[2 * axis], bounds[2 * axis + 1]));
    const left = this.target.map((value, axis) => value - this.followed[axis]);
    const fraction = Math.min(1, (maxSpeed * seconds) / Math.max(Math.hypot(...left), 1e-9));
    if (time - this.forceMs > FORCE_MS) {
      this.force = [0, 0];
    }
    const pulled = 1 - Math.exp(-seconds / PULL_TIME);
    this.followed = this.followed.map((value, axis) => value + fraction * left[axis]);
    this.pull = this.pull.map((value, axis) => value + pulled * (this.force[axis] / coupling - value));
    this.position = this.followed.map((value, axis) => clamp(value + this.pull[axis], bounds[2 * axis], bounds[2 * axis + 1]));
    const { event } = this;
    this.event = null;
    return event;
  }

  // Returns the deflection of the arrow keys, or else of the first gamepad's left stick; at most of length 1.
  readStick() {
    let stick = [0, 0];
    for (const key of this.enabled ? this.pressed : []) {
      stick = stick.map((value, axis) => value + KEYS[key][axis]);
    }
    const pad = (navigator.getGamepads?.() ?? []).find((each) => each); // missing on a page that is reached without encryption
    if (pad && this.enabled && !this.pressed.size && Math.hypot(pad.axes[0], pad.axes[1]) > DEAD_ZONE) {
      stick = [pad.axes[0], -pad.axes[1]];
    }
    const length = Math.max(Math.hypot(...stick), 1);
    return stick.map((value) => value / length);
  }
}
