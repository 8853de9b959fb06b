// What is kept of bundles between visits: bytes by name, in the browser's Cache API. A `Map` does for a host that has none.
const NAME = "libupt-1";

// Names of the Cache API are addresses; nobody owns this one.
const address = (key) => `https://libupt.invalid/${key}`;

/** The browser's own; nothing in Node, and where a page is not secure (https, or this machine). */
export async function ownStore() {
  try {
    const cache = await globalThis.caches?.open(NAME);
    return cache && new Store(cache);
  } catch {
    return undefined; // a sandboxed frame, or a visit that keeps nothing
  }
}

/** Forgets all bundles that were kept. */
export async function forgetBundles() {
  await globalThis.caches?.delete(NAME);
}

class Store {
  #cache;

  constructor(cache) {
    this.#cache = cache;
  }

  async get(key) {
    const found = await this.#cache.match(address(key));
    return found && new Uint8Array(await found.arrayBuffer());
  }

  set(key, bytes) {
    return this.#cache.put(address(key), new Response(bytes));
  }

  delete(key) {
    return this.#cache.delete(address(key));
  }
}
