// Everything that is drawn, put together from the page's data; `showTime` is the only thing a frame calls.
import * as THREE from 'three';
import { Obstacles } from './obstacles.js';
import { Tube, ghostMaterial, rodInSight, rodMaterial } from './rod.js';
import { COLORS, Contacts, Gripper, Labels, Way } from './markers.js';

const ENDS = ['first', 'last'];

function boundsOf(positions) {
  return new THREE.Box3().setFromArray(positions);
}

export class Scene {
  constructor(data, motion, stage, labels) {
    const { rod, trajectory, goal } = data;
    this.data = data;
    this.motion = motion;
    this.stage = stage;
    this.labels = new Labels(labels);
    stage.labels = this.labels;
    this.obstacles = new Obstacles(data.meshes);
    stage.scene.add(this.obstacles);

    const workspace = new THREE.Box3(new THREE.Vector3(...data.workspace.min), new THREE.Vector3(...data.workspace.max));
    this.motionBounds = motion.states ? boundsOf(trajectory.positions) : new THREE.Box3();
    if (goal.shape) this.motionBounds.union(boundsOf(goal.shape.positions));
    for (const pose of goal.grippers) this.motionBounds.expandByPoint(new THREE.Vector3(...pose.position_m));
    if (this.motionBounds.isEmpty()) this.motionBounds.copy(workspace);
    this.motionBounds.expandByScalar(3 * rod.radius_m);
    const { min, max } = this.motionBounds;
    const extremes = Float32Array.from({ length: 24 }, (_, i) => ((i / 3) >> (i % 3)) & 1 ? max.getComponent(i % 3) : min.getComponent(i % 3));
    const way = [motion.states ? trajectory.positions : extremes, goal.shape?.positions ?? []];
    this.points = { rod: way, all: [...way, ...data.meshes.map((mesh) => mesh.vertices)] }; // what to fit the picture to
    const all = this.motionBounds.clone().union(this.obstacles.bounds);
    stage.extent = all.getSize(new THREE.Vector3()).length();
    this.workspace = new THREE.Box3Helper(workspace, 0x5b6572);
    this.workspace.visible = false;
    stage.scene.add(this.workspace);
    if (!data.meshes.length) this.addFloor();

    this.ghosts = { start: new THREE.Group(), goal: new THREE.Group() };
    this.onion = new THREE.Group();
    stage.scene.add(this.ghosts.start, this.ghosts.goal, this.onion);
    this.grippers = new THREE.Group();
    stage.scene.add(this.grippers);
    this.positions = new Float32Array(3 * motion.nodes);
    this.rotations = new Float32Array(4 * motion.nodes);
    this.namesShown = true;
    if (motion.states) this.addRod();
    this.addGoal();
    this.contacts = new Contacts(data.contacts.points);
    stage.scene.add(this.contacts);
  }

  /** A grid below the motion, where there are no obstacles to tell up from down. */
  addFloor() {
    const up = this.stage.camera.up;
    const size = this.motionBounds.getSize(new THREE.Vector3());
    const span = 2.4 * Math.max(size.x, size.y, size.z);
    const step = 10 ** Math.floor(Math.log10(span / 4));
    const cells = Math.ceil(span / step);
    const grid = new THREE.GridHelper(cells * step, cells, 0x55606c, 0x30363e);
    grid.quaternion.setFromUnitVectors(new THREE.Vector3(0, 1, 0), up);
    const center = this.motionBounds.getCenter(new THREE.Vector3());
    const half = Math.abs(size.dot(up)) / 2;
    grid.position.copy(center).addScaledVector(up, -half - 0.06 * span);
    this.stage.scene.add(grid);
  }

  ghost(positions, rotations, color, opacity) {
    const tube = new Tube(positions.length / 3, this.data.rod.radius_m, ghostMaterial(color, opacity));
    tube.setShape(positions, rotations);
    tube.renderOrder = 5; // after the obstacles: seen through them
    return tube;
  }

  addRod() {
    const { motion } = this;
    motion.shape(motion.start, this.positions, this.rotations);
    this.rod = new Tube(motion.nodes, this.data.rod.radius_m, rodMaterial(COLORS.rod));
    this.stage.scene.add(this.rod, rodInSight(this.rod));
    this.ghosts.start.add(this.ghost(this.positions, this.rotations, COLORS.start, 0.4));
    this.held = ENDS.map(() => new Gripper(this.data.rod.radius_m));
    this.target = new Gripper(this.data.rod.radius_m, { ghost: true });
    this.target.set('moving');
    this.way = new Way(2 * this.data.rod.radius_m);
    this.grippers.add(...this.held, this.target, this.way);
  }

  addGoal() {
    const { goal, rod } = this.data;
    if (goal.shape) {
      const rotations = Float32Array.from(goal.shape.rotations, (value) => value / 32767);
      this.ghosts.goal.add(this.ghost(goal.shape.positions, rotations, COLORS.goal, 0.4));
    }
    for (const pose of goal.grippers) {
      const gripper = new Gripper(rod.radius_m, { ghost: true });
      gripper.material.color.set(COLORS.goal);
      gripper.material.emissive.set(COLORS.goal);
      placeAt(gripper, pose);
      this.ghosts.goal.add(gripper);
    }
  }

  /** N translucent rods, evenly spaced along the way travelled, from the colour of the start to the goal's. */
  setOnion(count) {
    for (const tube of this.onion.children) {
      tube.geometry.dispose();
      tube.material.dispose();
    }
    this.onion.clear();
    if (!this.motion.states) return;
    const positions = new Float32Array(this.positions.length);
    const rotations = new Float32Array(this.rotations.length);
    for (let k = 0; k < count; ++k) {
      const part = count > 1 ? k / (count - 1) : 0.5;
      this.motion.shape(this.motion.timeOfTravel(part), positions, rotations);
      const color = new THREE.Color(COLORS.start).lerp(new THREE.Color(COLORS.goal), part);
      this.onion.add(this.ghost(positions, rotations, color, 0.42));
    }
  }

  showTime(time) {
    if (!this.rod) return;
    const { motion, positions, rotations } = this;
    motion.shape(time, positions, rotations);
    this.rod.setShape(positions, rotations);
    const roles = motion.ends(time);
    const control = motion.control(time);
    ENDS.forEach((end, k) => {
      const node = k * (motion.nodes - 1);
      const gripper = this.held[k];
      gripper.position.fromArray(positions, 3 * node);
      gripper.quaternion.fromArray(rotations, 4 * node);
      gripper.set(roles[k]);
      this.labels.set(end, `${end} · ${roles[k]}`, COLORS[roles[k]], this.namesShown && this.grippers.visible && gripper.position);
    });
    const moving = roles.indexOf('moving');
    this.target.visible = this.way.visible = moving >= 0;
    if (moving >= 0) {
      placeAt(this.target, control.target);
      this.way.set(this.held[moving].position, this.target.position);
    }
    this.labels.set('target', 'target', COLORS.moving,
      moving >= 0 && this.namesShown && this.grippers.visible
        && this.target.position.distanceTo(this.held[moving].position) > 6 * this.data.rod.radius_m && this.target.position);
    this.contacts.show(motion.contactRange(time));
  }
}

function placeAt(object, pose) {
  object.position.fromArray(pose.position_m);
  const [w, x, y, z] = pose.orientation_wxyz;
  object.quaternion.set(x, y, z, w);
}
