// A file of a bundle from an address, by its size and SHA-256. What was kept of it is read, what is missing is asked for by Range, as often as connections end, and
// what has another hash comes once more from its beginning. Bytes that are wrong then are the library's to refuse.
import { UptError } from "./module.js";

const PIECE = 1 << 20; // bytes: what is kept at once while a file comes, and all that a closed page loses
const MOST_REQUESTS = 5;
const WAIT_MS = 200; // before the third request, and so much longer before each one after it

/** `places`: addresses where it may lie. `wanted`: `bytes` and `sha256` as the manifest says. `heard` is told of bytes as they come, and of all. */
export async function download(places, wanted, { get, store, gzip = false, heard = () => {} }) {
  const isNamed = /^[0-9a-f]{64}$/.test(wanted.sha256);
  const file = new Arriving(isNamed ? store : undefined, `${wanted.sha256}${gzip ? ".gz" : ""}`, gzip, wanted.bytes);
  await file.recall();
  let whole = await fill(file, places, get, {}, heard);
  if (await isRight(whole, wanted.sha256)) {
    file.keep();
    return whole;
  }
  file.forget(); // kept long ago, or a host's old copy
  whole = await fill(file, places, get, { cache: "reload" }, heard);
  if (await isRight(whole, wanted.sha256)) file.keep();
  else file.forget();
  return whole;
}

/** Lower-case digits; nothing where the browser has no digest: a page that is not secure. */
export async function sha256(bytes) {
  const digest = await globalThis.crypto?.subtle?.digest("SHA-256", bytes);
  return digest && Array.from(new Uint8Array(digest), (byte) => byte.toString(16).padStart(2, "0")).join("");
}

async function isRight(bytes, wanted) {
  const found = wanted && (await sha256(bytes));
  return found === undefined || found === wanted;
}

// Asks until the file is whole.
async function fill(file, places, get, options, heard) {
  const [url, ...others] = places;
  let last = "";
  for (let request = 0; request < MOST_REQUESTS; request += 1) {
    const whole = await file.whole();
    if (whole) return whole;
    if (request > 1) await new Promise((resolve) => setTimeout(resolve, WAIT_MS * (request - 1)));
    const from = file.length;
    try {
      const response = await get(url, from > 0 ? { ...options, headers: { range: `bytes=${from}-` } } : options);
      if (!response.ok) last = `${response.status} ${response.statusText}`;
      if (response.ok) last = await file.take(response, heard);
      else if (response.status === 416) file.clear();
      else if (response.status < 500) return await elsewhere(file, others, get, options, heard, `${url}: ${last}`);
    } catch (error) {
      if (error instanceof UptError) throw error;
      last = error.message;
    }
  }
  const whole = await file.whole();
  if (whole) return whole;
  throw new UptError("UPT_ERR_IO", `${url}: ${MOST_REQUESTS} requests gave ${file.length} bytes, which make no file of ${file.wanted}; the last one: ${last}`);
}

// What the folder does not have may lie in that of the body, beside it.
function elsewhere(file, others, get, options, heard, said) {
  if (others.length === 0) throw new UptError("UPT_ERR_IO", said);
  return fill(file, others, get, options, heard);
}

// The bytes of a file as the host sends them, packed or not, of which whole pieces are kept as they come.
class Arriving {
  #store;
  #key;
  #gzip;
  #chunks = [];
  #stored = 0; // bytes in pieces that are kept
  #ended = false; // the last answer came to its end
  #used = Promise.resolve();
  length = 0;
  wanted;

  constructor(store, key, gzip, wanted) {
    this.#store = store;
    this.#key = key;
    this.#gzip = gzip;
    this.wanted = wanted;
  }

  // Whole pieces and, of a file that was right, the last one.
  async recall() {
    for (let i = 0; this.#stored === i * PIECE; i += 1) {
      const piece = await this.#use((store) => store.get(`${this.#key}/${i}`));
      if (!piece) return;
      this.#chunks.push(piece);
      this.length += piece.length;
      this.#stored = this.length;
    }
  }

  /** Nothing of it has come. */
  clear() {
    this.#chunks = [];
    this.length = 0;
    this.#stored = 0;
    this.#ended = false;
  }

  /** The rest, or all of it where a host knows no ranges. What there is to say where it came to no good end. */
  async take(response, heard) {
    this.#ended = false;
    const range = /^bytes (\d+)-/.exec(response.headers.get("content-range"));
    if (response.status === 206 && Number(range?.[1]) !== this.length) {
      this.clear();
      return "another range than the one that was asked for";
    }
    if (response.status !== 206) this.clear();
    const total = this.length + Number(response.headers.get("content-length") ?? this.wanted);
    const reader = response.body?.getReader();
    for (;;) {
      const { done, value } = (await reader?.read()) ?? { done: true };
      if (done) break;
      this.#chunks.push(value);
      this.length += value.length;
      heard(Math.min(this.length, total), total);
      if (this.length - this.#stored >= PIECE) this.#keepPieces(PIECE);
    }
    this.#ended = true;
    return "too few bytes";
  }

  /** Its bytes, once all are there. */
  async whole() {
    if (this.#gzip && this.length !== this.wanted && isPacked(this.#joined())) return unpacked(this.#joined());
    const isWhole = Number.isSafeInteger(this.wanted) ? this.length >= this.wanted : this.#ended;
    return isWhole && (this.length > 0 || this.#ended) ? this.#joined() : undefined;
  }

  /** Keeps what is not yet kept: the file is right. */
  keep() {
    this.#keepPieces(1);
  }

  /** Nothing of it is kept: it is wrong. */
  forget() {
    const pieces = Math.ceil(this.#stored / PIECE);
    for (let i = 0; i < pieces; i += 1) this.#use((store) => store.delete(`${this.#key}/${i}`));
    this.clear();
  }

  #keepPieces(least) {
    if (!this.#store || this.length - this.#stored < least) return;
    const bytes = this.#joined();
    for (; this.length - this.#stored >= least; this.#stored += PIECE) {
      const piece = bytes.slice(this.#stored, this.#stored + PIECE);
      const key = `${this.#key}/${this.#stored / PIECE}`;
      this.#use((store) => store.set(key, piece));
    }
    this.#stored = Math.min(this.#stored, this.length);
  }

  // One after another. A store without room or rights keeps nothing, and the bundle opens all the same.
  #use(call) {
    this.#used = this.#used
      .then(() => this.#store && call(this.#store))
      .catch(() => {
        this.#store = undefined;
      });
    return this.#used;
  }

  #joined() {
    if (this.#chunks.length === 1) return this.#chunks[0];
    const all = new Uint8Array(this.length);
    let at = 0;
    for (const chunk of this.#chunks) {
      all.set(chunk, at);
      at += chunk.length;
    }
    this.#chunks = [all];
    return all;
  }
}

/** By gzip. */
export function isPacked(bytes) {
  return bytes[0] === 0x1f && bytes[1] === 0x8b;
}

/** What gzip has packed; nothing where its end is missing, or it is damaged. */
export async function unpacked(bytes) {
  try {
    return new Uint8Array(await new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"))).arrayBuffer());
  } catch {
    return undefined;
  }
}
