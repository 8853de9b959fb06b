// The page of `upt make --preview`, of certificates and reports: one organ, coloured by what is known of it, and a contact that plays.
const at = (id) => document.getElementById(id);
const data = JSON.parse(at("data").textContent);
const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
const floats = (text) => new Float32Array(bytes(text));
const positions = floats(data.positions);
const faces = new Uint32Array(bytes(data.faces));
const held = floats(data.held);
const domain = floats(data.domain);

const renderer = new three.WebGLRenderer({ canvas: at("picture"), antialias: true, preserveDrawingBuffer: true });
const scene = new three.Scene();
scene.background = new three.Color(0x16181d);
const camera = new three.PerspectiveCamera(35, 1, 0.1, 20000);
camera.up.set(0, 0, 1);
const controls = new three.OrbitControls(camera, renderer.domElement);
const light = new three.DirectionalLight(0xffffff, 2.2);
scene.add(new three.AmbientLight(0xffffff, 0.9), light, camera);

// Three corners of its own a face, so that a face has one colour and flat light.
const corners = new Float32Array(3 * faces.length);
faces.forEach((node, i) => corners.set(positions.subarray(3 * node, 3 * node + 3), 3 * i));
const geometry = new three.BufferGeometry();
geometry.setAttribute("position", new three.BufferAttribute(corners, 3));
geometry.setAttribute("color", new three.BufferAttribute(new Float32Array(corners.length), 3));
geometry.computeVertexNormals();
geometry.computeBoundingSphere();
const organ = new three.Mesh(geometry, new three.MeshStandardMaterial({ vertexColors: true, roughness: 0.65 }));
scene.add(organ);
const marker = new three.Mesh(new three.CapsuleGeometry(1, 0.01), new three.MeshStandardMaterial({ color: 0xf2b84b }));
marker.visible = false;
scene.add(marker);
const { center, radius } = geometry.boundingSphere;
controls.target.copy(center);
camera.position.copy(center).add(new three.Vector3(1.6, -2.4, 1.4).setLength(3.4 * radius));
marker.scale.setScalar(0.02 * radius);
controls.update();

const PALE = new three.Color(0xd8bfb0);
const GREY = new three.Color(0x7d828b);
const BLUE = new three.Color(0x3f6fd0);
const SCALE = [0x2b3a67, 0x2f8f8b, 0xe3c567, 0xc8402a].map((colour) => new three.Color(colour));
function ramp(share) {
  const place = Math.min(Math.max(share, 0), 1) * (SCALE.length - 1);
  const index = Math.min(Math.floor(place), SCALE.length - 2);
  const part = place - index;
  const [a, b] = [SCALE[index], SCALE[index + 1]];
  return [a.r + part * (b.r - a.r), a.g + part * (b.g - a.g), a.b + part * (b.b - a.b)];
}
const count = faces.length / 3;
const heldCorners = (face) => held[faces[3 * face]] + held[faces[3 * face + 1]] + held[faces[3 * face + 2]];
const choices = [
  { name: "held: blue; touched: pale", colour: (face) => (heldCorners(face) === 3 ? BLUE : domain[face] ? PALE : GREY).toArray() },
];
// A list of a number a face (or a corner), with its range.
function numbers(name, list, corner, format) {
  let [low, high] = [Infinity, -Infinity];
  for (const value of list) {
    low = Math.min(low, value);
    high = Math.max(high, value);
  }
  if (corner) low = 0;
  const width = high - low || 1;
  choices.push({ name, low: format(low), high: format(high), colour: (face, i) => ramp((list[corner ? faces[i] : face] - low) / width) });
}
if (data.error) numbers("error in contact, mm (RMS)", floats(data.error), true, (x) => x.toPrecision(2));
numbers("smallest angle of elements, °", floats(data.quality), false, (x) => x.toFixed(1));
numbers("stiffness over the material's", floats(data.stiffness), false, (x) => x.toPrecision(3));

function paint(choice) {
  const colours = geometry.attributes.color;
  for (let i = 0; i < faces.length; i += 1) colours.array.set(choice.colour(Math.floor(i / 3), i), 3 * i);
  colours.needsUpdate = true;
  at("legend").hidden = choice.low === undefined;
  at("legend").style.display = choice.low === undefined ? "none" : "grid";
  at("low").textContent = choice.low ?? "";
  at("high").textContent = choice.high ?? "";
}

