// The page of `upt view`: shows the surface that the server streams, sends the tool that the mouse drags.
// What the two say to each other: protocol.rs.
import * as three from "./three.js";

const HEADER = 15;
const HALF_LENGTH = 25; // of the tool, mm
const PRESS = 250; // ms until the tool is at its depth
const PALE = new three.Color(0xd8bfb0);
const GREY = new three.Color(0x8f9399); // where the model was not trained to be touched
const RED = new three.Color(0xc8402a);

const at = (id) => document.getElementById(id);
const show = (id, text) => {
  at(id).textContent = text;
};

const renderer = new three.WebGLRenderer({ canvas: at("picture"), antialias: true });
const scene = new three.Scene();
scene.background = new three.Color(0x16181d);
const camera = new three.PerspectiveCamera(35, 1, 1, 5000);
camera.up.set(0, 0, 1);
const controls = new three.OrbitControls(camera, renderer.domElement);
const light = new three.DirectionalLight(0xffffff, 2.2);
scene.add(new three.AmbientLight(0xffffff, 0.9), light, camera);

let hello; // the server's first message
let surface; // as it is shown
let rest; // at rest and not shown: where the mouse finds its place
let restPositions;
let restColours;
let tool; // the capsule that is shown
let pressed; // {point, normal, since} while the tool is held
let sequence = 0;
let fresh = false; // a frame has come that is not shown yet
const sent = new Map(); // sequence: when, until it is seen
const pictures = []; // when the last ones were shown
const status = { frames: 0, shown: 0, largest: 0, force: 0, contacts: 0, latency: [], steps: 0 };
window.uptView = status; // for tests

const socket = new WebSocket(`ws://${location.host}/socket${location.search}`);
socket.binaryType = "arraybuffer";
const say = (message) => {
  if (socket.readyState === WebSocket.OPEN) socket.send(JSON.stringify(message));
};
socket.onmessage = ({ data }) => {
  if (typeof data === "string") {
    hello = JSON.parse(data);
    show("bundle", `${hello.bundle}, ${hello.node_count.toLocaleString("en")} nodes`);
    at("depth").max = hello.max_push_mm;
  } else if (!surface) {
    build(data);
  } else {
    take(data);
  }
};
socket.onclose = ({ reason }) => show("message", reason || "The connection is closed: run upt view again, or close its other page.");

function build(data) {
  const { surface_node_count: nodes, surface_face_count: faces } = hello;
  restPositions = new Float32Array(data, 0, 3 * nodes);
  const indices = new three.BufferAttribute(new Uint32Array(data, 12 * nodes, 3 * faces), 1);
  const geometry = (positions) => {
    const made = new three.BufferGeometry();
    made.setAttribute("position", new three.BufferAttribute(positions, 3));
    made.setIndex(indices);
    made.computeVertexNormals();
    made.computeBoundingSphere();
    return made;
  };
  const moving = geometry(restPositions.slice());
  const domain = new Uint32Array(data, 12 * (nodes + faces), nodes);
  restColours = new Float32Array(3 * nodes);
  const middle = new three.Vector3();
  for (let i = 0; i < nodes; i += 1) {
    (domain[i] ? PALE : GREY).toArray(restColours, 3 * i);
    if (domain[i]) middle.add(new three.Vector3().fromArray(restPositions, 3 * i));
  }
  middle.divideScalar(domain.reduce((sum, x) => sum + x, 0));
  moving.setAttribute("color", new three.BufferAttribute(restColours.slice(), 3));
  surface = new three.Mesh(moving, new three.MeshStandardMaterial({ vertexColors: true, roughness: 0.55 }));
  surface.frustumCulled = false;
  rest = new three.Mesh(geometry(restPositions), surface.material);
  tool = new three.Mesh(new three.CapsuleGeometry(1, 1), new three.MeshStandardMaterial({ color: 0x9fb4c8, metalness: 0.6, roughness: 0.35 }));
  tool.visible = false;
  scene.add(surface, tool);
  const { center, radius } = rest.geometry.boundingSphere;
  controls.target.copy(center);
  camera.position.copy(middle).sub(center).setLength(3.2 * radius).add(center); // the domain in front
  controls.update();
}

