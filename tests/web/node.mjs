// The npm package's library in Node: node node.mjs ROOT WASM NATIVE, where NATIVE holds NAME.CORRECTIONS.bin that press.c wrote. The last line is
// `N passed, N failed, N skipped`.
import assert from "node:assert/strict";
import { File } from "node:buffer";
import { readFileSync, readdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { press } from "./press.mjs";
import { runTests } from "./tests.mjs";

const [root, wasm, native] = process.argv.slice(2);
const { load, UptError } = await import(join(root, "web/src/index.js"));
const { Clock, between } = await import(join(root, "web/src/clock.js"));
const { Surgery } = await import(join(root, "web/src/surgery.js"));
const compiled = await WebAssembly.compile(readFileSync(wasm));

/** Name and bytes of a bundle's files. */
function bundle(name) {
  const folder = join(root, name);
  return Object.fromEntries(readdirSync(folder).map((file) => [file, readFileSync(join(folder, file))]));
}
const start = (isa) => load({ wasm: compiled, isa });
const LIVER = "onnx/liver-coarse";

/** Each edge of a closed surface is passed as often in one direction as in the other. */
function closed(triangles) {
  const edges = new Map();
  for (let i = 0; i < triangles.length; i += 3) {
    const corners = triangles.subarray(i, i + 3);
    if (corners[0] === corners[1]) continue;
    corners.forEach((from, k) => {
      const to = corners[(k + 1) % 3];
      const key = `${Math.min(from, to)} ${Math.max(from, to)}`;
      edges.set(key, (edges.get(key) ?? 0) + Math.sign(to - from));
    });
  }
  return [...edges.values()].every((sum) => sum === 0);
}

function refused(status, words) {
  return (error) => {
    assert.ok(error instanceof UptError, String(error));
    assert.equal(error.status, status);
    assert.match(error.message, words);
    return true;
  };
}

// Of the native library, from the file of press.c: the largest difference of each array.
function differences(states, name, corrections) {
  const bytes = readFileSync(join(native, `${name.split("/").pop()}.${corrections}.bin`));
  const told = new Float32Array(bytes.buffer, bytes.byteOffset, bytes.length / 4);
  assert.equal(told.length, states.reduce((sum, list) => sum + list.length, 0));
  let at = 0;
  return states.map((list) => list.reduce((most, x) => Math.max(most, Math.abs(x - told[(at += 1) - 1])), 0));
}

const tests = {
  async a_portable_model_has_the_bits_of_a_native_one() {
    for (const [name, corrections] of rollouts()) {
      const upt = await start();
      const model = await upt.open(bundle(name), { portable: true });
      assert.equal(model.describe().instruction_set, "Portable");
      const states = press(upt, model, { steps: 32, corrections });
      assert.ok(states[45].some((x) => x > 1), "the ball presses");
      const apart = differences(states, name, corrections).filter((most) => most !== 0);
      assert.equal(apart.length, 0, `${name}, ${corrections} corrections: ${apart.length} of ${states.length} arrays differ, by ${Math.max(...apart)}`);
    }
  },

  // On the liver: under a ball on a fold of the brain native AVX2 differs from portable lanes by a millimetre too.
  async others_are_near_it() {
    for (const [name, corrections] of rollouts().filter(([name]) => name.includes("liver"))) {
      const upt = await start();
      const model = await upt.open(bundle(name));
      assert.equal(model.describe().instruction_set, "Simd128");
      const states = press(upt, model, { steps: 32, corrections });
      const shown = differences(states, name, corrections).filter((_, i) => i % 3 !== 1); // mm; forces are large numbers
      const middle = [...shown].sort((a, b) => a - b)[shown.length >> 1];
      console.log(`  ${name}, ${corrections} corrections: median ${middle.toExponential(1)}, most ${Math.max(...shown).toExponential(1)} mm`);
      // Rounding that corrections carry on, and that contact may turn into another point of contact for a step.
      assert.ok(middle < 5e-3 && Math.max(...shown) < 0.1, `${name}, ${corrections} corrections: ${middle} mm`);
    }
  },

  // Read again by the native command: tests/web/run.sh.
  async a_portable_scene_records_itself() {
    const upt = await start();
    const model = await upt.open(bundle(LIVER), { portable: true });
    const scene = model.scene({ corrections: 3 });
    const node = 3 * model.indices("domainNodes")[0];
    const [x, y, z] = model.positions().subarray(node, node + 3);
    scene.record();
    for (let t = 0; t < 4; t += 1) {
      scene.step([{ shape: "sphere", radius: 6, position: [x, y, z + 6 - t], friction: 0.3 }]);
      if (t === 1) scene.cut([[[x - 20, y + 9, z + 10], [x + 20, y + 9, z + 10]], [[x - 20, y + 9, z - 12], [x + 20, y + 9, z - 12]]]);
    }
    const first = scene.takeRecord();
    scene.record(0);
    const file = first + scene.takeRecord();
    assert.equal(scene.takeRecord(), "");
    const lines = file.trim().split("\n").map(JSON.parse);
    assert.equal(lines.length, 7);
    assert.ok(lines[0].portable && lines[3].cut && lines[5].step.sha256);
    assert.deepEqual(lines[6], { end: 5 });
    writeFileSync(join(native, "module.replay"), file);
    assert.throws(() => scene.record(0), refused("UPT_ERR_STATE", /no recording is on/));
  },

  async damaged_bundles_are_refused_in_the_librarys_words() {
    const upt = await start();
    const files = bundle(LIVER);
    await assert.rejects(upt.open({ ...files, "prior.safetensors": files["prior.safetensors"].subarray(0, 1000) }), refused("UPT_ERR_BUNDLE", /^upt_model_create: prior\.safetensors: has 1000 bytes, bundle\.json field `files\.prior\.safetensors\.bytes` says/));
    const damaged = Uint8Array.from(files["prior.safetensors"]);
    damaged[damaged.length - 1] ^= 1;
    await assert.rejects(upt.open({ ...files, "prior.safetensors": damaged }), refused("UPT_ERR_BUNDLE", /prior\.safetensors: SHA-256 is/));
    const { "mesh.safetensors": _, ...lacking } = files;
    await assert.rejects(upt.open(lacking), refused("UPT_ERR_IO", /mesh\.safetensors: is not among the files that were given/));
    await assert.rejects(upt.open({}), refused("UPT_ERR_IO", /bundle\.json/));
    await assert.rejects(upt.open({ "bundle.json": new Uint8Array(40) }), refused("UPT_ERR_BUNDLE", /bundle\.json/));
    assert.ok(await upt.open(files), "and it still opens others");
  },

  async bundles_with_networks_are_refused() {
    const upt = await start();
    await assert.rejects(upt.open(bundle("tests/fixtures/tiny-reduced")), refused("UPT_ERR_UNSUPPORTED", /this build has no feature "learned"/));
  },

  async wrong_input_changes_nothing() {
    const upt = await start();
    const model = await upt.open(bundle(LIVER));
    const scene = model.scene();
    const far = { position: [500, 0, 0], radius: 5 };
    const before = scene.step([far]).slice();
    assert.throws(() => scene.step([{ ...far, position: [NaN, 0, 0] }]), refused("UPT_ERR_NON_FINITE", /instruments\[0\]: the pose is not finite/));
    assert.throws(() => scene.step([{ ...far, rotation: [0, 0, 0, 2] }]), refused("UPT_ERR_ARGUMENT", /rotation/));
    assert.throws(() => scene.step([{ ...far, mode: "bite" }]), refused("UPT_ERR_ARGUMENT", /mode is bite; it can be slide, grasp/));
    assert.throws(() => model.scene({ stepSeconds: 7 }), refused("UPT_ERR_ARGUMENT", /step_s/));
    assert.throws(() => model.indices("hair"), refused("UPT_ERR_ARGUMENT", /surfaceNodes/));
    assert.throws(() => scene.setRegion([1e6]), refused("UPT_ERR_ARGUMENT", /./));
    assert.deepEqual(scene.read().slice(), before);
    await assert.rejects(load({ wasm: compiled, isa: "avx2" }), refused("UPT_ERR_ARGUMENT", /isa is avx2/));
  },

  async calls_after_close_are_refused() {
    const upt = await start();
    const model = await upt.open(bundle(LIVER));
    const scene = model.scene();
    model.close();
    assert.throws(() => model.scene(), refused("UPT_ERR_HANDLE", /model/));
    scene.step([{ position: [500, 0, 0], radius: 5 }]);
    scene.close();
    for (const late of [() => scene.step([{ position: [0, 0, 0], radius: 5 }]), () => scene.present(0), () => scene.read(), () => scene.readings(), () => scene.stats(), () => scene.close()]) {
      assert.throws(late, refused("UPT_ERR_HANDLE", /scene/));
    }
  },

  async the_region_and_points_follow() {
    const upt = await start();
    const model = await upt.open(bundle(LIVER));
    const scene = model.scene();
    const nodes = model.indices("surfaceNodes");
    const [x, y, z] = model.positions().slice(3 * model.indices("domainNodes")[0]);
    const tool = [{ position: [x, y, z + 3], radius: 6 }];
    const all = scene.step(tool).slice();
    scene.setRegion(nodes);
    scene.attachPoints([x, y, z]);
    const shown = scene.read().slice();
    assert.equal(shown.length, 3 * nodes.length);
    nodes.forEach((node, i) => assert.deepEqual([...shown.subarray(3 * i, 3 * i + 3)], [...all.subarray(3 * node, 3 * node + 3)]));
    const node = 3 * model.indices("domainNodes")[0];
    scene.read({ points: true }).forEach((moved, axis) => assert.ok(Math.abs(moved - all[node + axis]) < 1e-4));
    assert.equal(scene.present(0.01, tool, { points: true }).length, 3);
    assert.ok(scene.stats().step_count === 1 && scene.readings()[0].contact_count > 0);
  },

  async loads_act_as_they_do_by_nodes() {
    const upt = await start();
    const model = await upt.open(bundle(LIVER));
    const scenes = [model.scene(), model.scene()];
    const node = model.indices("domainNodes")[0];
    const rest = model.positions();
    const place = [...rest.slice(3 * node, 3 * node + 3)];
    const [point] = model.locate([place]);
    const at = [0, 1, 2].map((axis) => point.nodes.reduce((sum, own, i) => sum + point.weights[i] * rest[3 * own + axis], 0));
    at.forEach((x, axis) => assert.ok(Math.abs(x - place[axis]) < 1e-3));
    const forces = new Float32Array(rest.length);
    point.nodes.forEach((own, i) => (forces[3 * own + 2] = 40 * point.weights[i]));
    const more = { gravity: [0, -1, 0], pressures: [{ pascal: 20 }, { pascal: -5, nodes: model.indices("domainNodes") }], support: { position: [0, 0, 1] } };
    for (let step = 0; step < 4; step += 1) {
      const one = scenes[0].step([], 0, { ...more, pointForces: [{ ...point, force: [0, 0, 40] }] }).slice();
      assert.deepEqual(scenes[1].step([], 0, { ...more, forces }), one);
      assert.ok(one[3 * node + 2] > 1e-3);
    }
    const scene = model.scene();
    const ties = scene.bed({ centre: place, radius: 15, stiffness: 300, breakForce: 400 });
    const ball = { shape: "sphere", radius: 5, position: [place[0], place[1], place[2] + 60] };
    ties.forEach((tie) => Object.assign(tie, { to: "instrument", place: tie.place.map((x, axis) => x - ball.position[axis]) }));
    assert.ok(ties.length > 3);
    scene.step([ball], 0, { ties });
    assert.ok(scene.tieReadings(ties.length).every((tie) => tie.broken === 0));
    for (let step = 0; step < 20; step += 1) {
      ball.position[2] += 0.5;
      scene.step([ball], 0, { ties });
    }
    assert.ok(scene.tieReadings(ties.length).every((tie) => tie.broken === 1));
    assert.equal(scene.present(0.01, [ball], { loads: { ties } }).length, rest.length);
    assert.throws(() => scene.step([ball], 0, { ties: [{ ...ties[0], to: "moon" }] }), refused("UPT_ERR_ARGUMENT", /ties\[0\].to is moon/));
    assert.throws(() => scene.step([ball], 0, { gravity: [NaN, 0, 0] }), refused("UPT_ERR_NON_FINITE", /gravity/));
    assert.throws(() => model.locate([[1e4, 0, 0]]), refused("UPT_ERR_ARGUMENT", /outside the mesh/));
  },

  async a_blade_cuts_and_what_is_new_of_the_surface_is_told() {
    const upt = await start();
    const model = await upt.open(bundle(LIVER));
    const scene = model.scene();
    const nodes = scene.nodeCount;
    const whole = scene.updateSurface();
    assert.ok(whole.isNew && whole.firstVertex === 0 && closed(whole.triangles));
    const [x, y, z] = model.positions().slice(3 * model.indices("domainNodes")[0]);
    const edge = (ahead) => [[x + ahead, y, z + 15], [x + ahead, y, z - 15]];
    const before = scene.save();
    let area = 0;
    for (let at = -15; at < 15; at += 3) {
      const cut = scene.cut([edge(at), edge(at + 3)], { fractureEnergy: 10 });
      area += cut.area_mm2;
      if (cut.is_changed) assert.ok(closed(scene.updateSurface().triangles));
    }
    const { rest, inside, isNew } = scene.updateSurface();
    assert.ok(area > 50 && !isNew && inside.some((one) => one === 1), `${area} mm2`);
    assert.equal(scene.step([{ position: [500, 0, 0], radius: 5 }]).length, 3 * scene.nodeCount);
    assert.ok(scene.nodeCount > nodes && scene.present(0.01, [], { surface: true }).length === rest.length);
    assert.throws(() => scene.cut([edge(0), edge(0)]), refused("UPT_ERR_ARGUMENT", /sweeps no area/));
    const taken = scene.remove({ shape: "sphere", position: [x, y, z], radius: 5 }, 30);
    assert.ok(Math.abs(taken.removed_mm3 - 30) < 3 && scene.updateSurface().changed.length > 0);
    assert.equal(scene.tear(5).is_changed, 0);
    assert.throws(() => scene.tear(0.5), refused("UPT_ERR_ARGUMENT", /above 1/));
    assert.equal(scene.scaleStiffness([0, 1, 2], 4).is_changed, 1);
    scene.restore(before);
    assert.equal(scene.nodeCount, nodes);
    assert.deepEqual(scene.updateSurface().triangles, whole.triangles);
    assert.equal(scene.read().length, 3 * nodes);
  },

  // What the worker does with a tool that cuts, step by step.
  async strokes_are_undone_one_by_one() {
    const upt = await start();
    const model = await upt.open(bundle(LIVER));
    const scene = model.scene();
    scene.setRegion(model.indices("surfaceNodes"));
    const surgery = new Surgery(scene, model);
    assert.equal(surgery.news(), undefined);
    const [x, y, z] = model.positions().slice(3 * model.indices("domainNodes")[0]);
    const upright = { rotation: [Math.SQRT1_2, 0, 0, Math.SQRT1_2], halfLength: 20, radius: 2 };
    const step = (...tools) => {
      surgery.operate(tools, 0.02);
      scene.step();
    };
    for (let at = -10; at <= 10; at += 2) step({ ...upright, kind: "blade", position: [x + at, y, z + 12] });
    step();
    const cut = surgery.told();
    assert.ok(cut.areaMm2 > 50 && cut.undos === 1 && cut.copies > 0, JSON.stringify(cut));
    const news = surgery.news();
    assert.ok(news.isNew && news.rest.length === 3 * news.vertices && news.corners.length === 3 * news.changed.length);
    assert.equal(scene.present(0, [], { surface: true }).length, 3 * news.vertices);
    // A frame that failed took them along: they are told again, whole.
    surgery.repeat();
    const again = surgery.news();
    assert.deepEqual([again.isNew, again.vertices, again.changed.length], [true, news.vertices, news.slots]);
    assert.deepEqual(again.corners.filter((_, i) => i < 9), news.corners.filter((_, i) => i < 9));
    assert.equal(surgery.news(), undefined);
    for (let at = 0; at < 5; at += 1) step({ ...upright, kind: "aspirator", radius: 5, position: [x, y, z + 20] });
    step();
    const less = surgery.told();
    assert.ok(less.removedMm3 > 20 && less.undos === 2, JSON.stringify(less));
    step({ ...upright, kind: "coagulator", radius: 8, position: [x, y, z + 20] });
    assert.ok(surgery.news().hardened.length > 0);
    const two = { ...upright, kind: "blade", position: [x, y, z] };
    assert.throws(() => step(two, two), refused("UPT_ERR_ARGUMENT", /two tools that cut/));
    assert.throws(() => step({ ...two, kind: "saw" }), refused("UPT_ERR_ARGUMENT", /kind is saw; it can be press, blade/));
    assert.ok(surgery.undo() && surgery.undo() && surgery.told().areaMm2 === cut.areaMm2);
    assert.equal(surgery.news().hardened.length, 0);
    // A tool whose stroke was taken back begins another one once it has been lifted.
    const ball = { ...upright, kind: "aspirator", radius: 5, position: [x, y, z + 20] };
    step(ball);
    step();
    step(ball);
    assert.ok(surgery.undo(), "the stroke before was lifted");
    step(ball);
    assert.deepEqual([surgery.told().removedMm3, surgery.told().undos], [0, 1]);
    step();
    assert.ok(surgery.undo() && !surgery.undo());
    assert.deepEqual([surgery.told().areaMm2, scene.nodeCount], [0, model.info.node_count]);
  },

  async memory_grows_and_is_used_again() {
    const upt = await start();
    const files = bundle(LIVER);
    const model = await upt.open(files);
    const states = press(upt, model, { steps: 6, corrections: 3 });
    const first = upt.module.memoryBytes;
    const scenes = [];
    while (upt.module.memoryBytes < first + 50e6) scenes.push(model.scene());
    const again = press(upt, model, { steps: 6, corrections: 3 });
    again.forEach((list, i) => assert.deepEqual(list, states[i]));
    scenes.forEach((scene) => scene.close());
    const most = upt.module.memoryBytes;
    for (let i = 0; i < 20; i += 1) {
      (await upt.open(files)).close();
      model.scene().close();
    }
    assert.equal(upt.module.memoryBytes, most, "what was closed is used again");
  },

  async a_panic_ends_one_instance() {
    const [ends, stays] = [await start(), await start()];
    const model = await ends.open(bundle(LIVER));
    const scene = (await stays.open(bundle(LIVER))).scene();
    assert.throws(() => ends.module.call("upt_test_panic", model.scene().handle), refused("UPT_ERR_PANIC", /has ended in upt_test_panic .*asked for by the test.*load another one/));
    assert.throws(() => model.scene(), refused("UPT_ERR_PANIC", /has ended/));
    scene.step([{ position: [500, 0, 0], radius: 5 }]);
  },

  async bundles_come_from_files_and_addresses() {
    const files = bundle(LIVER);
    const upt = await start();
    const list = Object.entries(files).map(([name, bytes]) => new File([bytes], name));
    assert.equal((await upt.open(list)).describe().name, (await upt.open(files)).describe().name);
    const asked = [];
    const told = [];
    const get = async (url) => {
      asked.push(url.href);
      const bytes = files[url.pathname.split("/").pop()];
      return bytes ? new Response(bytes) : new Response("", { status: 404, statusText: "Not Found" });
    };
    await upt.open("http://host/some/bundle", { fetch: get, progress: (done, total) => told.push(done / total) });
    assert.equal(asked[0], "http://host/some/bundle/bundle.json");
    assert.ok(asked.slice(1).every((url) => /\?sha256=[0-9a-f]{16}$/.test(url)), asked.join(" "));
    assert.equal(told.at(-1), 1);
    // What its folder does not have lies in that of its body.
    const fields = JSON.parse(new TextDecoder().decode(files["bundle.json"]));
    delete fields.manifest_sha256; // a manifest without a digest is taken
    files["bundle.json"] = new TextEncoder().encode(JSON.stringify({ ...fields, body: "organ" }));
    const apart = async (url) => (/\/(net\/(?!mesh)|organ\/mesh)/.test(url.pathname) ? get(url) : new Response("", { status: 404, statusText: "Not Found" }));
    asked.length = 0;
    await upt.open("http://host/net", { fetch: apart });
    assert.ok(asked.some((url) => url.startsWith("http://host/organ/mesh.safetensors?sha256=")), asked.join(" "));
    delete files["mesh.safetensors"];
    await assert.rejects(upt.open("http://host/net/", { fetch: apart }), refused("UPT_ERR_IO", /organ\/mesh\.safetensors.*404/));
  },

  async a_step_has_the_pose_of_its_own_moment() {
    const tool = (x) => [{ position: [x, 0, 0], rotation: [0, 0, 0, 1] }];
    const clock = new Clock(0.05);
    clock.moved(1, tool(0));
    assert.ok(clock.due(1));
    assert.equal(clock.step(1)[0].position[0], 0);
    clock.moved(1.04, tool(4));
    assert.ok(!clock.due(1.04));
    clock.moved(1.06, tool(6));
    assert.ok(Math.abs(clock.step(1.06)[0].position[0] - 5) < 1e-6);
    assert.ok(Math.abs(clock.since(1.06) - 0.01) < 1e-9);
    clock.moved(9, tool(7));
    clock.step(9);
    assert.ok(!clock.due(9.04), "lost time is not made up for");
    assert.deepEqual(between(tool(0), tool(100), 0.5), tool(100), "put, not moved");
    assert.ok(Math.abs(between([{ ...tool(0)[0], rotation: [0, 0, 0, -1] }], tool(2), 0.5)[0].rotation[3]) > 0.999);
  },

  async a_grasp_closes_where_it_has_come_to_and_holds_when_time_is_lost() {
    const tool = (x, mode) => [{ position: [x, 0, 0], mode }];
    const clock = new Clock(0.02);
    clock.moved(0, tool(0, "slide"));
    assert.equal(clock.step(0)[0].mode, "slide");
    clock.moved(0.06, tool(6, "grasp"));
    const closing = [1, 2, 3].map(() => clock.step(0.06)[0]);
    assert.deepEqual(closing.map(({ mode }) => mode), ["slide", "slide", "grasp"]);
    // A page that shows a picture a second: the tool is where the tissue can follow.
    clock.moved(1, tool(36, "grasp"));
    assert.ok(Math.abs(clock.step(1)[0].position[0] - 11) < 1e-9);
    clock.moved(2, tool(36, "grasp"));
    assert.ok(Math.abs(clock.step(2)[0].position[0] - 16) < 1e-9);
    clock.moved(2.01, tool(200, "grasp"));
    clock.moved(2.02, tool(201, "grasp"));
    assert.equal(clock.step(2.02)[0].position[0], 201, "put, not moved");
    clock.moved(3, tool(210, "slide"));
    assert.equal(clock.step(3)[0].position[0], 210, "what holds nothing is at once where it is");
  },
};

function rollouts() {
  return readdirSync(native).flatMap((file) => {
    const [, name, corrections] = /^(.*)\.(-?\d+)\.bin$/.exec(file) ?? [];
    if (!name) return [];
    return [[`onnx/${name}`, Number(corrections)]];
  });
}

await runTests(tests);