// The film: displacements and errors of the surface's nodes, frame by frame; between frames in proportion.
const film = data.film && data.film.count > 1 ? data.film : null;
const nodes = positions.length / 3;
const moved = new Float32Array(film ? positions.length : 0);
const errors = new Float32Array(film ? nodes : 0);
let [time, playing, shown] = [0, Boolean(film), -1];
// Shown through the organ: the site is often in a dent.
const seen = { color: 0xffffff, transparent: true, opacity: 0.75, depthTest: false };
const touch = new three.Mesh(new three.CapsuleGeometry(1, 0.01), new three.MeshStandardMaterial(seen));
touch.visible = false;
scene.add(touch);
// Steel bodies that follow their poses.
const tools = (film?.tools ?? []).map(({ points, faces: corners, poses }) => {
  const made = new three.BufferGeometry();
  made.setAttribute("position", new three.BufferAttribute(new Float32Array(points), 3));
  made.setIndex(corners);
  made.computeVertexNormals();
  const steel = new three.MeshStandardMaterial({ color: 0xdde3ea, metalness: 0.1, roughness: 0.5, transparent: true, opacity: 0.85 });
  const mesh = new three.Mesh(made, steel);
  scene.add(mesh);
  return { mesh, poses };
});
const turn = new three.Quaternion();
if (film) {
  film.moved = new Int16Array(bytes(film.moved));
  film.error = new Uint8Array(bytes(film.error));
  const high = (largest) => 0.75 * largest; // The largest is at a few nodes.
  const lengths = (face, i) => Math.hypot(...moved.subarray(3 * faces[i], 3 * faces[i] + 3)) / high(film.largest_moved_mm);
  const wrong = (face, i) => errors[faces[i]] / high(film.largest_error_mm);
  choices.push(
    { name: "displacement now, mm", low: "0", high: high(film.largest_moved_mm).toPrecision(2), colour: (face, i) => ramp(lengths(face, i)), plays: true },
    { name: "error now, mm", low: "0", high: high(film.largest_error_mm).toPrecision(2), colour: (face, i) => ramp(wrong(face, i)), plays: true },
  );
  at("film").hidden = false;
  at("title").textContent = film.title;
  at("place").max = film.count - 1;
  touch.scale.setScalar(0.025 * radius);
  // From where most of it is touched.
  const towards = new three.Vector3();
  for (const place of film.touched) if (place) towards.add(new three.Vector3(...place).sub(center));
  for (const [x, y, z] of tools.flatMap((tool) => tool.poses)) towards.add(new three.Vector3(x, y, z).sub(center));
  if (towards.length() > 0) {
    towards.normalize().addScaledVector(camera.up, 0.3);
    // A tool is not seen along its shaft.
    if (tools.length > 0) towards.addScaledVector(new three.Vector3().crossVectors(towards, camera.up), 0.8);
    camera.position.copy(center).add(towards.setLength(3.4 * radius));
    controls.update();
  }
}
function show(place) {
  if (place === shown) return;
  shown = place;
  const first = Math.min(Math.floor(place), film.count - 2);
  const part = place - first;
  const [a, b] = [first * nodes, (first + 1) * nodes];
  const [unit, small] = [film.largest_moved_mm / 32767, film.largest_error_mm / 255];
  for (let i = 0; i < moved.length; i += 1) moved[i] = unit * ((1 - part) * film.moved[3 * a + i] + part * film.moved[3 * b + i]);
  for (let i = 0; i < nodes; i += 1) errors[i] = small * ((1 - part) * film.error[a + i] + part * film.error[b + i]);
  faces.forEach((node, i) => {
    for (let k = 0; k < 3; k += 1) corners[3 * i + k] = positions[3 * node + k] + moved[3 * node + k];
  });
  geometry.attributes.position.needsUpdate = true;
  geometry.computeVertexNormals();
  const [from, to] = [film.touched[first], film.touched[first + 1]];
  touch.visible = Boolean(from && to);
  if (touch.visible) touch.position.set(...from.map((x, k) => (1 - part) * x + part * to[k]));
  for (const { mesh, poses } of tools) {
    const [before, after] = [poses[first], poses[first + 1]];
    mesh.position.set(...[0, 1, 2].map((k) => (1 - part) * before[k] + part * after[k]));
    mesh.quaternion.set(...before.slice(3)).slerp(turn.set(...after.slice(3)), part);
  }
  const choice = choices[at("choice").value];
  if (choice.plays) paint(choice);
  at("time").textContent = `${(place * film.step_s).toFixed(2)} s`;
  if (document.activeElement !== at("place") || playing) at("place").value = place;
}
function play(now) {
  playing = now;
  at("play").textContent = playing ? "❚❚" : "▶";
}
at("play").addEventListener("click", () => play(!playing));
at("place").addEventListener("input", () => {
  play(false);
  time = Number(at("place").value) * film.step_s;
});
at("bar").style.background = `linear-gradient(90deg, ${SCALE.map((colour) => `#${colour.getHexString()}`).join(", ")})`;
choices.forEach((choice, i) => at("choice").add(new Option(choice.name, i)));
at("choice").addEventListener("change", () => paint(choices[at("choice").value]));
at("choice").value = film ? choices.findIndex((choice) => choice.plays) : data.error ? 1 : 0;
paint(choices[at("choice").value]);
at("name").textContent = data.name;
document.title = data.name;
if (data.pick) at("hint").textContent += " Click on the organ for coordinates:";
for (const [name, value] of data.facts) {
  for (const [tag, text] of [["dt", name], ["dd", value]]) {
    const made = document.createElement(tag);
    made.textContent = text;
    at("facts").append(made);
  }
}

