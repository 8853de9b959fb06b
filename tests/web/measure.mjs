// The module beside native AVX2: node measure.mjs ROOT WASM PRESS PAGE BUNDLE..., where PRESS is press.c, built, and PAGE has the markers
// `begin: web` and `end: web`, between which the table goes (tests/docs/results.py run web). One thread, three corrections a step, the
// library's own time of each step. The two take turns; the first turn of each is not counted.
import { execFileSync } from "node:child_process";
import { readFileSync, readdirSync, writeFileSync } from "node:fs";
import { cpus, loadavg } from "node:os";
import { basename, join, resolve } from "node:path";
import { press } from "./press.mjs";

const TURNS = 12;
const STEPS = 40;

const [root, wasm, program, page, ...bundles] = process.argv.slice(2);
const { load } = await import(resolve(root, "web/src/index.js"));
const compiled = await WebAssembly.compile(readFileSync(wasm));

function native(bundle) {
  const told = execFileSync(program, [bundle, String(STEPS), "3", "/dev/null"], { env: { ...process.env, UPT_ISA: "avx2" } });
  return String(told).trim().split("\n").map(Number);
}

const quantile = (list, share) => [...list].sort((a, b) => a - b)[Math.min(Math.floor(share * list.length), list.length - 1)];

console.log(`${cpus()[0].model}, load ${loadavg()[0].toFixed(1)}; ${TURNS - 1} turns of ${STEPS} steps`);
let table = `
| bundle | nodes | native, ms: median, 99 % | WebAssembly, ms | ratio of medians (of ${TURNS - 1} turns) | memory |
|---|---:|---:|---:|---:|---:|
`;
for (const bundle of bundles) {
  const upt = await load({ wasm: compiled });
  const files = readdirSync(bundle).filter((name) => !name.startsWith("certificate"));
  const model = await upt.open(Object.fromEntries(files.map((name) => [name, readFileSync(join(bundle, name))])));
  const times = { native: [], wasm: [] };
  const ratios = [];
  for (let turn = 0; turn < TURNS; turn += 1) {
    const there = native(bundle);
    const here = [];
    press(upt, model, { steps: STEPS, corrections: 3, each: ({ step_ms: ms }) => here.push(ms) });
    if (turn === 0) continue;
    times.native.push(...there);
    times.wasm.push(...here);
    ratios.push(quantile(here, 0.5) / quantile(there, 0.5));
  }
  const told = Object.values(times).map((list) => [0.5, 0.99].map((share) => quantile(list, share).toPrecision(3)).join(", "));
  const [least, ratio, most] = [0, 0.5, 1].map((share) => quantile(ratios, share).toFixed(1));
  const nodes = model.info.node_count.toLocaleString("en");
  const memory = (upt.module.memoryBytes / 2 ** 20).toFixed(0);
  table += `| \`${basename(bundle)}\` | ${nodes} | ${told.join(" | ")} | ${ratio} (${least} to ${most}) | ${memory} MiB |\n`;
}
console.log(table);
const text = readFileSync(page, "utf8");
const [begin, end] = ["<!-- begin: web -->\n", "<!-- end: web -->"];
writeFileSync(page, text.slice(0, text.indexOf(begin) + begin.length) + table + "\n" + text.slice(text.indexOf(end)));
