// The page of `cargo xtask site`: what the server of `upt view` is there, a worker is here (crates/cli/src/view/protocol.rs).
import { Tissue } from "./libupt/worker.js";

const HEADER = 36;

export function connect({ hello, geometry, frame, surface, refused, tell }) {
  let tissue;
  let touchable; // 1 for each node of the mesh that the bundle was made to be touched at
  document.getElementById("breathe").style.display = "none"; // of the server alone
  const failed = (error) => tell(error.message);
  const begin = async () => {
    const [bundle, made] = await open(tell);
    const { info, nodes, positions, faces, domain, stepSeconds: dt } = made;
    touchable = new Uint32Array(info.node_count);
    nodes.forEach((node, i) => {
      touchable[node] = domain[i];
    });
    hello({ bundle, node_count: info.node_count, surface_node_count: domain.length, surface_face_count: faces.length / 3, dt, max_push_mm: info.max_push_mm, presents: true });
    geometry(await new Blob([positions, faces, domain]).arrayBuffer());
    tissue = made;
  };
  begin().catch(failed);
  const take = (made, sequence) => {
    if (made.surface) surface(...changed(made.surface, touchable));
    if (made.surgery.refused) refused(made.surgery.refused);
    frame(packed(made, sequence));
  };
  return ({ tool, sequence, reset, record, replay, undo }) => {
    if (!tissue) return;
    if (undo) tissue.undo().catch(failed);
    else if (reset) tissue.reset().catch(failed);
    else if (record !== undefined) tissue.record(record).catch(failed);
    else if (replay) tissue.replay().catch(failed);
    else tissue.frame(tool ? [instrument(tool)] : []).then((made) => take(made, sequence)).catch(failed);
  };
}

// The bundle of the address, of those that the site has.
async function open(tell) {
  const listed = await (await fetch("bundles.json")).json();
  const wanted = new URLSearchParams(location.search).get("bundle");
  const chosen = listed.find(({ name }) => name === wanted) ?? listed[0];
  const list = document.getElementById("bundles");
  for (const { name, title } of listed) list.add(new Option(title, name, false, name === chosen.name));
  list.hidden = listed.length < 2;
  list.addEventListener("change", () => {
    location.search = `bundle=${list.value}`;
  });
  tell("Loading ...");
  const progress = (done, total) => tell(done < total ? `Loading ${chosen.title}: ${((100 * done) / total).toFixed(0)} %` : "Opening ...");
  return [chosen.title.replace(/ \(.*/, ""), await Tissue.open(`bundles/${chosen.name}`, { gzip: true, progress })];
}

const KINDS = ["press", "blade", "aspirator", "coagulator"]; // in the order of protocol.rs

function instrument({ position, rotation, radius, half_length: halfLength, friction, grasp, kind }) {
  return { position, rotation, radius, halfLength, friction, mode: grasp ? "grasp" : "slide", kind };
}

// What is new of the surface, as the server says it: a header, and numbers of 32 bits.
function changed({ isNew, vertices, slots, firstVertex, rest, changed: list, corners, inside, hardened }, touchable) {
  const header = { vertices, slots, first_vertex: firstVertex, changed: list.length, hardened: hardened.length, is_new: isNew };
  // The first vertices are the mesh's nodes.
  const domain = Uint32Array.from({ length: vertices - firstVertex }, (_, i) => touchable[firstVertex + i] ?? 1);
  const parts = [rest, domain, list, corners, inside, hardened];
  const data = new Uint8Array(parts.reduce((sum, part) => sum + part.byteLength, 0));
  let at = 0;
  for (const part of parts) {
    data.set(new Uint8Array(part.buffer, part.byteOffset, part.byteLength), at);
    at += part.byteLength;
  }
  return [header, data.buffer];
}

// A frame as the server sends it.
function packed({ displacement, instruments: [tool], readings: [reading], surgery, stats, timing, recording, replaying, frameMs }, sequence) {
  const data = new ArrayBuffer(4 * (HEADER + displacement.length));
  const [words, numbers] = [new Uint32Array(data, 0, HEADER), new Float32Array(data)];
  words[0] = sequence;
  words[1] = stats.flags;
  words[2] = reading?.contact_count ?? 0;
  words[3] = Number(recording) | (Number(replaying) << 1) | (stats.sleeping << 2);
  numbers[4] = timing.step_ms;
  numbers[5] = stats.indicator;
  numbers.set(reading?.force ?? surgery.force, 6);
  numbers[9] = stats.max_displacement_mm;
  numbers[10] = frameMs;
  words[11] = stats.step_count;
  words[12] = stats.corrections;
  numbers[13] = stats.error_mm;
  numbers[14] = reading?.penetration_mm ?? 0;
  words[15] = tool ? 1 : 0;
  if (tool) numbers.set([...tool.position, ...tool.rotation, tool.radius], 16);
  words[24] = KINDS.indexOf(tool?.kind ?? "press");
  numbers[25] = surgery.areaMm2;
  numbers[26] = surgery.removedMm3;
  words[27] = surgery.copies;
  words[28] = surgery.undos;
  numbers[29] = surgery.changeMs;
  numbers.set(displacement, HEADER);
  return data;
}
