// The obstacles: triangle soups, drawn with creased normals, their sharp edges and the curve of the section plane.
import * as THREE from 'three';

const CREASE = Math.cos((38 * Math.PI) / 180); // normals are averaged over faces that meet at less than this
const SHARP = Math.cos((25 * Math.PI) / 180); // edges at more than this are drawn

/** Unit normals of the faces, faces x 3; zero for slivers. */
function faceNormals({ vertices, faces }) {
  const normals = new Float32Array(faces.length);
  for (let i = 0; i < faces.length; i += 3) {
    const [a, b, c] = [3 * faces[i], 3 * faces[i + 1], 3 * faces[i + 2]];
    const [ux, uy, uz] = [vertices[b] - vertices[a], vertices[b + 1] - vertices[a + 1], vertices[b + 2] - vertices[a + 2]];
    const [vx, vy, vz] = [vertices[c] - vertices[a], vertices[c + 1] - vertices[a + 1], vertices[c + 2] - vertices[a + 2]];
    const [x, y, z] = [uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx];
    const length = Math.hypot(x, y, z);
    if (length > 0) normals.set([x / length, y / length, z / length], i);
  }
  return normals;
}

/** The mesh with one normal per corner: the mean over the faces around the vertex that lie nearly in one plane. */
function creasedGeometry({ vertices, faces }, normals) {
  const count = vertices.length / 3;
  const first = new Uint32Array(count + 1); // corners around a vertex: corner[first[v]] to corner[first[v + 1]]
  for (const v of faces) ++first[v + 1];
  for (let v = 0; v < count; ++v) first[v + 1] += first[v];
  const corner = new Uint32Array(faces.length);
  const fill = first.slice();
  faces.forEach((v, i) => { corner[fill[v]++] = i; });

  const position = new Float32Array(faces.length * 3);
  const normal = new Float32Array(faces.length * 3);
  for (let i = 0; i < faces.length; ++i) {
    const v = faces[i];
    const own = 3 * Math.floor(i / 3);
    const [ox, oy, oz] = [normals[own], normals[own + 1], normals[own + 2]];
    let [x, y, z] = [0, 0, 0];
    for (let k = first[v]; k < first[v + 1]; ++k) {
      const other = 3 * Math.floor(corner[k] / 3);
      const dot = ox * normals[other] + oy * normals[other + 1] + oz * normals[other + 2];
      if (Math.abs(dot) < CREASE) continue;
      const sign = dot < 0 ? -1 : 1; // a soup's faces need not be oriented alike
      x += sign * normals[other];
      y += sign * normals[other + 1];
      z += sign * normals[other + 2];
    }
    const length = Math.hypot(x, y, z) || 1;
    for (let k = 0; k < 3; ++k) position[3 * i + k] = vertices[3 * v + k];
    normal[3 * i] = x / length;
    normal[3 * i + 1] = y / length;
    normal[3 * i + 2] = z / length;
  }
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(position, 3));
  geometry.setAttribute('normal', new THREE.BufferAttribute(normal, 3));
  return geometry;
}

/** Line segments of the edges with one face, more than two, or two that meet sharply. */
function sharpEdges({ vertices, faces }, normals) {
  const count = vertices.length / 3;
  const faceOf = new Map(); // edge -> its first face, or -1 once it is settled
  const sharp = [];
  for (let i = 0; i < faces.length; ++i) {
    const face = Math.floor(i / 3);
    const a = faces[i];
    const b = faces[3 * face + ((i + 1) % 3)];
    const key = Math.min(a, b) * count + Math.max(a, b);
    const before = faceOf.get(key);
    if (before === undefined) faceOf.set(key, face);
    else if (before >= 0) {
      const [m, n] = [3 * before, 3 * face];
      const dot = normals[m] * normals[n] + normals[m + 1] * normals[n + 1] + normals[m + 2] * normals[n + 2];
      if (Math.abs(dot) < SHARP) sharp.push(a, b);
      faceOf.set(key, -1);
    }
  }
  for (const [key, face] of faceOf) if (face >= 0) sharp.push(Math.floor(key / count), key % count);
  const position = new Float32Array(sharp.length * 3);
  sharp.forEach((v, i) => position.set(vertices.subarray(3 * v, 3 * v + 3), 3 * i));
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute('position', new THREE.BufferAttribute(position, 3));
  return geometry;
}

