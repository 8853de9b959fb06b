// The worker's side of worker.js: owns the library, keeps step with the clock, answers one question after another.
import { Clock, between } from "./clock.js";
import { files } from "./files.js";
import { load } from "./index.js";
import { Outbox } from "./outbox.js";
import { Surgery, isCutting } from "./surgery.js";

const LONGEST_RECORDING = 45_000; // steps: a quarter of an hour of 20 ms

let scene;
let surgery;
let clock;
let outbox;
let dt;
let framed = 0; // when the last frame was made, s
let timer;
let attached = false;
let instruments = []; // of the last step
let last = { readings: [], stats: undefined, timing: undefined };
let recording;
let recorded = [];
let replayed; // the recorded step that comes next
let failed; // what a step between two questions ended with

const now = () => performance.now() / 1000;

// The module, which comes compressed from hosts that compress nothing themselves.
async function unpacked(url) {
  const response = await fetch(`${url}`.replace(/(\?|$)/, ".gz$1"));
  if (!response.ok) return response;
  return new Response(response.body.pipeThrough(new DecompressionStream("gzip")), { headers: { "content-type": "application/wasm" } });
}

const answers = {
  async open({ source, scene: options = {}, wasm, isa, shared, ...more }) {
    outbox = new Outbox(shared);
    const address = wasm ?? new URL("./upt.wasm", import.meta.url);
    const module = address instanceof WebAssembly.Module ? address : more.gzip ? unpacked(address) : fetch(address);
    const bundle = files(source, { ...more, progress: (...progress) => postMessage({ progress }) });
    const [upt, given] = await Promise.all([load({ wasm: module, isa }), bundle]);
    const model = await upt.open(given, more);
    const { info } = model;
    dt = options.stepSeconds ?? info.frame_step_s;
    // No correction begins after this share of a step, so that steps keep up with the clock.
    scene = model.scene({ guard: "report", stepSeconds: dt, budgetUs: Math.round(0.3e6 * dt), ...options });
    surgery = new Surgery(scene, model);
    clock = new Clock(dt);
    const nodes = model.indices("surfaceNodes");
    const all = model.positions();
    const place = new Map(Array.from(nodes, (node, i) => [node, i]));
    const positions = new Float32Array(3 * nodes.length);
    nodes.forEach((node, i) => positions.set(all.subarray(3 * node, 3 * node + 3), 3 * i));
    const domain = new Uint32Array(nodes.length);
    for (const node of model.indices("domainNodes")) if (place.has(node)) domain[place.get(node)] = 1;
    const faces = model.indices("surfaceFaces").map((node) => place.get(node));
    scene.setRegion(nodes);
    last = measured([]);
    return { info: { ...info, name: model.describe().name }, nodes, positions, faces, domain, stepSeconds: dt, isShared: outbox.isShared };
  },

  frame(given) {
    const begun = performance.now();
    framed = now();
    let shown = given;
    if (replayed !== undefined) {
      const at = (step) => recorded[step] ?? [];
      shown = between(at(Math.max(replayed - 1, 0)), at(replayed), clock.part(framed));
    }
    clock.start(framed);
    const pressing = shown.filter((tool) => !isCutting(tool));
    const surface = surgery.news();
    let displacement;
    let points;
    outbox.begin();
    try {
      displacement = outbox.put(scene.present(clock.since(framed), pressing, { surface: surgery.begun }));
      points = attached ? outbox.put(scene.present(clock.since(framed), pressing, { points: true })) : undefined;
    } catch (error) {
      if (surface) surgery.repeat();
      throw error;
    }
    const frameMs = performance.now() - begun;
    // Steps lie between poses that the library has taken: one that it refused would be in the way of those to come.
    clock.moved(framed, shown);
    clearTimeout(timer);
    timer = setTimeout(stepOn);
    return {
      displacement,
      points,
      surface,
      surgery: surgery.told(),
      instruments: shown,
      frameMs,
      recording: recording !== undefined,
      replaying: replayed !== undefined,
      ...last,
    };
  },

  attach(points) {
    scene.attachPoints(points);
    attached = points.length > 0;
  },

  undo() {
    return surgery.undo();
  },

  reset() {
    surgery.reset();
    scene.reset();
    clock = new Clock(dt);
    replayed = undefined;
    last = measured([]);
  },

  record(on) {
    if (on) recording = [];
    else if (recording) [recorded, recording] = [recording, undefined];
  },

  replay() {
    answers.reset();
    recording = undefined;
    replayed = 0;
  },
};

function measured(readings) {
  return { readings, stats: scene.stats(), timing: scene.timing() };
}

// The steps that are due, one at a time, so that a frame that is asked for meanwhile comes between.
function stepOn() {
  if (!clock.due(framed)) return;
  instruments = clock.step(framed);
  if (replayed !== undefined) {
    instruments = recorded[replayed] ?? [];
    replayed = replayed < recorded.length ? replayed + 1 : undefined;
  }
  if (recording && recording.length < LONGEST_RECORDING) recording.push(instruments);
  try {
    surgery.operate(instruments, dt);
    scene.step(instruments.filter((tool) => !isCutting(tool)));
    last = measured(scene.readings());
  } catch (error) {
    failed = error;
    return;
  }
  timer = setTimeout(stepOn);
}
onmessage = async ({ data: { what, value, number } }) => {
  try {
    if (failed) throw failed;
    const answer = await answers[what](value);
    postMessage({ number, value: answer }, what === "frame" ? outbox.handedOver : what === "open" ? [answer.positions.buffer] : []);
  } catch (error) {
    failed = undefined;
    postMessage({ number, error: { status: error.status ?? "UPT_ERR_STATE", message: error.message } });
  }
};
