// How a frame's arrays come from the worker to the page: in memory that both see, where the page is isolated (the headers COOP and COEP), else as arrays of their
// own that are handed over.
const TURNS = 3; // frames that stay as they are: the page shows one while the next two are made

export class Outbox {
  /** Whether arrays are shared. */
  isShared;
  /** What this frame hands over. */
  handedOver = [];
  #turns = Array.from({ length: TURNS }, () => []);
  #used = 0;

  constructor(isWanted = true) {
    this.isShared = isWanted && globalThis.crossOriginIsolated === true;
  }

  /** Another frame. */
  begin() {
    this.handedOver = [];
    this.#turns.push(this.#turns.shift());
    this.#used = 0;
  }

  /** A copy of some numbers, for the page. */
  put(numbers) {
    if (!this.isShared) {
      const copy = numbers.slice();
      this.handedOver.push(copy.buffer);
      return copy;
    }
    const rooms = this.#turns[0];
    const place = this.#used;
    this.#used += 1;
    if ((rooms[place]?.byteLength ?? -1) < numbers.byteLength) rooms[place] = new SharedArrayBuffer(numbers.byteLength);
    const shared = new Float32Array(rooms[place], 0, numbers.length);
    shared.set(numbers);
    return shared;
  }
}
