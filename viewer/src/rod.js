// The rod: a tube of its true radius swept through the node positions, with a stripe that follows the material frames.
import * as THREE from 'three';

const SIDES = 20;
const CAP_RINGS = 4;

/** Around the rod: its colour, one light stripe and a thin dark one opposite, so that torsion can be seen. */
function stripeTexture(color) {
  const width = 128;
  const data = new Uint8Array(width * 4);
  const own = [color >> 16, (color >> 8) & 255, color & 255, 255];
  for (let i = 0; i < width; ++i) {
    const turn = i / width;
    const fromStripe = Math.min(turn, 1 - turn);
    data.set(fromStripe < 0.07 ? [255, 246, 228, 255] : Math.abs(turn - 0.5) < 0.025 ? [74, 38, 6, 255] : own, 4 * i);
  }
  const texture = new THREE.DataTexture(data, width, 1);
  texture.colorSpace = THREE.SRGBColorSpace;
  texture.wrapS = THREE.RepeatWrapping;
  texture.magFilter = THREE.LinearFilter;
  texture.minFilter = THREE.LinearMipmapLinearFilter;
  texture.generateMipmaps = true;
  texture.anisotropy = 4;
  texture.needsUpdate = true;
  return texture;
}

/** The rod itself, striped. `color`: 0xrrggbb. */
export function rodMaterial(color) {
  return new THREE.MeshStandardMaterial({ map: stripeTexture(color), roughness: 0.45, emissive: color, emissiveIntensity: 0.08 });
}

/** Another position of the rod: translucent, without a stripe. */
export function ghostMaterial(color, opacity) {
  return new THREE.MeshStandardMaterial({
    color, roughness: 0.45, emissive: color, emissiveIntensity: 0.25, transparent: true, opacity, depthWrite: false,
    polygonOffset: true, polygonOffsetFactor: 2, polygonOffsetUnits: 8, // the rod wins where both lie
  });
}

/**
 * Copies of the rod that keep it in sight: drawn over obstacles that are seen through (they would veil it), and
 * faintly where solid ones hide it.
 */
export function rodInSight(rod) {
  const group = new THREE.Group();
  for (const [depthFunc, opacity] of [[THREE.LessEqualDepth, 0.62], [THREE.GreaterDepth, 0.22]]) {
    const material = rod.material.clone();
    Object.assign(material, { transparent: true, opacity, depthFunc, depthWrite: false });
    const copy = new THREE.Mesh(rod.geometry, material);
    copy.frustumCulled = false;
    copy.renderOrder = 6;
    group.add(copy);
  }
  return group;
}

/** One tube whose shape can be changed at every frame without allocating. */
export class Tube extends THREE.Mesh {
  constructor(nodes, radius, material) {
    super(new THREE.BufferGeometry(), material);
    this.nodes = nodes;
    this.radius = radius;
    this.pieces = Math.max(1, Math.ceil(160 / (nodes - 1))); // drawn pieces per element
    this.samples = (nodes - 1) * this.pieces + 1;
    this.rings = this.samples + 2 * CAP_RINGS;
    const vertices = this.rings * (SIDES + 1);
    this.positions = new Float32Array(vertices * 3);
    this.normals = new Float32Array(vertices * 3);
    const uv = new Float32Array(vertices * 2);
    const index = new Uint32Array((this.rings - 1) * SIDES * 6);
    for (let ring = 0, v = 0; ring < this.rings; ++ring)
      for (let side = 0; side <= SIDES; ++side, ++v) uv.set([side / SIDES, ring / (this.rings - 1)], 2 * v);
    for (let ring = 0, i = 0; ring < this.rings - 1; ++ring)
      for (let side = 0; side < SIDES; ++side, i += 6) {
        const a = ring * (SIDES + 1) + side;
        const b = a + SIDES + 1;
        index.set([a, a + 1, b, b, a + 1, b + 1], i);
      }
    const attribute = (array, size) => new THREE.BufferAttribute(array, size).setUsage(THREE.DynamicDrawUsage);
    this.geometry.setAttribute('position', attribute(this.positions, 3));
    this.geometry.setAttribute('normal', attribute(this.normals, 3));
    this.geometry.setAttribute('uv', new THREE.BufferAttribute(uv, 2));
    this.geometry.setIndex(new THREE.BufferAttribute(index, 1));
    this.frustumCulled = false;
    this.across = new Float32Array(nodes * 3); // the frames' y axes
    this.circle = Array.from({ length: SIDES + 1 }, (_, i) => [Math.cos((2 * Math.PI * i) / SIDES), Math.sin((2 * Math.PI * i) / SIDES)]);
    this.p = new THREE.Vector3();
    this.t = new THREE.Vector3();
    this.y = new THREE.Vector3();
    this.z = new THREE.Vector3();
  }

