// Renderer, camera, lights; draws only when something has changed.
import * as THREE from 'three';
import { OrbitControls } from 'three/examples/jsm/controls/OrbitControls.js';

export class Stage {
  /** `up`: unit vector that points up in the picture. */
  constructor(canvas, up) {
    this.renderer = new THREE.WebGLRenderer({ canvas, antialias: true });
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    this.renderer.localClippingEnabled = true;
    this.scene = new THREE.Scene();
    this.scene.background = backdrop();
    this.camera = new THREE.PerspectiveCamera(32, 1, 0.01, 100);
    this.camera.up.copy(up);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = true;
    this.controls.dampingFactor = 0.12;
    this.controls.zoomToCursor = true;
    this.controls.addEventListener('change', () => this.invalidate());
    this.beforeDraw = () => {};
    this.pending = false;
    this.frames = 0;
    this.light(up);
    new ResizeObserver(() => this.resize()).observe(canvas);
  }

  light(up) {
    const sky = new THREE.HemisphereLight(0xe9f0fa, 0x3a3631, 1.25);
    sky.position.copy(up);
    this.key = new THREE.DirectionalLight(0xfff3e4, 1.7); // both follow the camera: whatever is looked at is lit
    this.fill = new THREE.DirectionalLight(0xa9c4ff, 0.55);
    this.scene.add(sky, this.key, this.key.target, this.fill, this.fill.target);
  }

  resize() {
    const { clientWidth, clientHeight } = this.renderer.domElement;
    if (!clientWidth || !clientHeight) return;
    this.renderer.setSize(clientWidth, clientHeight, false);
    this.camera.aspect = clientWidth / clientHeight;
    this.camera.updateProjectionMatrix();
    this.invalidate();
  }

  invalidate() {
    if (this.pending) return;
    this.pending = true;
    requestAnimationFrame((now) => this.draw(now));
  }

  draw(now) {
    this.pending = false;
    this.beforeDraw(now);
    this.controls.update();
    const { camera, controls } = this;
    const distance = camera.position.distanceTo(controls.target);
    camera.near = Math.max(distance, this.extent ?? 1) / 1000;
    camera.far = distance + 20 * (this.extent ?? 1);
    camera.updateProjectionMatrix();
    const right = new THREE.Vector3().setFromMatrixColumn(camera.matrix, 0);
    const above = new THREE.Vector3().setFromMatrixColumn(camera.matrix, 1);
    for (const [lamp, side, lift] of [[this.key, -0.55, 0.75], [this.fill, 0.9, -0.1]]) {
      lamp.position.copy(camera.position).addScaledVector(right, side * distance).addScaledVector(above, lift * distance);
      lamp.target.position.copy(controls.target);
    }
    this.renderer.render(this.scene, camera);
    const { clientWidth, clientHeight } = this.renderer.domElement;
    this.labels?.place(camera, clientWidth, clientHeight);
    ++this.frames;
  }

  /** Looks from a direction (azimuth about up, elevation, degrees) so that the points (arrays of x y z, m) fill the
   *  picture / zoom, inside the margins (left, right, top, bottom, px). */
  fit(points, azimuth, elevation, zoom = 1, margins = [0, 0, 0, 0]) {
    const { camera, controls } = this;
    const { up } = camera;
    const east = Math.abs(up.x) < 0.9 ? new THREE.Vector3(1, 0, 0) : new THREE.Vector3(0, 1, 0);
    const south = east.clone().cross(up);
    const [a, e] = [(azimuth * Math.PI) / 180, (elevation * Math.PI) / 180];
    const back = south.multiplyScalar(Math.cos(a) * Math.cos(e)).addScaledVector(east, Math.sin(a) * Math.cos(e))
      .addScaledVector(up, Math.sin(e)).normalize();
    const right = up.clone().cross(back).normalize();
    const above = back.clone().cross(right);

    // The points must lie inside four planes through the eye: right, left, top, bottom, each with the slope `tan`. Two
    // opposite ones, moved up to the points, meet at the nearest eye (along `back`) that sees all of them.
    const { clientWidth: width, clientHeight: height } = this.renderer.domElement;
    const tanV = Math.tan((camera.fov * Math.PI) / 360);
    const slope = (tan, margin, size) => tan * Math.max(0.2, 1 - (2 * margin) / size);
    const [left, rightMargin, top, bottom] = margins;
    const axes = [
      { axis: right, high: slope(tanV * camera.aspect, rightMargin, width), low: slope(tanV * camera.aspect, left, width) },
      { axis: above, high: slope(tanV, top, height), low: slope(tanV, bottom, height) },
    ];
    const high = [-Infinity, -Infinity];
    const low = [-Infinity, -Infinity];
    let [near, far] = [-Infinity, Infinity];
    const point = new THREE.Vector3();
    for (const array of points) {
      for (let i = 0; i < array.length; i += 3) {
        point.fromArray(array, i);
        const depth = point.dot(back);
        near = Math.max(near, depth);
        far = Math.min(far, depth);
        for (let k = 0; k < 2; ++k) {
          const along = point.dot(axes[k].axis);
          high[k] = Math.max(high[k], along + axes[k].high * depth);
          low[k] = Math.max(low[k], -along + axes[k].low * depth);
        }
      }
    }
    const middle = (near + far) / 2;
    const nearest = Math.max(...axes.map((axis, k) => (high[k] + low[k]) / (axis.high + axis.low)));
    const eye = middle + (nearest - middle) * 1.1;
    const aim = back.clone().multiplyScalar(middle);
    axes.forEach((side, k) => aim.addScaledVector(side.axis, (high[k] - low[k] + eye * (side.low - side.high)) / 2));
    controls.target.copy(aim);
    camera.position.copy(aim).addScaledVector(back, (eye - middle) / zoom);
    controls.update();
    this.invalidate();
  }
}

/** A dark gradient, a little lighter in the middle. */
function backdrop() {
  const canvas = document.createElement('canvas');
  canvas.width = canvas.height = 256;
  const context = canvas.getContext('2d');
  const gradient = context.createRadialGradient(128, 110, 10, 128, 128, 190);
  gradient.addColorStop(0, '#2b3038');
  gradient.addColorStop(1, '#121418');
  context.fillStyle = gradient;
  context.fillRect(0, 0, 256, 256);
  const texture = new THREE.CanvasTexture(canvas);
  texture.colorSpace = THREE.SRGBColorSpace;
  return texture;
}
