// Unity's jslib over the module, with a stand-in for Unity: a memory of its own, `malloc`, and what Emscripten gives such a library. node unity.mjs ROOT WASM. The last
// line is `N passed, N failed, N skipped`.
import assert from "node:assert/strict";
import { createServer } from "node:http";
import { readFileSync } from "node:fs";
import { join } from "node:path";
import vm from "node:vm";
import { press } from "./press.mjs";
import { runTests } from "./tests.mjs";

const [root, wasm] = process.argv.slice(2);
const abi = await import(join(root, "web/src/abi.js"));
const { load } = await import(join(root, "web/src/index.js"));
const unity = await import(join(root, "web/src/unity.js"));
const PLUGIN = join(root, "unity-plugin/Runtime");
const native = readFileSync(join(PLUGIN, "Interop/Native.g.cs"), "utf8");
const WHOLE = new Map([...native.matchAll(/static extern \S+ (upt_\w+)\((.*)\);/g)].map(([, name, list]) => [name, list ? list.split(", ") : []]));

/** Unity's side: memory that grows, as IL2CPP's does, and the calls of the jslib. */
class Player {
  memory = new WebAssembly.Memory({ initial: 64, maximum: 4096 });
  #next = 1024;
  calls;

  constructor() {
    const player = this;
    const said = {
      LibraryManager: { library: {} },
      mergeInto: Object.assign,
      get HEAPU8() {
        return new Uint8Array(player.memory.buffer);
      },
      UTF8ToString: (at) => this.text(at),
      _malloc: (bytes) => this.room(bytes),
      _free: () => {},
      TextEncoder,
      libuptForUnity: { start: (program) => unity.start(program, WebAssembly.compile(readFileSync(wasm))) },
      document: {
        createElement: () => ({}),
        head: { appendChild: (script) => setTimeout(() => (script.src.includes("nowhere") ? script.onerror() : script.onload())) },
      },
    };
    vm.runInNewContext(readFileSync(join(PLUGIN, "Plugins/WebGL/libupt.jslib"), "utf8"), said);
    const { library } = said.LibraryManager;
    said.Libupt = library.$Libupt;
    this.calls = library;
  }

