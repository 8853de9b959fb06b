// The files of a bundle, from wherever the page has them: name and bytes. The library checks their sizes and hashes itself.
import { get as usual } from "./get.js";
import { UptError } from "./module.js";

const MANIFEST = "bundle.json";

/** `source`: the address of a folder, a list of `File`s, or bytes by name. */
export async function files(source, { fetch: get = usual, progress } = {}) {
  if (typeof source === "string" || source instanceof URL) return fetched(new URL(`${source}`.replace(/\/?$/, "/"), globalThis.location?.href), get, progress);
  const isFile = (one) => typeof one?.arrayBuffer === "function" && "name" in one;
  const list = typeof source?.[Symbol.iterator] === "function" ? [...source] : undefined;
  if (list?.every(isFile)) return Promise.all(list.map(async (file) => [file.name, new Uint8Array(await file.arrayBuffer())]));
  const pairs = list ?? Object.entries(source);
  return pairs.map(([name, bytes]) => [name, ArrayBuffer.isView(bytes) ? new Uint8Array(bytes.buffer, bytes.byteOffset, bytes.byteLength) : new Uint8Array(bytes)]);
}

// The manifest, then all that it lists, at once. A file's address carries its hash, so that a cache keeps it for good.
async function fetched(folder, get, progress) {
  // What the folder does not have may lie in that of the body, beside it.
  const read = async (url, other) => {
    const response = await get(url);
    if (!response.ok && other) return read(other);
    if (!response.ok) throw new UptError("UPT_ERR_IO", `${url}: ${response.status} ${response.statusText}`);
    return new Uint8Array(await response.arrayBuffer());
  };
  const manifest = await read(new URL(MANIFEST, folder));
  let listed = {};
  let body;
  try {
    const fields = JSON.parse(new TextDecoder().decode(manifest));
    listed = fields.files ?? {};
    if (/^[\w-][\w.-]*$/.test(fields.body)) body = new URL(`../${fields.body}/`, folder);
  } catch {
    // The library says what is wrong with it.
  }
  const total = Object.values(listed).reduce((sum, { bytes }) => sum + bytes, 0);
  let done = 0;
  const read_listed = async ([name, { bytes, sha256 }]) => {
    const [own, other] = [folder, body].map((place) => {
      const url = place && new URL(name, place);
      if (url) url.search = `sha256=${String(sha256).slice(0, 16)}`;
      return url;
    });
    const file = await read(own, other);
    done += bytes;
    progress?.(done, total);
    return [name, file];
  };
  return [[MANIFEST, manifest], ...(await Promise.all(Object.entries(listed).map(read_listed)))];
}
