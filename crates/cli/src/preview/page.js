// The page of `upt make --preview` and of certificates: one organ, coloured by what is known of it.
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
at("bar").style.background = `linear-gradient(90deg, ${SCALE.map((colour) => `#${colour.getHexString()}`).join(", ")})`;
choices.forEach((choice, i) => at("choice").add(new Option(choice.name, i)));
at("choice").addEventListener("change", () => paint(choices[at("choice").value]));
at("choice").value = data.error ? 1 : 0;
paint(choices[at("choice").value]);
at("name").textContent = data.name;
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
  if (!down || Math.hypot(event.clientX - down[0], event.clientY - down[1]) > 4) return;
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
window.uptPreview = { faces: count, choices: choices.length, pick: (x, y) => renderer.domElement.dispatchEvent(new PointerEvent("pointerup", { clientX: x, clientY: y })) };

renderer.setAnimationLoop(() => {
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
