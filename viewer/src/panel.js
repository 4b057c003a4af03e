// The page around the picture: what is said about the motion, and the controls.
import { count, length, seconds } from './units.js';
import { drawBands } from './timeline.js';
import { DEFAULT_VIEW, viewNamed } from './options.js';

const $ = (id) => document.getElementById(id);

const NARROW = 900; // px: below this the panels may lie over the picture and start folded

const STATUS = {
  solved: ['Solved', 'solved', ''],
  simulated: ['Simulated', '', 'A simulation of given controls, not a plan.'],
  time_limit: ['Not solved', 'unsolved', 'No plan was found within the time limit. Shown is the motion that came nearest to the goal.'],
  iteration_limit: ['Not solved', 'unsolved', 'No plan was found within the iteration limit. Shown is the motion that came nearest to the goal.'],
  cancelled: ['Cancelled', 'unsolved', 'Planning was cancelled before a plan was found. Shown is the motion that came nearest to the goal.'],
};

export function describe(data, motion) {
  const [title, kind, note] = STATUS[data.status] ?? [data.status, '', ''];
  document.title = `${data.name} – Tendril`;
  $('name').textContent = data.name;
  $('about').textContent = data.summary;
  $('status').textContent = title;
  $('status').className = `chip ${kind}`;
  $('status-note').textContent = note;
  $('status-note').hidden = !note;
  $('obstacle-controls').hidden = $('section-controls').hidden = !data.meshes.length;

  const { run, rod } = data;
  const faces = data.meshes.reduce((sum, mesh) => sum + mesh.faces.length / 3, 0);
  const facts = [
    ['Rod', `${length(rod.length_m)}, radius ${length(rod.radius_m)}`],
    ['Elements', motion.nodes > 0 ? motion.nodes - 1 : '–'],
    ['Obstacles', faces ? `${count(faces)} faces` : 'none'],
    ['Duration', seconds(motion.duration)],
    ['States shown', count(motion.states)],
    ['Controls', count(data.controls.length)],
    ['Way travelled', length(motion.travel[Math.max(motion.states - 1, 0)])],
    ['Smallest gap', gapText(data, motion.trajectory.gaps.reduce((a, b) => Math.min(a, b), Infinity))],
    ['Wall time', seconds(run.wall_time_s)],
    ['CPU time', seconds(run.cpu_time_s)],
    ['Iterations', count(run.iterations)],
    ['Tree states', count(run.states)],
    ['Steps', count(run.steps)],
    ['Simulated time', seconds(run.simulated_time_s)],
    ['Planner', run.planner || '–'],
    ['Seed, threads', `${run.seed}, ${run.threads}`],
    ['Version', run.version || '–'],
  ];
  $('facts').replaceChildren(...facts.flatMap(([name, value]) => {
    const [dt, dd] = [document.createElement('dt'), document.createElement('dd')];
    dt.textContent = name;
    dd.textContent = value;
    return [dt, dd];
  }));
}

/** A gap between rod and obstacles, as far as it was looked for; gaps are those of stored states. */
function gapText(data, gap) {
  if (!data.meshes.length) return 'no obstacles';
  return Number.isFinite(gap) ? length(gap) : `over ${length(data.contacts.reach_m)}`;
}

export class Panel {
  constructor({ data, motion, player, scene, stage, options }) {
    Object.assign(this, { data, motion, player, scene, stage });
    this.sectionState = { axis: 'off', at: 0.5, flipped: false };
    this.onionBefore = 8;
    this.apply(options);
    this.listen();
    new ResizeObserver(() => drawBands($('bands'), motion)).observe($('bands'));
  }

