// A surface as glTF 2.0, in its frame: metres, y up. `geometry` is three.js's, mm, z up.
export function gltf(geometry, name) {
  const { position, normal } = geometry.attributes;
  const indices = geometry.index.array;
  const turned = (source, scale) => {
    const out = new Float32Array(source.length);
    for (let i = 0; i < source.length; i += 3) {
      out[i] = scale * source[i];
      out[i + 1] = scale * source[i + 2];
      out[i + 2] = -scale * source[i + 1];
    }
    return out;
  };
  const parts = [turned(position.array, 1e-3), turned(normal.array, 1), new Uint32Array(indices)];
  const bounds = (pick) => [0, 1, 2].map((axis) => parts[0].reduce((found, x, i) => (i % 3 === axis ? pick(found, x) : found), pick === Math.min ? Infinity : -Infinity));
  let offset = 0;
  const views = parts.map((part) => {
    const view = { buffer: 0, byteOffset: offset, byteLength: part.byteLength };
    offset += part.byteLength;
    return view;
  });
  const bytes = new Uint8Array(offset);
  parts.forEach((part, i) => bytes.set(new Uint8Array(part.buffer), views[i].byteOffset));
  let text = "";
  for (let i = 0; i < bytes.length; i += 0x8000) text += String.fromCharCode(...bytes.subarray(i, i + 0x8000));
  const vectors = (bufferView, more) => ({ bufferView, componentType: 5126, count: position.count, type: "VEC3", ...more });
  return JSON.stringify({
    asset: { version: "2.0", generator: "upt view" },
    scene: 0,
    scenes: [{ nodes: [0] }],
    nodes: [{ mesh: 0, name }],
    meshes: [{ primitives: [{ attributes: { POSITION: 0, NORMAL: 1 }, indices: 2 }] }],
    accessors: [
      vectors(0, { min: bounds(Math.min), max: bounds(Math.max) }),
      vectors(1),
      { bufferView: 2, componentType: 5125, count: indices.length, type: "SCALAR" },
    ],
    bufferViews: views,
    buffers: [{ byteLength: bytes.length, uri: `data:application/octet-stream;base64,${btoa(text)}` }],
  });
}
