// The files of a bundle, from wherever the page has them: name and bytes. The library checks their sizes and hashes itself.
import { download, isPacked, sha256 as digest, unpacked } from "./download.js";
import { get as usual } from "./get.js";
import { UptError } from "./module.js";
import { ownStore } from "./store.js";

const MANIFEST = "bundle.json";

/** `source`: the address of a folder, a list of `File`s, or bytes by name. */
export async function files(source, options = {}) {
  if (typeof source === "string" || source instanceof URL) return fetched(new URL(`${source}`.replace(/\/?$/, "/"), globalThis.location?.href), options);
  const isFile = (one) => typeof one?.arrayBuffer === "function" && "name" in one;
  const list = typeof source?.[Symbol.iterator] === "function" ? [...source] : undefined;
  if (list?.every(isFile)) return Promise.all(list.map(async (file) => [file.name, new Uint8Array(await file.arrayBuffer())]));
  const pairs = list ?? Object.entries(source);
  return pairs.map(([name, bytes]) => [name, ArrayBuffer.isView(bytes) ? new Uint8Array(bytes.buffer, bytes.byteOffset, bytes.byteLength) : new Uint8Array(bytes)]);
}

// The manifest, then all that it lists, at once. A file's address carries its hash, so that a cache keeps it for good.
async function fetched(folder, { fetch: get = usual, progress, cache, gzip, sha256 }) {
  const store = cache === false ? undefined : typeof cache === "object" ? cache : await ownStore();
  const manifest = await manifestOf(new URL(gzip ? `${MANIFEST}.gz` : MANIFEST, folder), { get, store, sha256 });
  let listed = [];
  let body;
  try {
    const fields = JSON.parse(new TextDecoder().decode(manifest));
    listed = Object.entries(fields.files ?? {}).filter(([, file]) => typeof file === "object" && file);
    if (/^[\w-][\w.-]*$/.test(fields.body)) body = new URL(`../${fields.body}/`, folder);
  } catch {
    // The library says what is wrong with it.
  }
  const total = listed.reduce((sum, [, { bytes }]) => sum + bytes, 0);
  const done = new Map(); // bytes of each file
  const tell = (name, bytes) => {
    done.set(name, bytes);
    progress?.([...done.values()].reduce((sum, some) => sum + some, 0), total);
  };
  const take = async ([name, wanted]) => {
    const places = (body ? [folder, body] : [folder]).map((place) => {
      const url = new URL(gzip ? `${name}.gz` : name, place);
      url.search = `sha256=${String(wanted.sha256).slice(0, 16)}`;
      return url;
    });
    const heard = (some, all) => tell(name, Math.floor((wanted.bytes * some) / all));
    const file = await download(places, wanted, { get, store, gzip, heard });
    tell(name, wanted.bytes);
    return [name, file];
  };
  return [[MANIFEST, manifest], ...(await Promise.all(listed.map(take)))];
}

// As the host has it now; where it does not answer, as it was when it last did.
async function manifestOf(url, { get, store, sha256 }) {
  const key = `manifest/${encodeURIComponent(url.href)}`;
  let bytes;
  try {
    const response = await get(url, { cache: "no-cache" });
    if (!response.ok) throw new UptError("UPT_ERR_IO", `${url}: ${response.status} ${response.statusText}`);
    bytes = new Uint8Array(await response.arrayBuffer());
    if (isPacked(bytes)) bytes = await unpacked(bytes);
    if (!bytes) throw new UptError("UPT_ERR_IO", `${url}: is not whole`);
    await kept(() => store?.set(key, bytes));
  } catch (error) {
    bytes = error instanceof UptError ? undefined : await kept(() => store?.get(key));
    if (!bytes) throw error instanceof UptError ? error : new UptError("UPT_ERR_IO", `${url}: ${error.message}`);
  }
  if (sha256 === undefined) return bytes;
  const found = await digest(bytes);
  if (found === undefined) throw new UptError("UPT_ERR_UNSUPPORTED", "a bundle's SHA-256 can be checked on a secure page (https, or this machine) alone");
  if (found !== sha256.toLowerCase()) throw new UptError("UPT_ERR_BUNDLE", `${url}: SHA-256 is ${found}, ${sha256} was asked for`);
  return bytes;
}

// A store without room or rights keeps nothing.
async function kept(use) {
  try {
    return await use();
  } catch {
    return undefined;
  }
}
