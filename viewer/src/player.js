// The clock: time, playing, speed, loop.

export class Player {
  constructor(motion, onChange) {
    this.motion = motion;
    this.onChange = onChange;
    this.time = motion.start;
    this.playing = false;
    this.speed = 1;
    this.loop = true;
    this.before = 0;
  }

  set(time) {
    this.time = Math.min(Math.max(time, this.motion.start), this.motion.end);
    this.onChange();
  }

  play() {
    if (this.motion.duration <= 0) return;
    if (this.time >= this.motion.end) this.time = this.motion.start;
    this.playing = true;
    this.before = 0;
    this.onChange();
  }

  pause() {
    this.playing = false;
    this.onChange();
  }

  toggle() {
    if (this.playing) this.pause();
    else this.play();
  }

  /** To another stored state: -1 the one before, +1 the next. */
  stepState(by) {
    this.pause();
    if (!this.motion.states) return;
    const { index, fraction } = this.motion.locate(this.time);
    const from = by < 0 && fraction > 0 ? index + 1 : index;
    const state = Math.min(Math.max(from + by, 0), this.motion.states - 1);
    this.set(this.motion.trajectory.times[state]);
  }

  /** Called once per drawn frame; `now` in ms. */
  advance(now) {
    if (!this.playing) return;
    const elapsed = this.before ? Math.min((now - this.before) / 1000, 0.25) : 0;
    this.before = now;
    let time = this.time + elapsed * this.speed;
    if (time > this.motion.end) {
      if (this.loop) time = this.motion.start + ((time - this.motion.start) % this.motion.duration);
      else this.playing = false;
    }
    this.set(time);
  }
}
