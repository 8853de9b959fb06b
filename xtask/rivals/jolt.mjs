// Jolt's soft body (XPBD) on the folder of a case (`outside.py` says what it holds): node jolt.mjs PACKAGE FOLDER
//
// It has edges and volumes, no elements: edges of stiffness 15 mu V_e / L_e² and volumes of stiffness kappa / (36 V) have the
// shear and bulk modulus of the material on average over directions (V_e: a sixth of each tetrahedron at the edge).
import { readFileSync, writeFileSync } from "node:fs";
import { pathToFileURL } from "node:url";

const [, , packageFolder, folder] = process.argv;
const { default: initialise } = await import(pathToFileURL(`${packageFolder}/dist/jolt-physics.wasm-compat.js`));
const version = JSON.parse(readFileSync(`${packageFolder}/package.json`)).version;
const Jolt = await initialise();
const read = (name, type) => {
  const bytes = readFileSync(`${folder}/${name}`);
  return new type(bytes.buffer.slice(bytes.byteOffset, bytes.byteOffset + bytes.length));
};
const problem = JSON.parse(readFileSync(`${folder}/case.json`));
const began = performance.now();
const positions = read("positions.f32", Float32Array);
const tets = read("tets.u32", Uint32Array);
const surface = read("surface.u32", Uint32Array);
const masses = read("masses.f32", Float32Array);
const poses = read("poses.f32", Float32Array);
const held = new Set(read("held.u32", Uint32Array));
const count = positions.length / 3;

// One layer for tissue, one for tools.
const settings = new Jolt.JoltSettings();
const layers = new Jolt.ObjectLayerPairFilterTable(2);
layers.EnableCollision(0, 1);
const broad = new Jolt.BroadPhaseLayerInterfaceTable(2, 2);
const phases = [new Jolt.BroadPhaseLayer(0), new Jolt.BroadPhaseLayer(1)];
phases.forEach((phase, layer) => broad.MapObjectToBroadPhaseLayer(layer, phase));
settings.mObjectLayerPairFilter = layers;
settings.mBroadPhaseLayerInterface = broad;
settings.mObjectVsBroadPhaseLayerFilter = new Jolt.ObjectVsBroadPhaseLayerFilterTable(broad, 2, layers, 2);
settings.mMaxWorkerThreads = 0;
const jolt = new Jolt.JoltInterface(settings);
const system = jolt.GetPhysicsSystem();
system.SetGravity(new Jolt.Vec3(0, 0, 0));
const bodies = system.GetBodyInterface();

