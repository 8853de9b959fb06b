// Bundles by HTTP, from hosts that break off, know no ranges or send what is wrong: node download.mjs ROOT WASM. The last line is `N passed, N failed, N skipped`.
import assert from "node:assert/strict";
import { createHash } from "node:crypto";
import { readFileSync, readdirSync } from "node:fs";
import { createServer } from "node:http";
import { join } from "node:path";
import { gzipSync } from "node:zlib";
import { runTests } from "./tests.mjs";

const [root, wasm] = process.argv.slice(2);
const { load, UptError } = await import(join(root, "web/src/index.js"));
const upt = await load({ wasm: await WebAssembly.compile(readFileSync(wasm)) });
const folder = join(root, "onnx/liver-coarse");
const bundle = Object.fromEntries(readdirSync(folder).map((name) => [name, readFileSync(join(folder, name))]));
const LARGE = "prior.safetensors"; // of more than one piece
const LISTED = Object.keys(JSON.parse(bundle["bundle.json"]).files);

/** A host of the liver's bundle that does `odd` things, and what it was asked for. */
async function host({ ranges = true, gzip = false, odd = () => {} } = {}) {
  const asked = [];
  const files = Object.fromEntries(Object.entries(bundle).map(([name, bytes]) => (gzip ? [`${name}.gz`, gzipSync(bytes)] : [name, bytes])));
  const server = createServer((request, response) => {
    const name = request.url.split("/").pop().split("?")[0];
    const range = /^bytes=(\d+)-$/.exec(request.headers.range);
    asked.push({ name, from: range && Number(range[1]) });
    const told = { bytes: files[name], status: undefined, ...odd({ name, files, times: asked.filter((one) => one.name === name).length }) };
    const status = told.status ?? (told.bytes ? 200 : 404);
    if (status !== 200) return response.writeHead(status).end();
    const from = ranges && range ? Number(range[1]) : 0;
    if (from >= told.bytes.length) return response.writeHead(416).end();
    const length = told.bytes.length - from;
    response.writeHead(from ? 206 : 200, { "content-length": length, ...(from && { "content-range": `bytes ${from}-${told.bytes.length - 1}/${told.bytes.length}` }) });
    return response.end(told.bytes.subarray(from));
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  return { asked, of: (name) => asked.filter((one) => one.name === name), address: `http://127.0.0.1:${server.address().port}/liver`, close: () => new Promise((resolve) => { server.closeAllConnections(); server.close(resolve); }) };
}

/** A `fetch` whose answers of the large file end after some bytes that have been read, as often as this says. */
function breaking(most, times) {
  let broken = 0;
  return async (url, options) => {
    const response = await fetch(url, options);
    if (!url.pathname.includes(LARGE) || !response.ok || broken === times) return response;
    broken += 1;
    const start = new Uint8Array(await response.arrayBuffer()).subarray(0, most);
    let isRead = false;
    const pull = (stream) => {
      if (isRead) stream.error(new TypeError("the connection was reset"));
      else stream.enqueue(start);
      isRead = true;
    };
    return new Response(new ReadableStream({ pull }, { highWaterMark: 0 }), response);
  };
}

async function opened(address, options) {
  const model = await upt.open(address, options);
  assert.equal(model.info.node_count, 1178);
  model.close();
}

const refused = (status, words) => (error) => {
  assert.ok(error instanceof UptError, error.stack);
  assert.equal(error.status, status);
  assert.match(error.message, words);
  return true;
};

const tests = {
  async what_was_kept_is_not_asked_for_again() {
    for (const gzip of [false, true]) {
      const there = await host({ gzip });
      const cache = new Map();
      await opened(there.address, { cache, gzip });
      assert.equal(there.asked.length, 1 + LISTED.length);
      there.asked.length = 0;
      await opened(there.address, { cache, gzip });
      assert.deepEqual(there.asked.map(({ name }) => name), [gzip ? "bundle.json.gz" : "bundle.json"]);
      await there.close();
      await opened(there.address, { cache, gzip });
      await assert.rejects(upt.open(there.address, { gzip }), refused("UPT_ERR_IO", /bundle\.json.*fetch failed/));
    }
  },

  async a_connection_that_ends_is_taken_up_where_it_ended() {
    for (const gzip of [false, true]) {
      const there = await host({ gzip });
      const told = [];
      await opened(there.address, { gzip, fetch: breaking(300_000, 3), progress: (done, total) => told.push(done / total) });
      const from = there.asked.filter(({ name }) => name.startsWith(LARGE)).map((one) => one.from);
      assert.deepEqual(from, [null, 300_000, 600_000, 900_000]);
      assert.equal(told.at(-1), 1);
      await there.close();
    }
  },

  async a_host_without_ranges_begins_anew() {
    const there = await host({ ranges: false });
    await opened(there.address, { fetch: breaking(300_000, 1) });
    assert.deepEqual(there.of(LARGE).map(({ from }) => from), [null, 300_000]);
    await there.close();
  },

  async another_visit_takes_up_what_the_last_one_left() {
    const cache = new Map();
    const poor = await host({ odd: ({ name, times }) => (name === LARGE && times > 1 ? { status: 503 } : {}) });
    await assert.rejects(upt.open(poor.address, { cache, fetch: breaking(1_200_000, 1) }), refused("UPT_ERR_IO", /prior\.safetensors.*5 requests gave 1200000 bytes, which make no file of 1930108; the last one: 503/));
    await poor.close();
    const there = await host();
    await opened(there.address, { cache });
    assert.deepEqual(there.of(LARGE), [{ name: LARGE, from: 1 << 20 }]);
    assert.equal(there.asked.length, 2, "the manifest, and that file");
    await there.close();
  },

  async what_is_wrong_is_asked_for_once_more_and_never_kept() {
    const damaged = Uint8Array.from(bundle[LARGE]);
    damaged[1_500_000] ^= 1;
    const cache = new Map();
    const there = await host({ odd: ({ name, times }) => (name === LARGE && times < 4 ? { bytes: damaged } : {}) });
    await assert.rejects(upt.open(there.address, { cache }), refused("UPT_ERR_BUNDLE", /prior\.safetensors: SHA-256 is/));
    assert.equal(there.of(LARGE).length, 2);
    assert.ok(![...cache.values()].some((bytes) => bytes.length === 1 << 20), "a piece of it was kept");
    // An old copy of the host's comes first: the file that is asked for again is right.
    await opened(there.address, { cache });
    assert.equal(there.of(LARGE).length, 4);
    // What was damaged where it is kept comes again.
    const piece = [...cache].find(([, bytes]) => bytes.length === 1 << 20);
    piece[1][5] ^= 1;
    await opened(there.address, { cache });
    assert.equal(there.of(LARGE).length, 5);
    await opened(there.address, { cache });
    assert.equal(there.of(LARGE).length, 5);
    await there.close();
  },

  async sizes_and_places_that_are_wrong_are_told() {
    const short = await host({ odd: ({ name, files }) => (name === LARGE ? { bytes: files[LARGE].subarray(0, 1000) } : {}) });
    await assert.rejects(upt.open(short.address), refused("UPT_ERR_IO", /prior\.safetensors.*5 requests gave \d+ bytes/));
    await short.close();
    const long = await host({ odd: ({ name, files }) => (name === LARGE ? { bytes: Buffer.concat([files[LARGE], Buffer.alloc(9)]) } : {}) });
    await assert.rejects(upt.open(long.address), refused("UPT_ERR_BUNDLE", /prior\.safetensors: has 1930117 bytes/));
    await long.close();
    const gone = await host({ odd: ({ name }) => (name === LARGE ? { status: 404 } : {}) });
    await assert.rejects(upt.open(gone.address), refused("UPT_ERR_IO", /prior\.safetensors.*404 Not Found/));
    await assert.rejects(upt.open(`${gone.address}/none/bundle`, { fetch: async () => new Response("", { status: 403, statusText: "Forbidden" }) }), refused("UPT_ERR_IO", /bundle\.json: 403 Forbidden/));
    const sha256 = createHash("sha256").update(bundle["bundle.json"]).digest("hex");
    await assert.rejects(upt.open(gone.address, { sha256: sha256.replace(/^./, "g") }), refused("UPT_ERR_BUNDLE", /bundle\.json: SHA-256 is .* was asked for/));
    await gone.close();
    const right = await host();
    await opened(right.address, { sha256: sha256.toUpperCase() });
    await right.close();
  },

  async a_store_that_refuses_is_left_alone() {
    const there = await host();
    const full = () => {
      throw new Error("no room");
    };
    await opened(there.address, { cache: { get: full, set: full, delete: full } });
    await opened(there.address, { cache: { get: async () => full(), set: async () => full(), delete: full } });
    await there.close();
  },
};

await runTests(tests);