  apply(options) {
    const { motion, player, stage, scene } = this;
    $('scrub').min = motion.start;
    $('scrub').max = motion.end;
    for (const id of ['play', 'scrub', 'speed', 'loop']) $(id).disabled = motion.duration <= 0;
    document.querySelector('#display > details').open = window.innerWidth >= NARROW;
    document.body.classList.toggle('bare', options.still);
    $('opacity').value = options.opacity ?? 0.5;
    $('onion').value = options.onion;
    for (const id of ['edges', 'grippers', 'contacts', 'names']) $(id).checked = options[id];
    $('start-ghost').checked = $('goal-ghost').checked = options.ghosts;
    $('workspace').checked = !this.data.meshes.length;
    if (options.section) this.sectionState = options.section;
    for (const id of ['edges', 'grippers', 'contacts', 'names', 'start-ghost', 'goal-ghost', 'workspace', 'smooth']) this.toggled(id);
    this.setOpacity();
    this.setOnion();
    this.setSection();
    stage.resize();
    this.fit(options.fit, ...options.view);
    player.time = options.time ?? motion.start + (options.fraction ?? 0) * motion.duration;
    player.set(player.time);
    scene.showTime(player.time);
    if (options.play) player.play();
  }

  fit(what, azimuth = DEFAULT_VIEW[0], elevation = DEFAULT_VIEW[1], zoom = 1) {
    this.stage.fit(this.scene.points[what], azimuth, elevation, zoom, this.margins());
  }

  /** What the panels cover at the left, right, top and bottom, px; on a narrow screen they may lie over the picture. */
  margins() {
    if (document.body.classList.contains('bare') || window.innerWidth < NARROW) return [0, 0, 0, 0];
    const box = (id) => $(id).getBoundingClientRect();
    return [box('summary').right, window.innerWidth - box('display').left, 0, window.innerHeight - box('transport').top];
  }

  setOpacity() {
    const opacity = Number($('opacity').value);
    $('opacity-value').textContent = `${Math.round(100 * opacity)} %`;
    this.scene.obstacles.setOpacity(opacity);
    this.stage.invalidate();
  }

  setOnion() {
    const number = Number($('onion').value);
    $('onion-value').textContent = number || 'off';
    if (number) this.onionBefore = number;
    this.scene.setOnion(number);
    this.stage.invalidate();
  }

  setSection(change = {}) {
    Object.assign(this.sectionState, change);
    const { axis, at, flipped } = this.sectionState;
    const number = ['x', 'y', 'z'].indexOf(axis);
    const { bounds } = this.scene.obstacles;
    const on = number >= 0 && !bounds.isEmpty();
    document.querySelector(`input[name="axis"][value="${axis}"]`).checked = true;
    $('flip').setAttribute('aria-pressed', flipped);
    $('section').value = at;
    $('section').disabled = $('flip').disabled = !on;
    const low = on ? bounds.min.getComponent(number) : 0;
    const place = on ? low + at * (bounds.max.getComponent(number) - low) : 0;
    $('section-value').textContent = on ? `${axis} = ${length(place)}` : '';
    this.scene.obstacles.setSection(on ? number : null, place, flipped);
    this.stage.invalidate();
  }

  toggled(id) {
    const on = $(id).checked;
    const { scene } = this;
    if (id === 'edges') scene.obstacles.edges.visible = on;
    if (id === 'smooth') scene.obstacles.setSmooth(on);
    if (id === 'start-ghost') scene.ghosts.start.visible = on;
    if (id === 'goal-ghost') scene.ghosts.goal.visible = on;
    if (id === 'contacts') scene.contacts.visible = on;
    if (id === 'grippers') scene.grippers.visible = on;
    if (id === 'names') scene.namesShown = on;
    if (id === 'workspace') scene.workspace.visible = on;
    scene.showTime(this.player.time);
    this.stage.invalidate();
  }