const mu = problem.young_pa / (2 * (1 + problem.poisson));
const kappa = problem.young_pa / (3 * (1 - 2 * problem.poisson));
const at = (node) => [0, 1, 2].map((axis) => positions[3 * node + axis]);
const minus = (a, b) => a.map((x, axis) => x - b[axis]);
const shared = new Jolt.SoftBodySharedSettings();
const vertex = new Jolt.SoftBodySharedSettingsVertex();
for (let node = 0; node < count; node++) {
  vertex.mPosition = new Jolt.Float3(...at(node));
  vertex.mInvMass = held.has(node) ? 0 : 1 / masses[node];
  shared.mVertices.push_back(vertex);
}
for (let face = 0; face < surface.length; face += 3) {
  shared.AddFace(new Jolt.SoftBodySharedSettingsFace(surface[face], surface[face + 1], surface[face + 2], 0));
}
const edges = new Map();
for (let tet = 0; tet < tets.length; tet += 4) {
  const nodes = tets.subarray(tet, tet + 4);
  const [a, b, c] = [1, 2, 3].map((corner) => minus(at(nodes[corner]), at(nodes[0])));
  const six = a[0] * (b[1] * c[2] - b[2] * c[1]) - a[1] * (b[0] * c[2] - b[2] * c[0]) + a[2] * (b[0] * c[1] - b[1] * c[0]);
  shared.mVolumeConstraints.push_back(new Jolt.SoftBodySharedSettingsVolume(...nodes, (36 * Math.abs(six)) / 6 / kappa));
  for (let i = 0; i < 4; i++) {
    for (let j = i + 1; j < 4; j++) {
      const key = Math.min(nodes[i], nodes[j]) * count + Math.max(nodes[i], nodes[j]);
      edges.set(key, (edges.get(key) ?? 0) + Math.abs(six) / 36);
    }
  }
}
for (const [key, volume] of edges) {
  const [i, j] = [Math.floor(key / count), key % count];
  const length = Math.hypot(...minus(at(i), at(j)));
  shared.mEdgeConstraints.push_back(new Jolt.SoftBodySharedSettingsEdge(i, j, (length * length) / (15 * mu * volume)));
}
shared.CalculateEdgeLengths();
shared.CalculateVolumeConstraintVolumes();
shared.Optimize();
const creation = new Jolt.SoftBodyCreationSettings(shared, new Jolt.RVec3(0, 0, 0), new Jolt.Quat(0, 0, 0, 1), 0);
Object.assign(creation, {
  mNumIterations: problem.setting.iterations,
  mLinearDamping: problem.damping,
  mGravityFactor: 0,
  mFriction: problem.tools[0].friction,
  mVertexRadius: 1e-3 * (problem.setting.vertex_radius_mm ?? 0),
  mUpdatePosition: false,
  mAllowSleeping: false,
});
const tissue = bodies.CreateSoftBody(creation);
bodies.AddBody(tissue.GetID(), Jolt.EActivation_Activate);
const motion = Jolt.castObject(tissue.GetMotionProperties(), Jolt.SoftBodyMotionProperties);

const pose = (frame, tool) => poses.subarray(7 * (frame * problem.tools.length + tool), 7 * (frame * problem.tools.length + tool) + 7);
const tools = problem.tools.map((tool, index) => {
  const [x, y, z, ...q] = pose(0, index);
  const shape = new Jolt.CapsuleShape(tool.half_length, tool.radius);
  const own = new Jolt.BodyCreationSettings(shape, new Jolt.RVec3(x, y, z), new Jolt.Quat(...q), Jolt.EMotionType_Kinematic, 1);
  own.mFriction = tool.friction;
  const body = bodies.CreateBody(own);
  bodies.AddBody(body.GetID(), Jolt.EActivation_Activate);
  return body;
});
const setUp = (performance.now() - began) / 1000;

const out = new Float32Array(3 * count * problem.frames);
const processor = [0];
const wall = [0];
const step = problem.frame_s / problem.setting.steps;
for (let frame = 1; frame < problem.frames; frame++) {
  const [clock, cpu] = [performance.now(), process.cpuUsage()];
  for (let sub = 1; sub <= problem.setting.steps; sub++) {
    const part = sub / problem.setting.steps;
    tools.forEach((body, index) => {
      const [a, b] = [pose(frame - 1, index), pose(frame, index)];
      const mixed = b.map((x, i) => (1 - part) * a[i] + part * x);
      const norm = Math.hypot(...mixed.slice(3));
      const [x, y, z, ...q] = mixed;
      bodies.MoveKinematic(body.GetID(), new Jolt.RVec3(x, y, z), new Jolt.Quat(...q.map((v) => v / norm)), step);
    });
    jolt.Step(step, 1);
  }
  const used = process.cpuUsage(cpu);
  wall.push((performance.now() - clock) / 1000);
  processor.push((used.user + used.system) / 1e6);
  for (let node = 0; node < count; node++) {
    const p = motion.GetVertex(node).mPosition;
    out.set([p.GetX() - positions[3 * node], p.GetY() - positions[3 * node + 1], p.GetZ() - positions[3 * node + 2]], 3 * (frame * count + node));
  }
}
writeFileSync(`${folder}/out.f32`, Buffer.from(out.buffer));
writeFileSync(`${folder}/out.json`, JSON.stringify({ processor, wall, set_up_s: setUp, versions: { "jolt-physics": version } }));
