// How the page of `upt view` draws: the renderer, its materials, the normals of a surface that moves.
// Where no graphics card draws, the processor does, beside the library: then light is computed at the corners, edges are not smoothed and pixels
// are a third larger.
import * as three from "./three.js";

// Names by which browsers call drawing by software.
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;

function drawsBySoftware() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const names = gl?.getExtension("WEBGL_debug_renderer_info");
  const found = names ? gl.getParameter(names.UNMASKED_RENDERER_WEBGL) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return SOFTWARE.test(found);
}

// Drawn pixels in a row for each of the page's, where the processor draws.
const COARSE = 0.75;

export const software = drawsBySoftware();

export function makeRenderer(canvas) {
  const renderer = new three.WebGLRenderer({ canvas, antialias: !software });
  renderer.setPixelRatio(software ? COARSE : Math.min(window.devicePixelRatio, 2));
  return renderer;
}

// Light from the eye at each corner; the colours are linear, the picture's are not.
const VERTEX = `
  varying vec3 shade;
  uniform vec3 tint;
  uniform float gloss;
  void main() {
    vec4 place = modelViewMatrix * vec4(position, 1.0);
    vec3 n = normalize(normalMatrix * normal);
    float facing = max(dot(n, normalize(vec3(0.0, 0.0, 1.0) - 0.3 * normalize(place.xyz))), 0.0);
    vec3 base = tint;
    #ifdef USE_COLOR
      base *= color;
    #endif
    shade = pow(base * (0.28 + 0.62 * facing) + gloss * pow(facing, 40.0), vec3(1.0 / 2.2));
    gl_Position = projectionMatrix * place;
  }`;
const FRAGMENT = `
  varying vec3 shade;
  void main() { gl_FragColor = vec4(shade, 1.0); }`;

function atCorners(vertexColors, tint, gloss) {
  const uniforms = { tint: { value: new three.Color(tint) }, gloss: { value: gloss } };
  return new three.ShaderMaterial({ uniforms, vertexColors, vertexShader: VERTEX, fragmentShader: FRAGMENT });
}

export function tissueMaterial() {
  if (software) return atCorners(true, 0xffffff, 0.03);
  return new three.MeshStandardMaterial({ vertexColors: true, roughness: 0.55 });
}

// Of what lay inside of the intact organ: moist.
export function insideMaterial() {
  if (software) return atCorners(true, 0xffffff, 0.25);
  return new three.MeshStandardMaterial({ vertexColors: true, roughness: 0.25 });
}

export function steelMaterial() {
  if (software) return atCorners(false, 0x7d95ab, 0.5);
  return new three.MeshStandardMaterial({ color: 0x9fb4c8, metalness: 0.6, roughness: 0.35 });
}

// What hangs on the organ.
export function ballMaterial() {
  if (software) return atCorners(false, 0x5d8f4a, 0.2);
  return new three.MeshStandardMaterial({ color: 0x6fa557, roughness: 0.45 });
}

// How far a tool reaches.
export function reachMaterial() {
  const material = software ? atCorners(false, 0xf2b84b, 0) : new three.MeshStandardMaterial({ color: 0xf2b84b });
  material.wireframe = true;
  return material;
}

// Normals of the corners: the sum of their faces' normals, each as long as its face is large.
export function turnNormals(geometry) {
  const { position, normal } = geometry.attributes;
  const p = position.array;
  const n = normal.array;
  const faces = geometry.index.array;
  const last = Math.min(faces.length, geometry.drawRange.count);
  n.fill(0);
  for (let f = 0; f < last; f += 3) {
    const a = 3 * faces[f];
    const b = 3 * faces[f + 1];
    const c = 3 * faces[f + 2];
    const ux = p[b] - p[a];
    const uy = p[b + 1] - p[a + 1];
    const uz = p[b + 2] - p[a + 2];
    const vx = p[c] - p[a];
    const vy = p[c + 1] - p[a + 1];
    const vz = p[c + 2] - p[a + 2];
    const x = uy * vz - uz * vy;
    const y = uz * vx - ux * vz;
    const z = ux * vy - uy * vx;
    n[a] += x;
    n[a + 1] += y;
    n[a + 2] += z;
    n[b] += x;
    n[b + 1] += y;
    n[b + 2] += z;
    n[c] += x;
    n[c + 1] += y;
    n[c + 2] += z;
  }
  for (let i = 0; i < n.length; i += 3) {
    const length = Math.sqrt(n[i] * n[i] + n[i + 1] * n[i + 1] + n[i + 2] * n[i + 2]) || 1;
    n[i] /= length;
    n[i + 1] /= length;
    n[i + 2] /= length;
  }
  normal.needsUpdate = true;
}

// Calls `then` when the picture is there, to the last pixel. For measurements alone; nothing waits meanwhile.
export function whenDrawn(renderer, then) {
  const gl = renderer.getContext();
  const fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
  gl.flush();
  const look = () => {
    if (gl.getSyncParameter(fence, gl.SYNC_STATUS) !== gl.SIGNALED) {
      scheduler.postTask(look, { delay: 1 });
      return;
    }
    gl.deleteSync(fence);
    then(performance.now());
  };
  look();
}
