// A ball follows the pointer over a liver and presses it: libupt steps in a worker, React three fiber draws.
import { Canvas, useFrame, useThree, type ThreeEvent } from "@react-three/fiber";
import { SoftTissue } from "libupt/three";
import { Tissue, type Tool } from "libupt/worker";
import { Suspense, use, useEffect, useMemo, useRef } from "react";
import { createRoot } from "react-dom/client";
import { Vector3, type Camera, type Mesh } from "three";

const RADIUS = 6; // mm
const DEPTH = 4;

// A bundler that moves files leaves the worker where the package has it.
const worker = new Worker(new URL("node_modules/libupt/worker-main.js", location.href), { type: "module" });
const opening = Tissue.open("bundles/liver", { worker });

// From outside, at what the bundle was made to be touched at.
function lookAt(organ: SoftTissue, tissue: Tissue, camera: Camera) {
  organ.geometry.computeBoundingSphere();
  const { center, radius } = organ.geometry.boundingSphere!;
  const touched = [...tissue.domain.keys()].filter((i) => tissue.domain[i]);
  const out = new Vector3();
  for (const i of touched) out.add(new Vector3().fromArray(tissue.positions, 3 * i).sub(center));
  camera.position.copy(center).addScaledVector(out.normalize(), 3.5 * radius);
  camera.lookAt(center);
}

function Organ({ tissue }: { tissue: Tissue }) {
  const organ = useMemo(() => new SoftTissue(tissue), [tissue]);
  const ball = useRef<Mesh>(null);
  const tools = useRef<Tool[]>([]);
  const camera = useThree((state) => state.camera);
  useEffect(() => lookAt(organ, tissue, camera), [organ, tissue, camera]);
  useEffect(() => () => organ.dispose(), [organ]);
  useFrame(() => void organ.update(tools.current));

  const press = ({ point, face }: ThreeEvent<PointerEvent>) => {
    const outward = face?.normal ?? new Vector3(0, 0, 1);
    const place = point.clone().addScaledVector(outward, RADIUS - DEPTH);
    ball.current?.position.copy(place);
    tools.current = [{ position: place.toArray(), radius: RADIUS, friction: 0.1 }];
  };
  Object.assign(window, { tissue, organ, tools }); // for the console
  return (
    <>
      <primitive object={organ} onPointerMove={press} onPointerOut={() => (tools.current = [])} />
      <directionalLight position={camera.position} intensity={2.2} />
      <mesh ref={ball}>
        <sphereGeometry args={[RADIUS, 24, 16]} />
        <meshStandardMaterial color="#9fb4c8" metalness={0.6} roughness={0.35} />
      </mesh>
    </>
  );
}

function Page() {
  return (
    <Canvas camera={{ near: 1, far: 2000, fov: 35 }}>
      <ambientLight intensity={0.9} />
      <Suspense fallback={null}>
        <Opened />
      </Suspense>
    </Canvas>
  );
}

function Opened() {
  return <Organ tissue={use(opening)} />;
}

createRoot(document.getElementById("root")!).render(<Page />);
