// The page of `upt view` and of `cargo xtask site`: shows the surface that comes over the connection, sends the tool that the mouse drags.
// What the two say to each other: protocol.rs. Each picture has one frame, asked for as late as it can be, so that it shows where the
// mouse and the tissue are now.
import * as three from "./three.js";
import { makeRenderer, software, whenDrawn } from "./drawing.js";
import { connect } from "./connection.js";
import { gltf } from "./gltf.js";
import { HALF_LENGTH, Hand } from "./hand.js";
import { Hanging, KINDS, ShownTool, radiusOf } from "./instruments.js";
import { Organ } from "./organ.js";
import { ForcePlot } from "./plot.js";

const HEADER = 36;
const READOUTS = 250; // ms between two of the readouts
const AHEAD = 2; // frames that are asked for and have not come
const OFTEN = 0.998; // of the frames come in time for their picture
const LATEST = 0.85; // of a picture: its frame is asked for once the last picture is on its way, with all that the mouse has done until then
const KEPT = 600; // frames by which that is judged
const FEWEST = 60; // by which it can be
// Of UPT_FLAG_*, from the first bit on.
const FLAGS = [
  "push longer than trained",
  "contact area not trained",
  "contact outside the domain",
  "faster than trained",
  "several contacts",
  "guard: bound",
  "guard: not finite",
  "guard: inverted",
  "guard: growth",
  "correction bounded",
  "contact regularised",
  "corrections given up",
  "error above the limit",
  "tool deep in the tissue",
  "contact not solved",
];
const LIMIT = 1.4; // stretch at which tissue tears
const REFUSED = 4000; // ms for which a refusal is shown

const at = (id) => document.getElementById(id);
const show = (id, text) => {
  if (at(id).textContent !== text) at(id).textContent = text;
};

const renderer = makeRenderer(at("picture"));
const scene = new three.Scene();
scene.background = new three.Color(0x16181d);
const camera = new three.PerspectiveCamera(35, 1, 1, 5000);
camera.up.set(0, 0, 1);
const controls = new three.OrbitControls(camera, renderer.domElement);
const light = new three.DirectionalLight(0xffffff, 2.2);
scene.add(new three.AmbientLight(0xffffff, 0.9), light, camera);

let hello; // the server's first message
let organ; // what is shown
let kind = "press"; // what the mouse holds
const tool = new ShownTool(scene);
const hanging = new Hanging(scene);
let pointer; // {x, y, last} while the tool is held: where the mouse is, since when
let moves = []; // when it moved since a frame was asked for
let hand; // while the tool is held
const plot = new ForcePlot(at("plot"));
let sequence = 0;
let latest; // the frame that has come and is not shown yet
let told = 0; // when the readouts were written
let lead = 12; // ms before a picture at which its frame is asked for
let due = 0; // when the page asks for it
const needs = []; // ms from there until it had come, of the last frames
let interval = 1000 / 60; // ms from picture to picture
let before = 0; // when the last picture was begun
let timer; // asks for the next frame
let sent = []; // {sequence, due, moves} of the frames that are asked for, until they are seen
const pictures = []; // when the last ones were shown
const status = { drawn: 0, shown: 0, surfaces: 0, largest: 0, force: 0, contacts: 0, latency: [], made: [], intervals: [], stepTimes: [], forces: [], steps: 0, sequence: 0, software };
window.uptView = status; // for tests

const say = connect({
  hello: (said) => {
    hello = said;
    show("bundle", `${hello.bundle}, ${hello.node_count.toLocaleString("en")} nodes`);
    show("message", "");
    at("depth").max = hello.max_push_mm;
  },
  geometry: build,
  surface: (changed, data) => {
    organ.take(changed, data);
    status.surfaces += 1;
  },
  refused: (why) => {
    show("message", why);
    setTimeout(() => show("message", ""), REFUSED);
  },
  frame: (data) => {
    latest = data;
    const [came] = new Uint32Array(data, 0, 1);
    const asked = sent.find((one) => one.sequence === came);
    if (asked) needs.push(performance.now() - asked.due);
    if (needs.length > KEPT) needs.shift();
  },
  tell: (text) => show("message", text),
});

