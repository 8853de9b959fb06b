// The WebAssembly module: its instance, its memory, and its errors as exceptions. The C ABI is exported as it is (docs/reference/abi.md);
// src/ffi/host.rs says what is exported besides.
import * as abi from "./abi.js";

/** What the library refuses, in its own words. `status` is the name of its status, such as "UPT_ERR_BUNDLE". */
export class UptError extends Error {
  constructor(status, message) {
    super(message);
    this.name = "UptError";
    this.status = status;
  }
}

const NAMES = new Map(Object.entries(abi).filter(([name]) => name === "UPT_PENDING" || name.startsWith("UPT_ERR_")).map(([name, value]) => [value, name]));

// A module with one SIMD instruction: what a browser of before 2023 refuses.
const PROBE = [0, 97, 115, 109, 1, 0, 0, 0, 1, 5, 1, 96, 0, 1, 123, 3, 2, 1, 0, 10, 10, 1, 8, 0, 65, 0, 253, 15, 253, 98, 11];

async function compile(source) {
  const response = await source;
  if (response instanceof WebAssembly.Module) return response;
  if (!(response instanceof Response)) return WebAssembly.compile(response);
  if (!response.ok) throw new UptError("UPT_ERR_IO", `${response.url}: ${response.status} ${response.statusText}`);
  // Servers that do not know the type of .wasm files send another one, and then nothing is compiled while it arrives.
  const streams = response.headers.get("content-type")?.startsWith("application/wasm");
  return streams ? WebAssembly.compileStreaming(response) : WebAssembly.compile(await response.arrayBuffer());
}

/** One instance of the module. A panic ends it; others, and the page, go on. */
export class Module {
  #exports;
  #ended = "";
  #scratch;
  compiled;

  static async start(source, isa) {
    if (!WebAssembly.validate(new Uint8Array(PROBE))) {
      throw new UptError("UPT_ERR_UNSUPPORTED", "this browser runs no WebAssembly with SIMD; libupt needs one of 2023 or later");
    }
    const module = new Module();
    module.compiled = await compile(source);
    const instance = await WebAssembly.instantiate(module.compiled, { upt: { now_ms: () => performance.now() } });
    module.#exports = instance.exports;
    module.#scratch = module.alloc(512);
    module.withText(isa, (name) => module.check(module.call("upt_host_begin", name)));
    return module;
  }

  /** Calls an export. A trap, which is what a panic becomes, ends the instance. */
  call(name, ...parameters) {
    if (this.#ended) throw new UptError("UPT_ERR_PANIC", this.#ended);
    try {
      return this.#exports[name](...parameters);
    } catch (error) {
      if (!(error instanceof WebAssembly.RuntimeError)) throw error;
      let said = "";
      try {
        said = this.text(this.#exports.upt_last_error());
      } catch {
        // The memory is no longer what it was.
      }
      this.#ended = `this instance of libupt has ended in ${name} (${said || error.message}); load another one`;
      throw new UptError("UPT_ERR_PANIC", this.#ended);
    }
  }

  /** A status that is an error becomes an exception. */
  check(status) {
    if (status < 0) throw new UptError(NAMES.get(status) ?? String(status), this.text(this.call("upt_last_error")));
    return status;
  }

  /** Calls an export that returns a status. */
  run(name, ...parameters) {
    return this.check(this.call(name, ...parameters));
  }

  /** Bytes of the module's memory, which grows and never shrinks. */
  get memoryBytes() {
    return this.#exports.memory.buffer.byteLength;
  }

  get view() {
    return new DataView(this.#exports.memory.buffer);
  }

  bytes(at, count) {
    return new Uint8Array(this.#exports.memory.buffer, at, count);
  }

  floats(at, count) {
    return new Float32Array(this.#exports.memory.buffer, at, count);
  }

  words(at, count) {
    return new Uint32Array(this.#exports.memory.buffer, at, count);
  }

  text(at) {
    const end = this.bytes(at).indexOf(0);
    return new TextDecoder().decode(this.bytes(at, end));
  }

  alloc(bytes) {
    const at = this.call("upt_host_alloc", bytes);
    if (at === 0) throw new UptError("UPT_ERR_OUT_OF_MEMORY", `no memory for ${bytes} bytes`);
    return at;
  }

  free(at, bytes) {
    if (!this.#ended) this.call("upt_host_free", at, bytes);
  }

  /** Room for the time of a call. */
  withRoom(bytes, use) {
    const at = this.alloc(bytes);
    try {
      return use(at);
    } finally {
      this.free(at, bytes);
    }
  }

  /** A C string for the time of a call; NULL for none. */
  withText(text, use) {
    if (text === undefined) return use(0);
    const bytes = new TextEncoder().encode(`${text}\0`);
    return this.withRoom(bytes.length, (at) => {
      this.bytes(at, bytes.length).set(bytes);
      return use(at);
    });
  }

  /** Calls an export that writes one value to its last parameter. */
  out(name, ...parameters) {
    this.run(name, ...parameters, this.#scratch);
    return this.view.getUint32(this.#scratch, true);
  }

  /** Calls an export that fills one struct. */
  filled(layout, name, ...parameters) {
    this.write(this.#scratch, layout, {});
    this.run(name, ...parameters, this.#scratch);
    return this.read(this.#scratch, layout);
  }

  /** Files of the bundle that is opened next: name and bytes. */
  giveFiles(list) {
    for (const [name, bytes] of list) {
      const at = this.withText(name, (text) => this.call("upt_host_file", text, bytes.byteLength));
      if (at === 0) throw new UptError("UPT_ERR_OUT_OF_MEMORY", this.text(this.call("upt_last_error")));
      this.bytes(at, bytes.byteLength).set(bytes);
    }
  }

  /** Opens their bundle: a model's handle. */
  openFiles(options) {
    return this.withRoom(abi.upt_model_options.size, (at) => {
      this.write(at, abi.upt_model_options, options);
      return this.out("upt_host_open", at);
    });
  }

  /** Writes a struct: zeros, its size, and these fields. */
  write(at, layout, values) {
    this.bytes(at, layout.size).fill(0);
    const view = this.view;
    for (const [name, value] of Object.entries({ ...values, struct_size: layout.size })) {
      const [type, offset, count] = layout.fields[name];
      const size = type === "BigUint64" || type === "Float64" ? 8 : type === "Uint8" ? 1 : 4;
      const list = count > 1 ? value : [value];
      for (let i = 0; i < count; i += 1) view[`set${type}`](at + offset + size * i, type === "BigUint64" ? BigInt(list[i]) : list[i], true);
    }
  }

  /** Reads a struct; 64-bit integers become numbers. */
  read(at, layout) {
    const view = this.view;
    const values = {};
    for (const [name, [type, offset, count]] of Object.entries(layout.fields)) {
      if (name === "struct_size" || name === "reserved") continue;
      const number = (i) => Number(view[`get${type}`](at + offset + 4 * i, true));
      values[name] = count > 1 ? Array.from({ length: count }, (_, i) => number(i)) : number(0);
    }
    return values;
  }
}
