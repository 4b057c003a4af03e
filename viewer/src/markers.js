// What is drawn about the rod: its grippers and their targets, the contacts, names beside the ends.
import * as THREE from 'three';

export const COLORS = {
  rod: 0xf2993a, start: 0x5aa9e6, goal: 0x35c493, contact: 0xff4f8b, moving: 0xf5e04a, held: 0xe8ecf2, free: 0x7d8692,
};

/** A gripper in the end's frame (x along the rod): a collar, and two jaws once it holds. */
export class Gripper extends THREE.Group {
  constructor(radius, { ghost = false } = {}) {
    super();
    this.material = new THREE.MeshStandardMaterial({
      roughness: 0.5, transparent: true, opacity: ghost ? 0.35 : 1, emissiveIntensity: 0.25, depthWrite: !ghost,
      polygonOffset: ghost, polygonOffsetFactor: 2, polygonOffsetUnits: 8, // the gripper itself wins where both lie
    });
    const r = radius;
    this.collar = new THREE.Mesh(new THREE.TorusGeometry(1.55 * r, 0.22 * r, 12, 40), this.material);
    this.collar.rotation.y = Math.PI / 2;
    this.jaws = new THREE.Group();
    for (const side of [-1, 1]) {
      const jaw = new THREE.Mesh(new THREE.BoxGeometry(3.2 * r, 0.8 * r, 1.7 * r), this.material);
      jaw.position.y = side * 1.75 * r;
      const arm = new THREE.Mesh(new THREE.BoxGeometry(0.8 * r, 1.4 * r, 0.9 * r), this.material);
      arm.position.y = side * 2.7 * r;
      this.jaws.add(jaw, arm);
    }
    this.add(this.collar, this.jaws);
    this.traverse((part) => { part.renderOrder = 5; }); // after the obstacles: seen through them
    this.set('held');
  }

  /** 'moving', 'held' or 'free'. */
  set(role) {
    this.jaws.visible = role !== 'free';
    this.material.color.set(COLORS[role]);
    this.material.emissive.set(COLORS[role]);
  }
}

/** Contact points as round dots of a fixed size on the screen, drawn through the obstacles. */
export class Contacts extends THREE.Points {
  constructor(points) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(points, 3));
    const material = new THREE.PointsMaterial({ color: COLORS.contact, size: 8, sizeAttenuation: false, depthTest: false, transparent: true });
    material.onBeforeCompile = (shader) => {
      shader.fragmentShader = shader.fragmentShader.replace('#include <opaque_fragment>',
        `float away = length(gl_PointCoord - 0.5);
         if (away > 0.5) discard;
         outgoingLight = away > 0.34 ? vec3(0.08, 0.0, 0.03) : outgoingLight;
         #include <opaque_fragment>`);
    };
    super(geometry, material);
    this.frustumCulled = false;
    this.renderOrder = 9;
    this.show([0, 0]);
  }

  show([from, to]) { this.geometry.setDrawRange(from, to - from); }
}

/** A thin dashed line from an end to where it is going. */
export class Way extends THREE.Line {
  /** length: of a dash, m */
  constructor(length) {
    const geometry = new THREE.BufferGeometry();
    geometry.setAttribute('position', new THREE.BufferAttribute(new Float32Array(6), 3));
    super(geometry, new THREE.LineDashedMaterial({ color: COLORS.moving, dashSize: length, gapSize: length, transparent: true, opacity: 0.8 }));
    this.frustumCulled = false;
    this.renderOrder = 5;
  }

  set(from, to) {
    this.geometry.attributes.position.array.set([...from, ...to]);
    this.geometry.attributes.position.needsUpdate = true;
    this.computeLineDistances();
  }
}

/** Names that follow points of the scene. */
export class Labels {
  constructor(element) {
    this.element = element;
    this.items = new Map();
    this.projected = new THREE.Vector3();
  }

  /** Shows `text` beside a point [m]; no point: not shown. */
  set(key, text, color, point) {
    let item = this.items.get(key);
    if (!item) {
      item = { span: this.element.appendChild(document.createElement('span')), point: new THREE.Vector3() };
      this.items.set(key, item);
    }
    item.shown = Boolean(point);
    if (point) item.point.copy(point);
    item.span.textContent = text;
    item.span.style.color = `#${new THREE.Color(color).getHexString()}`;
  }

  place(camera, width, height) {
    for (const { span, point, shown } of this.items.values()) {
      this.projected.copy(point).project(camera);
      const { x, y, z } = this.projected;
      span.hidden = !shown || z > 1 || Math.abs(x) > 1.1 || Math.abs(y) > 1.1;
      span.style.transform = `translate(${((x + 1) / 2) * width + 12}px, ${((1 - y) / 2) * height - 24}px)`;
    }
  }
}
