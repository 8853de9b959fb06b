#!/usr/bin/env bash
# Writes three.js beside this script: what the page uses of three.js, pinned, in one minified file, so that neither
# building nor viewing needs a network. Needs npm.
set -euo pipefail
here="$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)"
scratch="$(mktemp -d)"
trap 'rm -rf "$scratch"' EXIT
cd "$scratch"
npm install --silent --no-save --no-audit --no-fund three@0.187.0 esbuild@0.28.0 >&2
cat >entry.js <<'JS'
export {
  AmbientLight, BufferAttribute, BufferGeometry, CapsuleGeometry, Color, DirectionalLight, Mesh, MeshStandardMaterial,
  PerspectiveCamera, Quaternion, Raycaster, Scene, ShaderMaterial, Vector2, Vector3, WebGLRenderer,
} from "three";
export { OrbitControls } from "three/addons/controls/OrbitControls.js";
JS
npx esbuild entry.js --bundle --minify --format=esm --legal-comments=none \
  --banner:js="// three.js 0.187.0, MIT licence, Copyright 2010-2026 three.js authors; written by vendor.sh" \
  --outfile="$here/three.js" >&2
cp node_modules/three/LICENSE "$here/three.LICENSE"