  /** positions: nodes x 3, m; rotations: nodes x 4, unit quaternions x y z w; the frames' x axis is the tangent. */
  setShape(positions, rotations) {
    const { nodes, across } = this;
    for (let i = 0; i < nodes; ++i) {
      const [x, y, z, w] = [rotations[4 * i], rotations[4 * i + 1], rotations[4 * i + 2], rotations[4 * i + 3]];
      across[3 * i] = 2 * (x * y - w * z);
      across[3 * i + 1] = 1 - 2 * (x * x + z * z);
      across[3 * i + 2] = 2 * (y * z + w * x);
    }
    for (let sample = 0; sample < this.samples; ++sample) {
      const element = Math.min(Math.floor(sample / this.pieces), nodes - 2);
      this.sweep(positions, element, sample / this.pieces - element);
      if (sample === 0) for (let k = CAP_RINGS; k >= 1; --k) this.ring(CAP_RINGS - k, -k / CAP_RINGS);
      this.ring(CAP_RINGS + sample, 0);
      if (sample === this.samples - 1)
        for (let k = 1; k <= CAP_RINGS; ++k) this.ring(CAP_RINGS + sample + k, k / CAP_RINGS);
    }
    this.geometry.attributes.position.needsUpdate = true;
    this.geometry.attributes.normal.needsUpdate = true;
  }

  /** Point, tangent and cross directions at fraction f of an element: a Catmull-Rom curve through the nodes. */
  sweep(q, element, f) {
    const { nodes, across, p, t, y, z } = this;
    const i1 = 3 * element;
    const i2 = i1 + 3;
    const i0 = element > 0 ? i1 - 3 : -1;
    const i3 = element < nodes - 2 ? i2 + 3 : -1;
    const out = [0, 0, 0];
    const slope = [0, 0, 0];
    for (let k = 0; k < 3; ++k) {
      const p1 = q[i1 + k];
      const p2 = q[i2 + k];
      const p0 = i0 < 0 ? 2 * p1 - p2 : q[i0 + k];
      const p3 = i3 < 0 ? 2 * p2 - p1 : q[i3 + k];
      const b = (p2 - p0) / 2;
      const c = p0 - 2.5 * p1 + 2 * p2 - 0.5 * p3;
      const d = 1.5 * (p1 - p2) + 0.5 * (p3 - p0);
      out[k] = p1 + f * (b + f * (c + f * d));
      slope[k] = b + f * (2 * c + 3 * f * d);
    }
    p.fromArray(out);
    t.fromArray(slope).normalize();
    y.set((1 - f) * across[i1] + f * across[i2], (1 - f) * across[i1 + 1] + f * across[i2 + 1],
      (1 - f) * across[i1 + 2] + f * across[i2 + 2]);
    y.addScaledVector(t, -y.dot(t)).normalize();
    z.crossVectors(t, y);
  }

  /** Ring of vertices; `along` in [-1, 1] is the place on the half sphere of an end, 0 on the tube. */
  ring(number, along) {
    const { p, t, y, z, radius, circle, positions, normals } = this;
    const axial = Math.sin((along * Math.PI) / 2);
    const radial = Math.sqrt(Math.max(0, 1 - axial * axial));
    for (let side = 0, v = number * (SIDES + 1) * 3; side <= SIDES; ++side, v += 3) {
      const c = radial * circle[side][0];
      const s = radial * circle[side][1];
      const nx = c * y.x + s * z.x + axial * t.x;
      const ny = c * y.y + s * z.y + axial * t.y;
      const nz = c * y.z + s * z.z + axial * t.z;
      normals[v] = nx;
      normals[v + 1] = ny;
      normals[v + 2] = nz;
      positions[v] = p.x + radius * nx;
      positions[v + 1] = p.y + radius * ny;
      positions[v + 2] = p.z + radius * nz;
    }
  }
}
