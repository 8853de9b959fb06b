// What acts on the tissue beside instruments: gravity, forces, pressure, supports, ties. From fields of JavaScript to the lists of the C ABI.
import * as abi from "./abi.js";
import { choice } from "./instruments.js";

const ENDS = { support: abi.UPT_END_SUPPORT, world: abi.UPT_END_WORLD, instrument: abi.UPT_END_INSTRUMENT, tissue: abi.UPT_END_TISSUE };

// Fewer than three nodes: the first again, with no weight.
const three = (list, rest) => [...list, rest, rest, rest].slice(0, 3);

function rawTie(tie, at) {
  const { to = "support", nodes, otherNodes = [0] } = tie;
  return {
    to: choice(ENDS, to, `ties[${at}].to`),
    nodes: three(nodes, nodes[0]),
    weights: three(tie.weights ?? [], 0),
    place: tie.place ?? [0, 0, 0],
    instrument: tie.instrument ?? 0,
    other_nodes: three(otherNodes, otherNodes[0]),
    other_weights: three(tie.otherWeights ?? [], 0),
    stiffness: tie.stiffness ?? 0,
    slack_mm: tie.slack ?? 0,
    damping: tie.damping ?? 0,
    break_mn: tie.breakForce ?? 0,
    pushes: tie.pushes ? 1 : 0,
  };
}

function tieOf(raw) {
  const to = Object.keys(ENDS).find((name) => ENDS[name] === raw.to);
  const { nodes, weights, place, stiffness, damping } = raw;
  return { to, nodes, weights, place, stiffness, damping, slack: raw.slack_mm, breakForce: raw.break_mn };
}

// Plans room for lists, and fills it once it is there.
class Room {
  #bytes = 0;
  #fills = [];

  /** Structs, each made of the address of the room; gives what tells the address of the list. */
  structs(layout, list, fields) {
    const offset = this.#take(layout.size * list.length);
    this.#fills.push((module, at) => list.forEach((own, i) => module.write(at + offset + layout.size * i, layout, fields(own, i, at))));
    return (at) => (list.length ? at + offset : 0);
  }

  /** Numbers of 32 bits; none give NULL. */
  numbers(list, type) {
    if (!list?.length) return () => 0;
    const offset = this.#take(4 * list.length);
    this.#fills.push((module, at) => module[type](at + offset, list.length).set(list));
    return (at) => at + offset;
  }

  use(module, call) {
    return module.withRoom(Math.max(this.#bytes, 8), (at) => {
      for (const fill of this.#fills) fill(module, at);
      return call(at);
    });
  }

  #take(bytes) {
    const at = this.#bytes;
    this.#bytes += 8 * Math.ceil(bytes / 8);
    return at;
  }
}

/** Calls `use` with the fields of `upt_input` for these loads, whose lists last as long. */
export function withLoads(module, loads, use) {
  if (loads === undefined) return use({});
  const { gravity = [0, 0, 0], gravityAtRest = [0, 0, 0], support, forces, pointForces = [], pressures = [], ties = [], supports = [] } = loads;
  const room = new Room();
  const onNodes = room.numbers(forces, "floats");
  const atPoints = room.structs(abi.upt_point_force, pointForces, (own) => ({ nodes: [...own.nodes], weights: [...own.weights], force: own.force }));
  const regions = pressures.map((own) => room.numbers(own.nodes, "words"));
  const pressed = room.structs(abi.upt_pressure, pressures, (own, i, at) => ({ pascal: own.pascal, nodes: regions[i](at), node_count: own.nodes?.length ?? 0 }));
  const tied = room.structs(abi.upt_tie, ties, rawTie);
  const moved = supports.map((own) => room.numbers(own.displacements, "floats"));
  const led = room.structs(abi.upt_support, supports, (own, i, at) => ({
    group: own.group,
    position: own.position ?? [0, 0, 0],
    rotation: own.rotation ?? [0, 0, 0, own.displacements ? 0 : 1],
    let_go: own.letGo ? 1 : 0,
    displacements: moved[i](at),
    displacement_count: own.displacements?.length ?? 0,
  }));
  return room.use(module, (at) =>
    use({
      gravity,
      gravity_at_rest: gravityAtRest,
      support_position: support?.position ?? [0, 0, 0],
      support_rotation: support ? (support.rotation ?? [0, 0, 0, 1]) : [0, 0, 0, 0],
      forces: onNodes(at),
      point_forces: atPoints(at),
      point_force_count: pointForces.length,
      pressures: pressed(at),
      pressure_count: pressures.length,
      ties: tied(at),
      tie_count: ties.length,
      supports: led(at),
      support_count: supports.length,
    }),
  );
}

/** The points of the mesh at places at rest [n, 3], mm: four nodes and their weights each. */
export function located(module, model, places) {
  const list = Float32Array.from(places.flat());
  const count = Math.floor(list.length / 3);
  const room = new Room();
  const given = room.numbers(list, "floats");
  const [nodes, weights] = [new Uint32Array(4 * count), new Float32Array(4 * count)];
  const [nodesAt, weightsAt] = [room.numbers(nodes, "words"), room.numbers(weights, "floats")];
  return room.use(module, (at) => {
    module.run("upt_model_locate_points", model, given(at), BigInt(count), nodesAt(at), weightsAt(at));
    const four = (values, i) => Array.from(values.subarray(4 * i, 4 * i + 4));
    const [n, w] = [module.words(nodesAt(at), 4 * count), module.floats(weightsAt(at), 4 * count)];
    return Array.from({ length: count }, (_, i) => ({ nodes: four(n, i), weights: four(w, i) }));
  });
}

/** The ties of a bed about a centre: pass them in every step. */
export function bed(module, scene, { centre = [0, 0, 0], radius = 0, nodes = [], stiffness, breakForce = 0, damping = 0, slack = 0, offset = [0, 0, 0] }) {
  const room = new Room();
  const region = room.numbers(nodes, "words");
  const fields = (_, i, at) => ({ centre, radius_mm: radius, nodes: region(at), node_count: nodes.length, stiffness, break_mn: breakForce, damping, slack_mm: slack, offset });
  const asked = room.structs(abi.upt_bed, [0], fields);
  return room.use(module, (at) => {
    const count = module.out("upt_scene_bed", scene, asked(at), 0, 0n);
    const { size } = abi.upt_tie;
    const end = 8 * Math.ceil((size * count) / 8);
    return module.withRoom(end + 8, (out) => {
      for (let i = 0; i < count; i += 1) module.write(out + size * i, abi.upt_tie, {});
      module.run("upt_scene_bed", scene, asked(at), out, BigInt(count), out + end);
      return Array.from({ length: count }, (_, i) => tieOf(module.read(out + size * i, abi.upt_tie)));
    });
  });
}

/** What each tie of the last step does: the fields of `upt_tie_reading`. */
export function tieReadings(module, scene, count) {
  const { size } = abi.upt_tie_reading;
  return module.withRoom(size * count + 8, (at) => {
    for (let i = 0; i < count; i += 1) module.write(at + size * i, abi.upt_tie_reading, {});
    module.run("upt_scene_read_ties", scene, at, BigInt(count));
    return Array.from({ length: count }, (_, i) => module.read(at + size * i, abi.upt_tie_reading));
  });
}
