import * as THREE from 'three';
import './style.css';
import { readData } from './data.js';
import { Motion } from './motion.js';
import { readOptions } from './options.js';
import { Panel, describe } from './panel.js';
import { Player } from './player.js';
import { Scene } from './scene.js';
import { Stage } from './stage.js';

/** Up is against gravity, or z. */
function upward(gravity, named) {
  if (named) return new THREE.Vector3().setComponent('xyz'.indexOf(named), 1);
  const up = new THREE.Vector3(...gravity).negate();
  return up.lengthSq() > 0 ? up.normalize() : new THREE.Vector3(0, 0, 1);
}

function start() {
  const data = readData(document.getElementById('tendril-data').textContent);
  const options = readOptions(window.location);
  const motion = new Motion(data);
  describe(data, motion);
  const stage = new Stage(document.getElementById('canvas'), upward(data.gravity, options.up));
  const scene = new Scene(data, motion, stage, document.getElementById('labels'));
  let panel;
  const player = new Player(motion, () => {
    panel?.show();
    stage.invalidate();
  });
  panel = new Panel({ data, motion, player, scene, stage, options });
  panel.show();
  stage.beforeDraw = (now) => {
    player.advance(now);
    scene.showTime(player.time);
  };

  /** For tests and for pictures. */
  window.tendril = {
    get ready() { return stage.frames > 0 && !stage.pending; },
    get time() { return player.time; },
    get playing() { return player.playing; },
    duration: motion.duration,
    states: motion.states,
    setTime: (time) => player.set(time),
    play: () => player.play(),
    pause: () => player.pause(),
    ends: () => motion.ends(player.time),
    contacts: () => motion.contactRange(player.time).reduce((from, to) => to - from),
    nodes: () => {
      scene.showTime(player.time);
      return Array.from(scene.positions);
    },
  };
}

try {
  start();
} catch (error) {
  const failure = document.getElementById('failure');
  failure.hidden = false;
  failure.textContent = /WebGL/i.test(error.message)
    ? 'This page needs WebGL, which this browser does not offer. Turn on hardware acceleration or try another browser.'
    : error.message;
  document.body.classList.add('bare');
  throw error;
}
