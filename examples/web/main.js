// A ball goes round on a liver and presses it: libupt steps in a worker, three.js draws.
import { SoftTissue } from "libupt/three.js";
import { Tissue } from "libupt/worker.js";
import { AmbientLight, CapsuleGeometry, Color, DirectionalLight, Mesh, MeshStandardMaterial, PerspectiveCamera, Scene, Vector3, WebGLRenderer } from "three";

const tissue = await Tissue.open("bundles/liver");
const organ = new SoftTissue(tissue);

const ball = new Mesh(new CapsuleGeometry(6, 0, 8, 24), new MeshStandardMaterial({ color: 0x9fb4c8, metalness: 0.6, roughness: 0.35 }));
const scene = new Scene();
scene.background = new Color(0x16181d);
const camera = new PerspectiveCamera(40, innerWidth / innerHeight, 1, 2000);
const sun = new DirectionalLight(0xffffff, 2.2);
scene.add(organ, ball, camera, sun, new AmbientLight(0xffffff, 0.9));

// The middle of what the bundle was made to be touched at; the camera looks at it from outside.
organ.geometry.computeBoundingSphere();
const { center, radius } = organ.geometry.boundingSphere;
const touched = [...tissue.domain.keys()].filter((i) => tissue.domain[i]);
const middle = new Vector3();
for (const i of touched) middle.add(new Vector3().fromArray(tissue.positions, 3 * i));
middle.divideScalar(touched.length);
const out = middle.clone().sub(center).normalize();
camera.position.copy(center).addScaledVector(out, 3 * radius);
camera.lookAt(center);
sun.position.copy(camera.position);
const aside = new Vector3().crossVectors(out, new Vector3(0, 0, 1)).normalize();
const up = new Vector3().crossVectors(aside, out);

// Round the middle, 4 mm deep at the outermost node that is near its way.
function moveBall(now) {
  const wanted = middle.clone().addScaledVector(aside, 15 * Math.cos(now / 1000)).addScaledVector(up, 15 * Math.sin(now / 1000));
  const from = (i) => new Vector3().fromArray(tissue.positions, 3 * i).sub(wanted);
  const cost = (i) => 3 * Math.hypot(from(i).dot(aside), from(i).dot(up)) - from(i).dot(out);
  const node = touched.reduce((best, i) => (cost(i) < cost(best) ? i : best));
  ball.position.copy(wanted).addScaledVector(out, from(node).dot(out) + 6 - 4);
}

const renderer = new WebGLRenderer({ antialias: true });
renderer.setSize(innerWidth, innerHeight);
document.body.append(renderer.domElement);
renderer.setAnimationLoop((now) => {
  moveBall(now);
  organ.update([{ position: ball.position.toArray(), radius: 6, friction: 0.1 }]);
  renderer.render(scene, camera);
});
Object.assign(window, { tissue, organ }); // for the console