  listen() {
    const { player, stage } = this;
    $('play').onclick = () => player.toggle();
    $('scrub').oninput = () => {
      const time = Number($('scrub').value);
      player.pause();
      player.set(time);
    };
    $('speed').onchange = () => { player.speed = Number($('speed').value); };
    $('loop').onchange = () => { player.loop = $('loop').checked; };
    $('opacity').oninput = () => this.setOpacity();
    $('onion').oninput = () => this.setOnion();
    $('section').oninput = () => this.setSection({ at: Number($('section').value) });
    $('flip').onclick = () => this.setSection({ flipped: !this.sectionState.flipped });
    for (const input of document.querySelectorAll('input[name="axis"]')) input.onchange = () => this.setSection({ axis: input.value });
    for (const id of ['edges', 'smooth', 'start-ghost', 'goal-ghost', 'contacts', 'grippers', 'names', 'workspace'])
      $(id).onchange = () => this.toggled(id);
    $('fit').onclick = () => this.fit('all');
    $('fit-rod').onclick = () => this.fit('rod');
    for (const button of document.querySelectorAll('[data-view]'))
      button.onclick = () => this.fit('all', ...viewNamed(button.dataset.view));
    $('help-button').onclick = () => this.help();
    $('help').onclose = () => $('help-button').setAttribute('aria-expanded', false);
    window.addEventListener('keydown', (event) => this.key(event));
    stage.invalidate();
  }

  help() {
    $('help').showModal();
    $('help-button').setAttribute('aria-expanded', true);
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || $('help').open) return;
    const { tagName, type } = event.target;
    const { player } = this;
    const own = tagName === 'SELECT' || (type === 'range' && event.key.startsWith('Arrow') && event.target.id !== 'scrub')
      || ((tagName === 'BUTTON' || tagName === 'SUMMARY' || type === 'checkbox' || type === 'radio') && (event.key === ' ' || event.key.startsWith('Arrow')));
    if (own) return; // the focused control has its own use for this key
    const section = (axis) => this.setSection({ axis: this.sectionState.axis === axis ? 'off' : axis });
    const shift = (by) => this.setSection({ at: Math.min(1, Math.max(0, this.sectionState.at + by)) });
    const speed = (by) => {
      const list = $('speed');
      list.selectedIndex = Math.min(list.options.length - 1, Math.max(0, list.selectedIndex + by));
      player.speed = Number(list.value);
    };
    const actions = {
      ' ': () => player.toggle(),
      ArrowLeft: () => player.stepState(event.shiftKey ? -10 : -1),
      ArrowRight: () => player.stepState(event.shiftKey ? 10 : 1),
      Home: () => player.set(this.motion.start),
      End: () => player.set(this.motion.end),
      ',': () => speed(-1),
      '.': () => speed(1),
      l: () => { $('loop').checked = player.loop = !player.loop; },
      f: () => this.fit('all'),
      r: () => this.fit('rod'),
      x: () => section('x'),
      y: () => section('y'),
      z: () => section('z'),
      '[': () => shift(-0.02),
      ']': () => shift(0.02),
      '\\': () => this.setSection({ flipped: !this.sectionState.flipped }),
      o: () => { $('onion').value = Number($('onion').value) ? 0 : this.onionBefore; this.setOnion(); },
      h: () => document.body.classList.toggle('bare'),
      '?': () => this.help(),
    };
    const action = actions[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action();
  }

  /** Writes what holds at the player's time. */
  show() {
    const { motion, player, data } = this;
    const { time } = player;
    $('scrub').value = time;
    $('scrub').setAttribute('aria-valuetext', `${seconds(time)} of ${seconds(motion.end)}`);
    $('clock').textContent = `${time.toFixed(2)} / ${seconds(motion.end)}`;
    $('play').classList.toggle('playing', player.playing);
    $('play').setAttribute('aria-label', player.playing ? 'Pause (space)' : 'Play (space)');
    if (!motion.states) return;
    const { index } = motion.locate(time);
    const roles = motion.ends(time);
    const held = ['first', 'last'].filter((_, k) => roles[k] !== 'free');
    const moving = ['first', 'last'][roles.indexOf('moving')];
    $('now-time').textContent = seconds(time);
    $('now-state').textContent = `${index + 1} of ${motion.states}`;
    $('now-held').textContent = held.length === 2 ? 'both ends' : held.length ? `${held[0]} end` : 'neither end';
    $('now-moving').textContent = moving ? `${moving} end` : 'none';
    $('now-gap').textContent = gapText(data, motion.gap(time));
  }
}
