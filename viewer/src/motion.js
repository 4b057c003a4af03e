// The motion as a function of time: between stored states every node's position moves in a straight line.

export class Motion {
  constructor({ trajectory, controls, contacts }) {
    this.trajectory = trajectory;
    this.controls = controls;
    this.contacts = contacts;
    const { times, states, nodes } = trajectory;
    this.states = states;
    this.nodes = nodes;
    this.start = states ? times[0] : 0;
    this.end = states ? times[states - 1] : 0;
    this.duration = this.end - this.start;
    this.travel = travelled(trajectory);
  }

  /** The state at or before a time, and the fraction of the way to the next one. */
  locate(time) {
    const { times } = this.trajectory;
    let low = 0;
    let high = this.states - 1;
    if (high < 1 || time <= times[0]) return { index: 0, fraction: 0 };
    if (time >= times[high]) return { index: high, fraction: 0 };
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if (times[middle] <= time) low = middle;
      else high = middle;
    }
    return { index: low, fraction: (time - times[low]) / (times[high] - times[low]) };
  }

  /** Node positions (nodes x 3, m) and quaternions (nodes x 4, x y z w, unit) at a time, into the given arrays. */
  shape(time, positions, rotations) {
    const { index, fraction } = this.locate(time);
    interpolate(this.trajectory, index, fraction, positions, rotations);
  }

  /** The time by which the rod has travelled this fraction of its whole way (mean node distance, eq. (6)). */
  timeOfTravel(fraction) {
    const { travel, trajectory } = this;
    const wanted = fraction * travel[this.states - 1];
    let k = 1;
    while (k < this.states - 1 && travel[k] < wanted) ++k;
    if (this.states < 2 || travel[k] === travel[k - 1]) return this.start + fraction * this.duration;
    const part = (wanted - travel[k - 1]) / (travel[k] - travel[k - 1]);
    return trajectory.times[k - 1] + part * (trajectory.times[k] - trajectory.times[k - 1]);
  }

  /** The control in force during the motion at a time, or undefined. */
  control(time) {
    const { controls } = this;
    for (const control of controls) if (time < control.end_s) return control;
    return controls[controls.length - 1];
  }

  /** What each end is at a time: 'moving', 'held' or 'free'. */
  ends(time) {
    const control = this.control(time);
    const { index, fraction } = this.locate(time);
    const leadsTo = Math.min(index + (fraction > 0 ? 1 : 0), this.states - 1);
    const held = this.states ? this.trajectory.held[leadsTo] : 0;
    return ['first', 'last'].map((end, bit) => {
      if (!((held >> bit) & 1)) return 'free';
      return control?.moving === end && time < this.end ? 'moving' : 'held';
    });
  }

  /** The smallest gap [m] at the nearer stored state; infinite when none was found within reach. */
  gap(time) {
    const { index, fraction } = this.locate(time);
    return this.states ? this.trajectory.gaps[this.nearestSearched(index, fraction)] : Infinity;
  }

  /** Contact points near a time: the slice [from, to) of the points. */
  contactRange(time) {
    const { index, fraction } = this.locate(time);
    const { offsets } = this.contacts;
    if (offsets.length < 2) return [0, 0];
    const k = this.nearestSearched(index, fraction);
    return [offsets[k], offsets[k + 1]];
  }

  nearestSearched(index, fraction) {
    const last = this.contacts.offsets.length - 2;
    return Math.max(0, Math.min(last, Math.round((index + fraction) / this.contacts.stride)));
  }
}

/** Sum of mean node distances up to every state, m. */
function travelled({ positions, states, nodes }) {
  const out = new Float64Array(Math.max(states, 1));
  const size = 3 * nodes;
  for (let k = 1; k < states; ++k) {
    let sum = 0;
    for (let i = k * size; i < (k + 1) * size; i += 3) {
      sum += Math.hypot(positions[i] - positions[i - size], positions[i + 1] - positions[i + 1 - size],
        positions[i + 2] - positions[i + 2 - size]);
    }
    out[k] = out[k - 1] + sum / nodes;
  }
  return out;
}

/** Positions on the straight line from state `index` to the next; rotations on the shorter arc, normalised. */
export function interpolate({ positions, rotations, nodes, states }, index, fraction, outPositions, outRotations) {
  const next = Math.min(index + 1, states - 1);
  let a = index * nodes * 3;
  let b = next * nodes * 3;
  for (let i = 0; i < nodes * 3; ++i) outPositions[i] = positions[a + i] + fraction * (positions[b + i] - positions[a + i]);
  a = index * nodes * 4;
  b = next * nodes * 4;
  for (let i = 0; i < nodes * 4; i += 4, a += 4, b += 4) {
    let dot = 0;
    for (let k = 0; k < 4; ++k) dot += rotations[a + k] * rotations[b + k];
    const to = dot < 0 ? -fraction : fraction;
    let norm = 0;
    for (let k = 0; k < 4; ++k) {
      const value = (1 - fraction) * rotations[a + k] + to * rotations[b + k];
      outRotations[i + k] = value;
      norm += value * value;
    }
    norm = Math.sqrt(norm) || 1;
    for (let k = 0; k < 4; ++k) outRotations[i + k] /= norm;
  }
}