  room(bytes) {
    const at = this.#next;
    this.#next = (at + bytes + 15) & ~15;
    const more = Math.ceil((this.#next - this.memory.buffer.byteLength) / 65536);
    if (more > 0) this.memory.grow(more + 8);
    return at;
  }

  put(array) {
    const at = this.room(array.byteLength);
    new Uint8Array(this.memory.buffer, at).set(new Uint8Array(array.buffer, array.byteOffset, array.byteLength));
    return at;
  }

  string(text) {
    return this.put(new TextEncoder().encode(`${text}\0`));
  }

  text(at) {
    const bytes = new Uint8Array(this.memory.buffer, at);
    return new TextDecoder().decode(bytes.slice(0, bytes.indexOf(0)));
  }

  word(at) {
    return new DataView(this.memory.buffer).getUint32(at, true);
  }

  floats(at, count) {
    return new Float32Array(this.memory.buffer.slice(at, at + 4 * count));
  }

  struct(layout, values = {}) {
    const at = this.room(layout.size);
    const view = new DataView(this.memory.buffer);
    for (const [name, value] of Object.entries({ struct_size: layout.size, ...values })) {
      const [type, offset] = layout.fields[name];
      [value].flat().forEach((one, i) => view[`set${type}`](at + offset + 4 * i, type === "BigUint64" ? BigInt(one) : one, true));
    }
    return at;
  }

  ok(status) {
    assert.ok(status >= 0, `${status}: ${this.text(this.calls.upt_last_error())}`);
    return status;
  }

  async prepare(folder, address) {
    const [at, bundle] = [this.string(folder), this.string(address)];
    for (let i = 0; i < 600; i += 1) {
      const state = this.calls.upt_web_prepare(at, bundle);
      if (state === 1) return this.calls.upt_web_progress(bundle);
      if (state < 0) throw new Error(this.text(this.calls.upt_web_error(bundle)));
      await new Promise((resolve) => setTimeout(resolve, 20));
    }
    throw new Error("nothing came");
  }
}

const server = createServer((request, response) => {
  try {
    const [, name] = /^\/StreamingAssets\/liver\/([\w.]+)/.exec(request.url);
    response.end(readFileSync(join(root, "onnx/liver-coarse", name)));
  } catch {
    response.writeHead(404).end();
  }
});
await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
const ADDRESS = `http://127.0.0.1:${server.address().port}/StreamingAssets/liver`;

async function opened() {
  const player = new Player();
  assert.equal(await player.prepare("/StreamingAssets/libupt", ADDRESS), 1);
  assert.equal(player.calls.upt_abi_version() >>> 0, Number(/UPT_ABI_VERSION = (\d+)/.exec(native)[1]));
  const out = player.room(4);
  const status = player.calls.upt_model_create(player.string(ADDRESS), player.struct(abi.upt_model_options, { portable: 1 }), out);
  player.ok(status);
  return { player, model: player.word(out), out };
}

const tests = {
  async the_jslib_has_every_call_of_the_bindings() {
    const names = [...WHOLE.keys()];
    assert.deepEqual(unity.names, names);
    const { calls } = new Player();
    assert.deepEqual(Object.keys(calls).filter((name) => /^upt_(?!web_)/.test(name) && !name.endsWith("__deps")), names);
    for (const name of names) assert.deepEqual([...calls[`${name}__deps`]], ["$Libupt"]);
    const web = readFileSync(join(PLUGIN, "Interop/WebBundle.cs"), "utf8");
    for (const [, name] of web.matchAll(/static extern \S+ (upt_\w+)\(/g)) assert.equal(typeof calls[name], "function", name);
    // Parameters by name; those of 64 bits are told apart.
    const source = readFileSync(join(root, "web/src/unity.js"), "utf8");
    for (const [name, list] of WHOLE) {
      const line = new RegExp(`^${name}\\b(.*)$`, "m").exec(source)[1].trim().split(" ").filter(Boolean);
      const wanted = list.map((one) => one.replace("@", "").split(" "));
      assert.deepEqual(line.map((word) => word.split(":")[0]), wanted.map(([, own]) => own), name);
      line.forEach((word, i) => assert.equal(word.endsWith(":l"), wanted[i][0] === "ulong", `${name}: ${word}`));
      line.forEach((word, i) => assert.equal(/:[<>=s]/.test(word), wanted[i][0].endsWith("*"), `${name}: ${word}`));
    }
  },

  async pointers_in_structs_are_known() {
    const source = readFileSync(join(root, "web/src/unity.js"), "utf8");
    const known = new Map([...source.matchAll(/^  (upt_\w+): \{(.*?)\},?$/gms)].map(([, name, fields]) => [name, fields]));
    for (const [, name, body] of native.matchAll(/public unsafe struct (upt_\w+)\s*\{(.*?)\n {4}\}/gs)) {
      if (name === "upt_model_options") continue; // read by itself
      for (const [, field] of body.matchAll(/public \w+\* (\w+);/g)) assert.match(known.get(name) ?? "", new RegExp(`\\b${field}: `), name);
    }
    assert.ok(known.get("upt_input").includes("instruments: "));
  },

  async a_rollout_has_the_bits_of_the_module_alone() {
    const upt = await load({ wasm: await WebAssembly.compile(readFileSync(wasm)) });
    const alone = await upt.open(ADDRESS, { portable: true });
    const states = press(upt, alone, { steps: 20, corrections: 3 });
    for (const split of [true, false]) {
      const { player, model, out } = await opened();
      const { calls } = player;
      // Numbers of 64 bits: two of 32, or a BigInt.
      const wide = (number) => (split ? [number, 0] : [BigInt(number)]);
      const options = player.struct(abi.upt_scene_options, { step_s: 0.02, "corrections.mode": abi.UPT_CORRECTIONS_COUNT, "corrections.count": 3 });
      player.ok(calls.upt_scene_create(model, options, out));
      const scene = player.word(out);
      const nodes = alone.info.node_count;
      const room = player.room(12 * nodes);
      player.ok(calls.upt_model_read_positions(model, room, ...wide(3 * nodes)));
      const tip = 3 * alone.indices("domainNodes")[0];
      const [x, y, z] = player.floats(room, 3 * nodes).subarray(tip, tip + 3);
      const tool = player.struct(abi.upt_instrument, { rotation: [0, 0, 0, 1], radius: 6, friction: 0.25 });
      const input = player.struct(abi.upt_input, { instruments: tool, instrument_count: 1 });
      const view = player.struct(abi.upt_view);
      const reading = player.struct(abi.upt_instrument_reading);
      for (let step = 0; step < 20; step += 1) {
        const at = new DataView(player.memory.buffer);
        const [, offset] = abi.upt_instrument.fields.position;
        const down = step < 16 ? step : 16;
        const aside = step < 16 ? 0 : step - 16;
        [x + 0.5 * aside, y, z + 6 - 0.5 * down].forEach((place, k) => at.setFloat32(tool + offset + 4 * k, place, true));
        if (step % 2) player.ok(calls.upt_scene_step(scene, input, room, ...wide(3 * nodes)));
        else {
          player.ok(calls.upt_scene_submit(scene, input));
          assert.equal(calls.upt_scene_submit(scene, input), abi.UPT_ERR_BUSY);
          assert.match(player.text(calls.upt_last_error()), /not collected/);
          assert.equal(step % 4 ? calls.upt_scene_poll(scene) : calls.upt_scene_wait(scene, 100), abi.UPT_OK);
          player.ok(calls.upt_scene_read(scene, view, room, ...wide(3 * nodes)));
        }
        assert.deepEqual(player.floats(room, 3 * nodes), states[3 * step]);
        player.ok(calls.upt_scene_read_instruments(scene, reading, ...wide(1)));
        assert.deepEqual(player.floats(reading + abi.upt_instrument_reading.fields.force[1], 3), states[3 * step + 1]);
        player.ok(calls.upt_scene_present(scene, input, 0.007, view, room, ...wide(3 * nodes)));
        assert.deepEqual(player.floats(room, 3 * nodes), states[3 * step + 2]);
      }
      player.ok(calls.upt_scene_destroy(scene));
      player.ok(calls.upt_model_destroy(model));
    }
  },

  async a_region_and_a_cut_pass_through() {
    const { player, model, out } = await opened();
    const { calls } = player;
    player.ok(calls.upt_scene_create(model, 0, out));
    const scene = player.word(out);
    const needed = player.room(8);
    player.ok(calls.upt_model_read_indices(model, abi.UPT_SET_SURFACE_NODES, 0, 0n, needed));
    const count = player.word(needed);
    const nodes = player.room(4 * count);
    player.ok(calls.upt_model_read_indices(model, abi.UPT_SET_SURFACE_NODES, nodes, BigInt(count), needed));
    player.ok(calls.upt_scene_set_region(scene, nodes, BigInt(count)));
    const input = player.struct(abi.upt_input);
    player.ok(calls.upt_scene_submit(scene, input));
    player.ok(calls.upt_scene_wait(scene, 0xffffffff));
    const shown = player.room(12 * count);
    player.ok(calls.upt_scene_read(scene, 0, shown, BigInt(3 * count)));
    // The list of a view passes through, too.
    const view = player.struct(abi.upt_view, { kind: abi.UPT_VIEW_NODES, nodes, node_count: count });
    const decoded = player.room(12 * count);
    player.ok(calls.upt_scene_decode(scene, view, decoded, BigInt(3 * count)));
    assert.deepEqual(player.floats(decoded, 3 * count), player.floats(shown, 3 * count));
    const described = player.room(4096);
    player.ok(calls.upt_model_describe(model, described, 4096n, needed));
    assert.equal(JSON.parse(player.text(described)).name, "liver");
    const room = player.room(12 * count);
    player.ok(calls.upt_model_read_indices(model, abi.UPT_SET_DOMAIN_NODES, nodes, BigInt(count), needed));
    const positions = player.room(12 * 1178);
    player.ok(calls.upt_model_read_positions(model, positions, 3534n));
    const [x, y, z] = player.floats(positions + 12 * player.word(nodes), 3);
    const blade = [-15, 15].flatMap((aside) => [[x + aside, y, z + 15], [x + aside, y, z - 15]]);
    const cut = player.struct(abi.upt_cut);
    player.ok(calls.upt_scene_cut(scene, 0, player.put(Float32Array.from(blade.flat())), 2n, 2n, cut));
    const surface = player.struct(abi.upt_surface);
    player.ok(calls.upt_scene_update_surface(scene, surface));
    const vertices = player.word(surface + abi.upt_surface.fields.vertex_count[1]);
    assert.ok(vertices > count, `${vertices} of ${count}`);
    assert.ok(room > 0);
  },

  async what_is_wrong_is_told_in_words() {
    const { player, model, out } = await opened();
    const { calls } = player;
    assert.equal(player.text(calls.upt_status_name(abi.UPT_ERR_BUSY)), "UPT_ERR_BUSY");
    assert.equal(player.text(calls.upt_version()), JSON.parse(readFileSync(join(root, "web/package.json"))).version);
    assert.equal(calls.upt_scene_create(model, player.struct(abi.upt_scene_options, { step_s: 7 }), out), abi.UPT_ERR_ARGUMENT);
    assert.match(player.text(calls.upt_last_error()), /step_s/);
    assert.equal(calls.upt_scene_create(0, 0, out), abi.UPT_ERR_NULL);
    assert.equal(calls.upt_model_create(player.string("http://nothing"), 0, out), abi.UPT_ERR_IO);
    assert.match(player.text(calls.upt_last_error()), /http:\/\/nothing has not been fetched/);
    assert.equal(calls.upt_set_log(8, 0, 2), abi.UPT_ERR_UNSUPPORTED);
    player.ok(calls.upt_set_log(0, 0, 0));
    await assert.rejects(player.prepare("/StreamingAssets/libupt", `${ADDRESS}-that-is-not-there`), /404/);
    await assert.rejects(new Player().prepare("nowhere", ADDRESS), /nowhere\/unity\.js cannot be loaded: unpack the npm package/);
    const early = new Player();
    assert.equal(early.calls.upt_scene_reset(1), abi.UPT_ERR_STATE);
    player.ok(calls.upt_model_destroy(model));
    assert.equal(calls.upt_model_destroy(model), abi.UPT_ERR_HANDLE);
  },
};

await runTests(tests);
server.closeAllConnections();
server.close();