function build(data) {
  const { surface_node_count: nodes, surface_face_count: faces } = hello;
  const rest = new Float32Array(data, 0, 3 * nodes);
  const domain = new Uint32Array(data, 12 * (nodes + faces), nodes);
  organ = new Organ(rest, new Uint32Array(data, 12 * nodes, 3 * faces), domain);
  scene.add(...organ.shown);
  at("tools").hidden = !hello.presents;
  const { center, radius } = organ.picked.geometry.boundingSphere;
  controls.target.copy(center);
  camera.position.copy(Organ.middle(rest, domain)).sub(center).setLength(3.2 * radius).add(center); // the domain in front
  controls.update();
}

// The frame that has come, into the surface and the tool.
function take(data) {
  const words = new Uint32Array(data, 0, HEADER);
  const numbers = new Float32Array(data, 0, HEADER);
  // One of the surface before is skipped.
  if (!organ.move(new Float32Array(data, 4 * HEADER), 0.8 * hello.max_push_mm)) return;
  status.sequence = words[0];
  status.flags = words[1];
  status.contacts = words[2];
  status.recording = (words[3] & 1) !== 0;
  status.replaying = (words[3] & 2) !== 0;
  status.stepMs = numbers[4];
  status.indicator = numbers[5];
  status.force = Math.hypot(numbers[6], numbers[7], numbers[8]);
  status.largest = numbers[9];
  status.frameMs = numbers[10];
  status.steps = words[11];
  status.corrections = words[12];
  status.errorMm = numbers[13];
  status.penetration = numbers[14];
  status.kind = KINDS[words[24]];
  status.area = numbers[25];
  status.removed = numbers[26];
  status.copies = words[27];
  status.undos = words[28];
  at("undo").disabled = status.undos === 0; // at once: a stroke is undone as soon as it is seen
  status.changeMs = numbers[29];
  status.height = numbers[30];
  status.ball = numbers[34];
  status.torn = words[35];
  organ.lift(status.height);
  hanging.place(numbers.subarray(31, 35));
  if (words[15] === 0) tool.hide();
  else tool.place(words[24], numbers.subarray(16));
}

function readOut() {
  show("step", `${status.stepMs.toFixed(2)} ms`);
  show("indicator", status.indicator.toFixed(2));
  show("force", `${status.force.toFixed(0)} mN`);
  show("corrections", status.corrections > 0 ? `${status.corrections}, ± ${status.errorMm.toFixed(3)} mm` : "none");
  show("penetration", `${status.penetration.toFixed(2)} mm`);
  show("largest", `${status.largest.toFixed(1)} mm`);
  show("contacts", String(status.contacts));
  show("record", status.recording ? "Stop" : "Record");
  if (kind !== "press" || status.undos > 0) at("wound").hidden = false;
  show("area", `${(status.area / 100).toFixed(2)} cm²`);
  show("removed", `${(status.removed / 1000).toFixed(2)} cm³`);
  show("copies", String(status.copies));
  at("hanging").hidden = status.ball === 0;
  show("torn", String(status.torn));
  show("change", `${status.changeMs.toFixed(1)} ms`);
  const raised = FLAGS.filter((_, bit) => (status.flags & (1 << bit)) !== 0);
  show("flags", raised.join(", "));
  if (status.rate) show("rate", `${status.rate.toFixed(0)} /s`);
  if (status.latency.length > 0) {
    const sorted = status.latency.slice(-200).sort((a, b) => a - b);
    show("latency", `${sorted[sorted.length >> 1].toFixed(0)} ms`);
  }
}

// The frame of the next picture is asked for as late as most of the last ones could have been.
function askInTime(now) {
  const passed = Math.min(now - before, 50);
  before = now;
  interval += (passed < interval ? 0.5 : 0.01) * (passed - interval);
  if (needs.length >= FEWEST) {
    const sorted = [...needs].sort((a, b) => a - b);
    lead = Math.min(Math.max(sorted[Math.floor(OFTEN * sorted.length)] + 0.5, 2), LATEST * interval);
  }
  clearTimeout(timer);
  due = now + interval - lead;
  const wait = due - performance.now();
  if (wait < 1) ask();
  else timer = setTimeout(ask, wait);
}