function take(data) {
  const words = new Uint32Array(data, 0, HEADER);
  const numbers = new Float32Array(data, 0, HEADER);
  const displacement = new Float32Array(data, 4 * HEADER);
  const positions = surface.geometry.attributes.position.array;
  const colours = surface.geometry.attributes.color.array;
  const most = 0.8 * hello.max_push_mm;
  for (let i = 0; i < displacement.length; i += 3) {
    const [x, y, z] = [displacement[i], displacement[i + 1], displacement[i + 2]];
    positions[i] = restPositions[i] + x;
    positions[i + 1] = restPositions[i + 1] + y;
    positions[i + 2] = restPositions[i + 2] + z;
    const share = Math.min(Math.sqrt(x * x + y * y + z * z) / most, 1);
    colours[i] = restColours[i] + share * (RED.r - restColours[i]);
    colours[i + 1] = restColours[i + 1] + share * (RED.g - restColours[i + 1]);
    colours[i + 2] = restColours[i + 2] + share * (RED.b - restColours[i + 2]);
  }
  status.frames += 1;
  status.sequence = words[0];
  status.contacts = words[2];
  status.recording = (words[3] & 1) !== 0;
  status.replaying = (words[3] & 2) !== 0;
  status.stepMs = numbers[4];
  status.force = Math.hypot(numbers[6], numbers[7], numbers[8]);
  status.largest = numbers[9];
  status.waited = numbers[10];
  status.steps = words[11];
  fresh = true;
  show("step", `${numbers[4].toFixed(2)} ms`);
  show("indicator", numbers[5].toFixed(2));
  show("force", `${status.force.toFixed(0)} mN`);
  status.penetration = numbers[14];
  show("corrections", words[12] > 0 ? `${words[12]}, ± ${numbers[13].toFixed(3)} mm` : "none");
  show("penetration", `${numbers[14].toFixed(2)} mm`);
  show("largest", `${numbers[9].toFixed(1)} mm`);
  show("contacts", words[2]);
  show("record", status.recording ? "Stop" : "Record");
  const raised = hello.flags.filter(([bit]) => (words[1] & bit) !== 0).map(([, name]) => name);
  show("flags", raised.join(", "));
}

// The tool: its tip `depth` below the place at rest that the mouse points at, its axis along the normal there.
function pose(now) {
  const ramp = Math.min((now - pressed.since) / PRESS, 1);
  const radius = Number(at("radius").value);
  const up = HALF_LENGTH + radius - ramp * Number(at("depth").value);
  const position = pressed.point.clone().addScaledVector(pressed.normal, up);
  const rotation = new three.Quaternion().setFromUnitVectors(new three.Vector3(0, 1, 0), pressed.normal);
  return { position, rotation, radius, ramp };
}

function sendTool(now) {
  sequence += 1;
  if (!pressed) {
    tool.visible = false;
    say({ tool: null, sequence });
    return;
  }
  const { position, rotation, radius } = pose(now);
  if (tool.userData.radius !== radius) {
    tool.geometry.dispose();
    tool.geometry = new three.CapsuleGeometry(radius, 2 * HALF_LENGTH, 8, 24);
    tool.userData.radius = radius;
  }
  tool.position.copy(position);
  tool.quaternion.copy(rotation);
  tool.visible = true;
  sent.set(sequence, performance.now());
  say({
    tool: {
      position: position.toArray(),
      rotation: rotation.toArray(),
      radius,
      half_length: HALF_LENGTH,
      sticking: at("sticking").checked,
    },
    sequence,
  });
}

const ray = new three.Raycaster();
function place(event) {
  const frame = renderer.domElement.getBoundingClientRect();
  const x = (2 * (event.clientX - frame.left)) / frame.width - 1;
  const y = 1 - (2 * (event.clientY - frame.top)) / frame.height;
  ray.setFromCamera(new three.Vector2(x, y), camera);
  const [hit] = rest ? ray.intersectObject(rest) : [];
  if (!hit) return null;
  // The mean normal of the face's corners: smoother than the face's own while sliding.
  const normals = rest.geometry.attributes.normal;
  const normal = new three.Vector3();
  for (const corner of [hit.face.a, hit.face.b, hit.face.c]) normal.add(new three.Vector3().fromBufferAttribute(normals, corner));
  return { point: hit.point, normal: normal.normalize() };
}

const canvas = renderer.domElement;
canvas.addEventListener(
  "pointerdown",
  (event) => {
    const found = event.button === 0 && place(event);
    if (!found) return;
    event.stopImmediatePropagation(); // the camera stays
    canvas.setPointerCapture(event.pointerId);
    pressed = { ...found, since: performance.now() };
  },
  { capture: true },
);
canvas.addEventListener("pointermove", (event) => {
  if (!pressed) return;
  const found = place(event);
  if (found) Object.assign(pressed, found);
  sendTool(performance.now());
});
const lift = () => {
  if (!pressed) return;
  pressed = null;
  sendTool(performance.now());
};
canvas.addEventListener("pointerup", lift);
canvas.addEventListener("pointercancel", lift);

