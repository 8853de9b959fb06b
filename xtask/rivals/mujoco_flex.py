"""MuJoCo's flex: St Venant-Kirchhoff elements, implicit, contact of faces with an analytic capsule. One thread."""

from __future__ import annotations

import time

import mujoco
import numpy as np
from case import DAMPING, FRAME_S, POISSON, YOUNG_PA, Case, Run


def run(case: Case, setting: dict, frames: int) -> Run:
    began = time.perf_counter()
    x, step = case.positions * 1e-3, setting["step_s"]
    points = " ".join(f"{v:.9g}" for v in x.ravel())
    elements = " ".join(str(i) for i in case.tets.ravel())
    # The default contact is as soft as MuJoCo's examples have it; "hard" is the stiffest that a step permits.
    contact = 'solref="0.02 1" solimp="0.999 0.9999 0.0001"' if setting.get("contact") == "hard" else ""
    pins = " ".join(str(i) for i in case.held)
    tools = "".join(
        f'<body name="t{i}" mocap="true"><geom name="t{i}" type="capsule" '
        f'size="{t.radius * 1e-3} {t.half_length * 1e-3}" '
        f'friction="{max(t.friction, 1e-5)} 0 0" condim="3" {contact}/></body>'
        for i, t in enumerate(case.tools)
    )
    xml = f"""<mujoco><option timestep="{step}" gravity="0 0 0" cone="elliptic" solver="{setting.get("solver", "CG")}"
      integrator="{setting.get("integrator", "discrete")}" iterations="100" tolerance="1e-6"/>
      <size memory="2G"/><worldbody>{tools}
      <flexcomp name="b" type="direct" dim="3" dof="full" radius="0.0001" mass="{case.masses().sum()}" point="{points}"
      element="{elements}">
      <pin id="{pins}"/><elasticity young="{YOUNG_PA}" poisson="{POISSON}" damping="0"/>
      <contact selfcollide="none" condim="3" friction="1e-5 0 0" {contact}/><edge equality="false"/></flexcomp>
      </worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(xml)
    bodies = model.flex_vertbodyid.copy()
    free = model.body_dofnum[bodies] > 0
    masses = case.masses()
    model.body_mass[bodies[free]] = masses[free]
    data = mujoco.MjData(model)
    mujoco.mj_setConst(model, data)
    for node in np.flatnonzero(free):
        first = model.body_dofadr[bodies[node]]
        model.dof_damping[first : first + 3] = DAMPING * masses[node]
    mujoco.mj_forward(model, data)
    set_up = time.perf_counter() - began
    turn = np.array([np.cos(-np.pi / 4), np.sin(-np.pi / 4), 0.0, 0.0])  # their capsule lies along z
    u, force = [np.zeros(x.shape)], [np.zeros((len(case.tools), 3))]
    processor, wall = [0.0], [0.0]
    substeps = round(FRAME_S / step)
    for frame in range(1, frames):
        a, b = time.process_time(), time.perf_counter()
        for sub in range(substeps):
            for i, tool in enumerate(case.tools):
                place, q = tool.pose(frame, (sub + 1) / substeps)
                data.mocap_pos[i] = place * 1e-3
                mujoco.mju_mulQuat(data.mocap_quat[i], np.array([q[3], *q[:3]]), turn)
            mujoco.mj_step(model, data)
        processor.append(time.process_time() - a)
        wall.append(time.perf_counter() - b)
        u.append((data.flexvert_xpos - x) * 1e3)
        force.append(forces(model, data, len(case.tools)))
    return Run(
        np.array(u, np.float32),
        np.array(force),
        np.array(processor),
        np.array(wall),
        set_up,
        versions={"mujoco": mujoco.__version__},
    )


def forces(model, data, count: int) -> np.ndarray:
    """Of the tissue on each tool, mN."""
    out, wrench = np.zeros((count, 3)), np.zeros(6)
    for i in range(data.ncon):
        contact = data.contact[i]
        mujoco.mj_contactForce(model, data, i, wrench)
        push = contact.frame.reshape(3, 3).T @ wrench[:3] * 1e3
        for side, sign in ((0, -1.0), (1, 1.0)):
            if contact.geom[side] >= 0:
                out[contact.geom[side]] += sign * push
    return out
