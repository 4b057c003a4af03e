// Reads the data that the C++ side (src/tendril/viewer/page.cpp) put into the page. Arrays are base64, little-endian.

function bytes(base64) {
  const text = atob(base64);
  const out = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) out[i] = text.charCodeAt(i);
  return out.buffer;
}

const float32 = (base64) => new Float32Array(bytes(base64));
const float64 = (base64) => new Float64Array(bytes(base64));
const uint32 = (base64) => new Uint32Array(bytes(base64));

/** Shapes of a rod: positions [m] (states x nodes x 3), unit quaternions x y z w times 32767 (states x nodes x 4). */
function shapes(encoded) {
  return {
    states: encoded.states,
    nodes: encoded.nodes,
    positions: float32(encoded.positions),
    rotations: new Int16Array(bytes(encoded.rotations)),
  };
}

/** The whole data of a page; see docs in page.cpp for every key. Throws if the page holds none. */
export function readData(text) {
  if (!text.trim()) throw new Error('This page holds no motion. Write one with: tendril view SOLUTION');
  const raw = JSON.parse(text);
  return {
    ...raw,
    meshes: raw.meshes.map((mesh) => ({
      name: mesh.name,
      vertices: float32(mesh.vertices), // vertices x 3, m
      faces: uint32(mesh.faces), // faces x 3
    })),
    trajectory: {
      ...shapes(raw.trajectory),
      times: float64(raw.trajectory.time_s),
      held: new Uint8Array(bytes(raw.trajectory.held)), // bit 0: first, bit 1: last
      gaps: float32(raw.trajectory.gap_m), // infinite beyond the reach of the search
    },
    goal: { ...raw.goal, shape: raw.goal.shape && shapes(raw.goal.shape) },
    contacts: {
      reach_m: raw.contacts.reach_m, // gaps are known up to this
      stride: raw.contacts.stride, // every how many states they were looked for
      offsets: uint32(raw.contacts.offsets), // contacts of the k-th of those states: offsets[k] to offsets[k + 1]
      points: float32(raw.contacts.points), // on the obstacles, m
    },
  };
}