for (const id of ["depth", "radius"]) {
  const label = () => {
    at(id).nextElementSibling.textContent = `${at(id).value} mm`;
  };
  at(id).addEventListener("input", label);
  label();
}
at("reset").addEventListener("click", () => say({ reset: true }));
at("record").addEventListener("click", () => say({ record: !status.recording }));
at("replay").addEventListener("click", () => say({ replay: true }));
at("save").addEventListener("click", () => {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([gltf()], { type: "model/gltf+json" }));
  link.download = `${hello.bundle}.gltf`;
  link.click();
});

// The surface as it is shown, in glTF's frame: metres, y up.
function gltf() {
  const { position, normal } = surface.geometry.attributes;
  const indices = surface.geometry.index.array;
  const turned = (source, scale) => {
    const out = new Float32Array(source.length);
    for (let i = 0; i < source.length; i += 3) {
      out[i] = scale * source[i];
      out[i + 1] = scale * source[i + 2];
      out[i + 2] = -scale * source[i + 1];
    }
    return out;
  };
  const parts = [turned(position.array, 1e-3), turned(normal.array, 1), new Uint32Array(indices)];
  const bounds = (pick) => [0, 1, 2].map((axis) => parts[0].reduce((found, x, i) => (i % 3 === axis ? pick(found, x) : found), pick === Math.min ? Infinity : -Infinity));
  let offset = 0;
  const views = parts.map((part) => {
    const view = { buffer: 0, byteOffset: offset, byteLength: part.byteLength };
    offset += part.byteLength;
    return view;
  });
  const bytes = new Uint8Array(offset);
  parts.forEach((part, i) => bytes.set(new Uint8Array(part.buffer), views[i].byteOffset));
  let text = "";
  for (let i = 0; i < bytes.length; i += 0x8000) text += String.fromCharCode(...bytes.subarray(i, i + 0x8000));
  const vectors = (bufferView, more) => ({ bufferView, componentType: 5126, count: position.count, type: "VEC3", ...more });
  return JSON.stringify({
    asset: { version: "2.0", generator: "upt view" },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0, name: hello.bundle }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0, NORMAL: 1 }, indices: 2 }] }],
    accessors: [
      vectors(0, { min: bounds(Math.min), max: bounds(Math.max) }),
      vectors(1),
      { bufferView: 2, componentType: 5125, count: indices.length, type: "SCALAR" },
    ],
    bufferViews: views,
    buffers: [{ byteLength: bytes.length, uri: `data:application/octet-stream;base64,${btoa(text)}` }],
  });
}
status.gltf = gltf;

renderer.setAnimationLoop((now) => {
  const { clientWidth: width, clientHeight: height } = canvas;
  if (canvas.width !== width || canvas.height !== height) {
    renderer.setSize(width, height, false);
    camera.aspect = width / height;
    camera.updateProjectionMatrix();
  }
  if (pressed && now - pressed.since < PRESS + 100) sendTool(now); // until it is pressed in
  if (fresh) {
    fresh = false;
    surface.geometry.attributes.position.needsUpdate = true;
    surface.geometry.attributes.color.needsUpdate = true;
    surface.geometry.computeVertexNormals();
    // The pose whose step is shown now: how long ago the mouse was there, less what it waited for its turn.
    const since = sent.get(status.sequence);
    if (since !== undefined) {
      for (const old of sent.keys()) if (old <= status.sequence) sent.delete(old);
      status.latency.push(Math.max(performance.now() - since - status.waited, 0));
      if (status.latency.length > 120) status.latency.shift();
      const sorted = [...status.latency].sort((a, b) => a - b);
      show("latency", `${sorted[sorted.length >> 1].toFixed(0)} ms`);
    }
    pictures.push(now);
    while (pictures[0] < now - 2000) pictures.shift();
    status.rate = (1000 * (pictures.length - 1)) / Math.max(now - pictures[0], 1);
    show("rate", `${status.rate.toFixed(0)} /s`);
    status.shown += 1;
  }
  light.position.copy(camera.position);
  controls.update();
  renderer.render(scene, camera);
});
