"""Newton's vertex block descent: stable neo-Hookean tetrahedra, contact of whole faces. On the CPU, one thread (Warp).

The first run on a machine compiles Warp's kernels, which takes minutes; they are kept after that.
"""

from __future__ import annotations

import time

import newton
import numpy as np
import warp
from case import DAMPING, DENSITY, FRAME_S, POISSON, YOUNG_PA, Case, Run

MU = YOUNG_PA / (2 * (1 + POISSON))
LAMBDA = YOUNG_PA * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
CONTACT_N_M = 1e3  # stiffness of a contact
GAP_M = 2e-3


@warp.kernel
def mass_damping(v: warp.array[warp.vec3], m: warp.array[float], rate: float, f: warp.array[warp.vec3]):
    """The truth's damping, which Newton does not have."""
    i = warp.tid()
    f[i] = -rate * m[i] * v[i]


def run(case: Case, setting: dict, frames: int) -> Run:
    warp.config.quiet = True
    began = time.perf_counter()
    x = case.positions * 1e-3
    builder = newton.ModelBuilder(gravity=(0.0, 0.0, 0.0))
    builder.add_soft_mesh(
        pos=warp.vec3(0.0, 0.0, 0.0),
        rot=warp.quat_identity(),
        scale=1.0,
        vel=warp.vec3(0.0, 0.0, 0.0),
        vertices=[warp.vec3(*p) for p in x],
        indices=case.tets.ravel().tolist(),
        density=DENSITY,
        k_mu=MU,
        k_lambda=LAMBDA,
        k_damp=0.0,
        particle_radius=1e-4,
    )
    bodies = []
    for tool in case.tools:
        place, q = tool.pose(1, 0.0)
        body = builder.add_body(
            xform=warp.transform(warp.vec3(*place * 1e-3), warp.quat(*q)), is_kinematic=True, mass=1.0
        )
        cfg = newton.ModelBuilder.ShapeConfig(ke=CONTACT_N_M, kd=0.0, mu=tool.friction)
        along = warp.quat_from_axis_angle(warp.vec3(1.0, 0.0, 0.0), -np.pi / 2)  # theirs lies along z
        builder.add_shape_capsule(
            body,
            xform=warp.transform(warp.vec3(0.0, 0.0, 0.0), along),
            radius=1e-3 * tool.radius,
            half_height=1e-3 * tool.half_length,
            cfg=cfg,
        )
        bodies.append(body)
    builder.color()
    model = builder.finalize(device="cpu")
    model.soft_contact_ke, model.soft_contact_kd, model.soft_contact_mu = CONTACT_N_M, 0.0, case.tools[0].friction
    inverse, mass, flags = model.particle_inv_mass.numpy(), case.masses(), model.particle_flags.numpy()
    inverse[:] = 1.0 / mass
    inverse[case.held], mass[case.held] = 0.0, 0.0
    flags[case.held] &= ~int(newton.ParticleFlags.ACTIVE)
    model.particle_inv_mass.assign(inverse.astype(np.float32))
    model.particle_mass.assign(mass.astype(np.float32))
    model.particle_flags.assign(flags)
    solver = newton.solvers.SolverVBD(
        model=model,
        iterations=setting["iterations"],
        particle_enable_self_contact=False,
        integrate_with_external_rigid_solver=True,
        rigid_body_particle_contact_buffer_size=1024,
    )
    pipeline = newton.CollisionPipeline(
        model, broad_phase="nxn", soft_contact_gap=GAP_M, enable_rigid_soft_full_surface_contact=True
    )
    now, then, control, contacts = model.state(), model.state(), model.control(), pipeline.contacts()
    set_up = time.perf_counter() - began
    u, processor, wall = [np.zeros(x.shape)], [0.0], [0.0]
    substeps = setting["substeps"]
    step = FRAME_S / substeps
    for frame in range(1, frames):
        a, b = time.process_time(), time.perf_counter()
        for sub in range(substeps):
            rows = []
            for tool in case.tools:
                place, q = tool.pose(frame, (sub + 1) / substeps)
                rows.append([*(place * 1e-3), *q])
            for state in (now, then):
                state.body_q.assign(np.array(rows, np.float32))
            now.clear_forces()
            warp.launch(
                mass_damping,
                dim=len(x),
                inputs=[now.particle_qd, model.particle_mass, DAMPING, now.particle_f],
                device="cpu",
            )
            pipeline.collide(now, contacts)
            solver.step(now, then, control, contacts, step)
            now, then = then, now
        processor.append(time.process_time() - a)
        wall.append(time.perf_counter() - b)
        u.append((now.particle_q.numpy() - x) * 1e3)
    versions = {"newton": newton.__version__, "warp": warp.__version__}
    return Run(np.array(u, np.float32), None, np.array(processor), np.array(wall), set_up, versions=versions)