// Asks for the next frame, with the tool where it is now.
function ask() {
  if (sequence - status.sequence >= AHEAD) return;
  sequence += 1;
  const moved = hand ? moves : [];
  moves = [];
  sent.push({ sequence, due, moves: moved });
  if (!hand) {
    say({ tool: null, sequence });
    return;
  }
  const now = performance.now();
  const grasp = kind === "press" && at("grasp").checked && hand.pressed(status.steps);
  status.grasp = grasp;
  if (moved.length > 0) {
    const found = grasp ? pulled(pointer) : place(pointer);
    if (found) hand.aim(found);
  }
  const radius = radiusOf(kind, Number(at("radius").value));
  const pose = hand.pose(now, { depth: Number(at("depth").value), radius, grasp });
  say({ tool: { ...pose, radius, half_length: HALF_LENGTH, friction: Number(at("friction").value), grasp, kind }, sequence });
}

const ray = new three.Raycaster();
function look({ x: left, y: top }) {
  const frame = renderer.domElement.getBoundingClientRect();
  const x = (2 * (left - frame.left)) / frame.width - 1;
  const y = 1 - (2 * (top - frame.top)) / frame.height;
  ray.setFromCamera(new three.Vector2(x, y), camera);
}

// Where the mouse points, of the tissue at rest.
function place(where) {
  look(where);
  const [hit] = organ ? ray.intersectObject(organ.picked) : [];
  if (!hit) return null;
  // The mean normal of the face's corners: smoother than the face's own while sliding.
  const normals = organ.picked.geometry.attributes.normal;
  const normal = new three.Vector3();
  for (const corner of [hit.face.a, hit.face.b, hit.face.c]) normal.add(new three.Vector3().fromBufferAttribute(normals, corner));
  return { point: hit.point, normal: normal.normalize() };
}

// Where a tool that has taken hold is pulled to: with the mouse, at the distance at which it took hold.
function pulled(where) {
  look(where);
  const away = camera.getWorldDirection(new three.Vector3());
  const distance = hand.point.clone().sub(ray.ray.origin).dot(away) / ray.ray.direction.dot(away);
  return { point: ray.ray.at(distance, new three.Vector3()), normal: hand.normal.clone() };
}

const canvas = renderer.domElement;
const where = ({ clientX: x, clientY: y, timeStamp: last, pointerId: id }) => ({ x, y, last, id });
canvas.addEventListener(
  "pointerdown",
  (event) => {
    const found = event.button === 0 && !hand && place(where(event));
    if (hand || found) event.stopImmediatePropagation(); // the camera stays
    if (!found) return;
    canvas.setPointerCapture(event.pointerId);
    pointer = where(event);
    moves = [event.timeStamp];
    hand = new Hand(found, performance.now());
  },
  { capture: true },
);
// The raw events come at once, the others wait for the next picture.
for (const kind of ["pointerrawupdate", "pointermove"]) {
  canvas.addEventListener(kind, (event) => {
    if (!hand || event.pointerId !== pointer.id || event.timeStamp <= pointer.last) return;
    const times = (event.getCoalescedEvents?.() ?? []).map((one) => one.timeStamp).filter((when) => when > pointer.last);
    moves.push(...(times.length > 0 ? times : [event.timeStamp]));
    pointer = where(event);
  });
}
const lift = ({ pointerId }) => {
  if (pointerId === pointer?.id) hand = null;
};
canvas.addEventListener("pointerup", lift);
canvas.addEventListener("pointercancel", lift);