/** Where a plane (axis 0..2, at a position) cuts the triangles: line segments, segments x 2 x 3. */
function sectionCurve(meshes, axis, at) {
  const out = [];
  const cut = [0, 0, 0];
  for (const { vertices, faces } of meshes) {
    for (let i = 0; i < faces.length; i += 3) {
      let found = 0;
      for (let k = 0; k < 3 && found < 2; ++k) {
        const a = 3 * faces[i + k];
        const b = 3 * faces[i + ((k + 1) % 3)];
        const [da, db] = [vertices[a + axis] - at, vertices[b + axis] - at];
        if (da < 0 === db < 0) continue;
        const f = da / (da - db);
        for (let c = 0; c < 3; ++c) cut[c] = vertices[a + c] + f * (vertices[b + c] - vertices[a + c]);
        out.push(cut[0], cut[1], cut[2]);
        ++found;
      }
      if (found === 1) out.length -= 3;
    }
  }
  return new Float32Array(out);
}

/** Makes a surface seen through fade where it faces the viewer and stay where it turns away, like blown glass. */
function addRim(material, rim) {
  material.onBeforeCompile = (shader) => {
    shader.uniforms.rim = rim;
    shader.fragmentShader = shader.fragmentShader
      .replace('void main() {', 'uniform float rim;\nvoid main() {')
      .replace('#include <opaque_fragment>',
        `float facing = abs(dot(normalize(normal), normalize(vViewPosition)));
         diffuseColor.a *= mix(1.0, 0.22 + 1.6 * pow(1.0 - facing, 2.2), rim);
         #include <opaque_fragment>`);
  };
}

export class Obstacles extends THREE.Group {
  constructor(meshes) {
    super();
    this.meshes = meshes;
    this.planes = [];
    this.rim = { value: 0 };
    this.material = new THREE.MeshStandardMaterial({
      color: 0x98a3b1, roughness: 0.62, metalness: 0.18, side: THREE.DoubleSide,
      polygonOffset: true, polygonOffsetFactor: 1, polygonOffsetUnits: 1,
    });
    addRim(this.material, this.rim);
    this.edgeMaterial = new THREE.LineBasicMaterial({ color: 0x0c0e11, transparent: true, depthWrite: false });
    this.curveMaterial = new THREE.LineBasicMaterial({ color: 0xf4f6f8 });
    this.edges = new THREE.Group();
    this.bounds = new THREE.Box3();
    for (const mesh of meshes) {
      const normals = faceNormals(mesh);
      const geometry = creasedGeometry(mesh, normals);
      geometry.computeBoundingBox();
      this.bounds.union(geometry.boundingBox);
      const surface = new THREE.Mesh(geometry, this.material);
      surface.renderOrder = 2;
      const edges = new THREE.LineSegments(sharpEdges(mesh, normals), this.edgeMaterial);
      edges.renderOrder = 3;
      this.add(surface);
      this.edges.add(edges);
    }
    this.curve = new THREE.LineSegments(new THREE.BufferGeometry(), this.curveMaterial);
    this.curve.visible = false;
    this.curve.renderOrder = 4;
    this.add(this.edges, this.curve);
    this.setOpacity(1);
  }

  setOpacity(opacity) {
    const through = opacity < 0.995;
    this.material.opacity = opacity;
    if (this.material.transparent !== through) this.material.needsUpdate = true;
    this.material.transparent = through;
    this.material.depthWrite = opacity > 0.85; // nearly solid: what is in front hides
    this.rim.value = Math.min(1, (1 - opacity) / 0.25);
    this.edgeMaterial.color.set(through ? 0xb9c6d6 : 0x0c0e11);
    this.edgeMaterial.opacity = through ? 0.04 + 0.26 * opacity : 0.5;
    this.visible = opacity > 0;
  }

  setSmooth(smooth) {
    this.material.flatShading = !smooth;
    this.material.needsUpdate = true;
  }

  /** Cuts away one side of a plane across `axis` (0..2) at a position [m]; axis null: nothing is cut. */
  setSection(axis, at, flipped) {
    this.curve.visible = axis !== null;
    if (axis === null) {
      this.planes.length = 0;
    } else {
      const normal = new THREE.Vector3().setComponent(axis, flipped ? 1 : -1);
      this.planes.length = 0;
      this.planes.push(new THREE.Plane(normal, flipped ? -at : at));
      this.curve.geometry.dispose();
      this.curve.geometry = new THREE.BufferGeometry();
      this.curve.geometry.setAttribute('position', new THREE.BufferAttribute(sectionCurve(this.meshes, axis, at), 3));
    }
    for (const material of [this.material, this.edgeMaterial]) {
      material.clippingPlanes = this.planes.length ? this.planes : null;
      material.needsUpdate = true;
    }
  }
}
