// A tissue in a Web Worker: the worker steps, the page draws.
import { UptError } from "./module.js";

/** A tissue that a worker steps, as the page sees it. */
export class Tissue {
  #worker;
  #waiting = new Map(); // number of a question: {resolve, reject}
  #asked = 0;
  #ended;

  /** What the bundle is: the fields of `upt_model_info`. */
  info;
  /** The surface's nodes [n], of the mesh's. */
  nodes;
  /** Their rest positions [n,3], mm. */
  positions;
  /** Triangles of the surface [m,3], as places in `nodes`. */
  faces;
  /** 1 for each node of the surface that the bundle was made to be touched at [n]. */
  domain;
  /** Length of a step, s. */
  stepSeconds;
  /** Whether frames lie in memory that the worker shares. */
  isShared;

  /** Starts a worker and opens a bundle there: its address, `File`s, or bytes by name. */
  static async open(source, { progress, worker, ...options } = {}) {
    const tissue = new Tissue();
    tissue.#worker = worker ?? new Worker(new URL("./worker-main.js", import.meta.url), { type: "module" });
    tissue.#worker.onmessage = ({ data }) => tissue.#answer(data, progress);
    tissue.#worker.onerror = (event) => tissue.#end(new UptError("UPT_ERR_STATE", event.message || "the worker could not be started"));
    const folder = typeof source === "string" || source instanceof URL ? new URL(source, globalThis.location?.href).href : source;
    const made = await tissue.#ask("open", { source: folder, ...options });
    return Object.assign(tissue, made);
  }

  /**
   * The tissue of this moment, with the instruments where they are now. Steps are made between frames, at the clock's pace, with the
   * instruments where they were at each step's moment, but that one which holds tissue goes 5 mm a step at most. One whose `kind` is "blade", "aspirator" or "coagulator" changes the body in place of touching it.
   */
  frame(instruments = []) {
    return this.#ask("frame", instruments);
  }

  /** Points [p,3] at rest, mm, whose displacements each frame has from here on. */
  attach(points) {
    return this.#ask("attach", Float32Array.from(points));
  }

  /** The body before the last stroke of a blade, aspirator or coagulator; false where there is none. */
  undo() {
    return this.#ask("undo");
  }

  /** Back to rest, and the intact body. */
  reset() {
    return this.#ask("reset");
  }

  /** Keeps the instruments of each step from here on; false: no longer. */
  record(on) {
    return this.#ask("record", on);
  }

  /** From rest, makes the recorded steps again. */
  replay() {
    return this.#ask("replay");
  }

  /** Ends the worker, and all memory with it. */
  close() {
    this.#worker.terminate();
    this.#end(new UptError("UPT_ERR_HANDLE", "the tissue is closed"));
  }

  #ask(what, value) {
    if (this.#ended) return Promise.reject(this.#ended);
    const number = (this.#asked += 1);
    return new Promise((resolve, reject) => {
      this.#waiting.set(number, { resolve, reject });
      this.#worker.postMessage({ what, value, number });
    });
  }

  #answer({ number, value, error, progress }, tell) {
    if (progress) {
      tell?.(...progress);
      return;
    }
    const { resolve, reject } = this.#waiting.get(number) ?? {};
    this.#waiting.delete(number);
    if (error) reject?.(new UptError(error.status, error.message));
    else resolve?.(value);
  }

  #end(error) {
    this.#ended = error;
    for (const { reject } of this.#waiting.values()) reject(error);
    this.#waiting.clear();
  }
}