for (const [id, unit] of [["depth", " mm"], ["radius", " mm"], ["friction", ""]]) {
  const label = () => {
    at(id).nextElementSibling.textContent = `${at(id).value}${unit}`;
  };
  at(id).addEventListener("input", label);
  label();
}
at("reset").addEventListener("click", () => {
  at("breathe").setAttribute("aria-pressed", "false");
  say({ reset: true });
});
at("breathe").addEventListener("click", () => {
  const on = at("breathe").getAttribute("aria-pressed") !== "true";
  at("breathe").setAttribute("aria-pressed", String(on));
  say({ breathe: on });
});
at("tear").addEventListener("click", () => {
  const on = at("tear").getAttribute("aria-pressed") !== "true";
  at("tear").setAttribute("aria-pressed", String(on));
  say({ tear: on ? LIMIT : 0 });
});
at("undo").addEventListener("click", () => say({ undo: true }));
addEventListener("keydown", (event) => {
  if ((event.ctrlKey || event.metaKey) && event.key === "z") at("undo").click();
});
const choices = at("tools").querySelectorAll("[data-kind]");
for (const button of choices) {
  button.addEventListener("click", () => {
    kind = button.dataset.kind;
    for (const other of choices) other.setAttribute("aria-pressed", String(other === button));
  });
}
at("record").addEventListener("click", () => say({ record: !status.recording }));
at("replay").addEventListener("click", () => {
  at("breathe").setAttribute("aria-pressed", "false");
  say({ replay: true });
});
status.nodes = () => hello.node_count;
status.dt = () => 1000 * hello.dt;
status.gltf = () => gltf(organ.whole, hello.bundle);
at("save").addEventListener("click", () => {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([status.gltf()], { type: "model/gltf+json" }));
  link.download = `${hello.bundle}.gltf`;
  link.click();
});

const keep = (list, value) => {
  list.push(value);
  if (list.length > 10000) list.shift();
};

// When the mouse moved that this picture is the first to show.
function seen() {
  const times = sent.filter((old) => old.sequence <= status.sequence).flatMap((old) => old.moves);
  sent = sent.filter((old) => old.sequence > status.sequence);
  return times;
}

// The organ in the middle of what the panel leaves free, beside it or, on a narrow page, above it.
function lookBesidePanel(width, height) {
  const panel = at("panel").getBoundingClientRect();
  const below = panel.width > 0.6 * width;
  const [wide, high] = below ? [width, panel.top] : [width - panel.right, height];
  camera.aspect = width / height;
  // A narrow part shows the organ smaller: at the start it is about as wide as the page is high.
  camera.zoom = Math.min(high / height, wide / (1.05 * height));
  status.middle = [Math.round(width - wide / 2), Math.round(high / 2)];
  camera.setViewOffset(width, height, (wide - width) / 2, (height - high) / 2, width, height);
  camera.updateProjectionMatrix();
}

let panelHeight; // as the picture knows it
renderer.setAnimationLoop((now) => {
  const { clientWidth: width, clientHeight: height } = canvas;
  const size = renderer.getSize(new three.Vector2());
  if (size.x !== width || size.y !== height) renderer.setSize(width, height, false);
  if (size.x !== width || size.y !== height || at("panel").clientHeight !== panelHeight) lookBesidePanel(width, height);
  panelHeight = at("panel").clientHeight;
  if (!organ) return;
  status.drawn += 1;
  const data = latest;
  latest = undefined;
  if (data) take(data);
  askInTime(now);
  light.position.copy(camera.position);
  controls.update();
  renderer.render(scene, camera);
  if (!data) return;
  const times = seen();
  const drawn = (then) => times.forEach((when) => keep(status.latency, then - when));
  if (status.finish) whenDrawn(renderer, drawn);
  else drawn(performance.now());
  keep(status.made, status.frameMs);
  keep(status.stepTimes, status.stepMs);
  keep(status.forces, status.force);
  if (pictures.length > 0) keep(status.intervals, now - pictures[pictures.length - 1]);
  pictures.push(now);
  while (pictures[0] < now - 2000) pictures.shift();
  status.rate = (1000 * (pictures.length - 1)) / Math.max(now - pictures[0], 1);
  status.shown += 1;
  plot.add(now, status.force);
  plot.draw(now);
  if (now - told > READOUTS) {
    told = now;
    readOut();
  }
});