const ray = new three.Raycaster();
let down;
renderer.domElement.addEventListener("pointerdown", (event) => {
  down = [event.clientX, event.clientY];
});
renderer.domElement.addEventListener("pointerup", (event) => {
  if (!data.pick || !down || Math.hypot(event.clientX - down[0], event.clientY - down[1]) > 4) return;
  const frame = renderer.domElement.getBoundingClientRect();
  const x = (2 * (event.clientX - frame.left)) / frame.width - 1;
  const y = 1 - (2 * (event.clientY - frame.top)) / frame.height;
  ray.setFromCamera(new three.Vector2(x, y), camera);
  const [hit] = ray.intersectObject(organ);
  if (!hit) return;
  marker.position.copy(hit.point);
  marker.visible = true;
  const place = hit.point.toArray().map((value) => (Math.round(10 * value) / 10).toString());
  const size = (Math.round(2.5 * radius) / 10).toString();
  at("picked").replaceChildren(
    ...["--fixed", "--domain"].map((flag) => {
      const line = document.createElement("code");
      line.textContent = `${flag} ball:${place.join(",")},${size}`;
      return line;
    }),
  );
});
window.uptPreview = {
  faces: count,
  choices: choices.length,
  frames: film ? film.count : 0,
  stopAt: (place) => (play(false), (time = place * film.step_s)),
  tools: tools.length,
  place: (tool) => tools[tool].mesh.position.toArray(),
  deepest: () => moved.reduce((most, x) => Math.max(most, Math.abs(x)), 0),
  pick: (x, y) => renderer.domElement.dispatchEvent(new PointerEvent("pointerup", { clientX: x, clientY: y })),
};

let before;
renderer.setAnimationLoop((now) => {
  if (film) {
    const length = (film.count - 1) * film.step_s;
    // A hidden page must not jump.
    if (playing) time = (time + Math.min((now - (before ?? now)) / 1000, 0.1)) % length;
    show(Math.min(time / film.step_s, film.count - 1));
  }
  before = now;
  const canvas = renderer.domElement;
  const { clientWidth: width, clientHeight: height } = canvas;
  if (canvas.width !== width || canvas.height !== height) {
    renderer.setSize(width, height, false);
    camera.aspect = width / height;
    if (width > 800) camera.setViewOffset(width, height, -142, 0, width, height); // beside the panel
    else camera.clearViewOffset();
    camera.updateProjectionMatrix();
  }
  light.position.copy(camera.position);
  controls.update();
  renderer.render(scene, camera);
});
