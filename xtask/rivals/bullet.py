"""Bullet's FEM: explicit neo-Hookean tetrahedra (Python has no other), contact of faces with a capsule.

The capsule is placed anew in each step.
"""

from __future__ import annotations

import os
import tempfile
import time

import numpy as np
import pybullet
from case import DAMPING, FRAME_S, POISSON, YOUNG_PA, Case, Run

SCALE = 10.0  # decimetres: its collision margins are made for bodies of a metre


def run(case: Case, setting: dict, frames: int) -> Run:
    began = time.perf_counter()
    x, step = case.positions * 1e-3 * SCALE, setting["step_s"]
    client = pybullet.connect(pybullet.DIRECT)
    try:
        pybullet.resetSimulation(pybullet.RESET_USE_DEFORMABLE_WORLD, physicsClientId=client)
        pybullet.setGravity(0, 0, 0, physicsClientId=client)
        pybullet.setPhysicsEngineParameter(fixedTimeStep=step, numSubSteps=0, physicsClientId=client)
        # Density keeps its number, so a pressure goes with the square of the scale.
        mu = YOUNG_PA / (2 * (1 + POISSON)) * SCALE**2
        bulk = YOUNG_PA * POISSON / ((1 + POISSON) * (1 - 2 * POISSON)) * SCALE**2
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "body.vtk")
            write_vtk(path, x, case.tets)
            body = pybullet.loadSoftBody(
                path,
                mass=float(case.masses().sum()) * SCALE**3,
                useNeoHookean=1,
                NeoHookeanMu=mu,
                NeoHookeanLambda=bulk,
                NeoHookeanDamping=0.0,
                useSelfCollision=0,
                useFaceContact=1,
                collisionMargin=1e-3,
                frictionCoeff=case.tools[0].friction,
                physicsClientId=client,
            )
        for node in case.held:
            pybullet.createSoftBodyAnchor(body, int(node), -1, -1, physicsClientId=client)
        tools = []
        for tool in case.tools:
            shape = pybullet.createCollisionShape(
                pybullet.GEOM_CAPSULE,
                radius=1e-3 * SCALE * tool.radius,
                height=2e-3 * SCALE * tool.half_length,
                physicsClientId=client,
            )
            tools.append(
                pybullet.createMultiBody(
                    0, shape, basePosition=(1e-3 * SCALE * tool.poses[0, :3]).tolist(), physicsClientId=client
                )
            )
            pybullet.changeDynamics(tools[-1], -1, lateralFriction=tool.friction, physicsClientId=client)
        pybullet.changeDynamics(body, -1, linearDamping=DAMPING, physicsClientId=client)
        set_up = time.perf_counter() - began
        u, processor, wall = [np.zeros(x.shape)], [0.0], [0.0]
        substeps = round(FRAME_S / step)
        for frame in range(1, frames):
            a, b = time.process_time(), time.perf_counter()
            for sub in range(substeps):
                for tool, handle in zip(case.tools, tools, strict=True):
                    place, q = tool.pose(frame, (sub + 1) / substeps)
                    along = pybullet.getQuaternionFromEuler((-np.pi / 2, 0, 0))  # theirs lies along z
                    _, turned = pybullet.multiplyTransforms((0, 0, 0), q.tolist(), (0, 0, 0), along)
                    pybullet.resetBasePositionAndOrientation(
                        handle, (place * 1e-3 * SCALE).tolist(), turned, physicsClientId=client
                    )
                pybullet.stepSimulation(physicsClientId=client)
            processor.append(time.process_time() - a)
            wall.append(time.perf_counter() - b)
            count, now = pybullet.getMeshData(
                body, -1, flags=pybullet.MESH_DATA_SIMULATION_MESH, physicsClientId=client
            )
            if count != len(x):
                raise ValueError(f"Bullet gave {count} nodes for {len(x)}")
            u.append((np.array(now) - x) * 1e3 / SCALE)
    finally:
        pybullet.disconnect(client)
    return Run(
        np.array(u, np.float32), None, np.array(processor), np.array(wall), set_up, versions={"pybullet": "3.2.7"}
    )


def write_vtk(path: str, x: np.ndarray, tets: np.ndarray) -> None:
    with open(path, "w", encoding="ascii") as file:
        file.write(f"# vtk DataFile Version 2.0\nbody\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {len(x)} double\n")
        file.writelines(f"{a:.9g} {b:.9g} {c:.9g}\n" for a, b, c in x)
        file.write(f"\nCELLS {len(tets)} {5 * len(tets)}\n")
        file.writelines(f"4 {a} {b} {c} {d}\n" for a, b, c, d in tets)
        file.write(f"\nCELL_TYPES {len(tets)}\n" + "10\n" * len(tets))
