"""Makes the organs of docs/results/accuracy.md with `upt make`, one command each; their certificates give its tables.
Rigid tools teach one of them afterwards.

    python training/scripts/gallery.py --upt target/release/upt --sofa FOLDER --out gallery --page PAGE

FOLDER is a checkout of github.com/sofa-framework/sofa (its share/mesh/liver-smooth.obj, LGPL 2.1). The kidney is a
formula and the box a lattice, both written here. Bundles that are there are only read again.
"""

from __future__ import annotations

import argparse
import json
import subprocess
from pathlib import Path

import numpy as np

from upt_training.box_mesh import box_mesh

ROOT = Path(__file__).parents[2]
TAUGHT = ["brain-supported"]


def kidney(path: Path) -> None:
    """A closed bean, 110 mm long, as OBJ: an ellipsoid bent about an axis behind its hilum."""
    rings, sectors = 40, 64
    theta = np.pi * np.arange(1, rings) / rings
    phi = 2 * np.pi * np.arange(sectors) / sectors
    ring = np.stack(
        [
            np.outer(np.sin(theta), np.cos(phi)),
            np.outer(np.sin(theta), np.sin(phi)),
            np.repeat(np.cos(theta)[:, None], sectors, 1),
        ],
        -1,
    )
    points = np.concatenate([[[0, 0, 1.0]], ring.reshape(-1, 3), [[0, 0, -1.0]]]) * [27.0, 22.0, 62.0]
    bend = 55.0
    angle, distance = points[:, 2] / bend, points[:, 0] + bend
    points = np.stack([distance * np.cos(angle) - bend, points[:, 1], distance * np.sin(angle)], -1)
    last = len(points)
    at = lambda ring, sector: 2 + ring * sectors + sector % sectors  # noqa: E731
    faces = []
    for s in range(sectors):
        faces += [(1, at(0, s), at(0, s + 1)), (last, at(rings - 2, s + 1), at(rings - 2, s))]
        for r in range(rings - 2):
            faces += [(at(r, s), at(r + 1, s), at(r + 1, s + 1)), (at(r, s), at(r + 1, s + 1), at(r, s + 1))]
    lines = [f"v {x:.4f} {y:.4f} {z:.4f}" for x, y, z in points] + [f"f {a} {b} {c}" for a, b, c in faces]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def stiff_box(path: Path) -> None:
    """A box of 120 x 100 x 50 mm, four times as stiff in a ball of 20 mm below the middle of its top."""
    mesh = box_mesh((18, 15, 8), 6.5)
    centre = mesh.positions[mesh.tets].mean(axis=1)
    middle = mesh.positions.max(axis=0) * [0.5, 0.5, 0.55]
    inside = np.linalg.norm(centre - middle, axis=1) < 20.0
    mesh.stiffness = np.where(inside, 4.0, 1.0).astype(np.float32)
    mesh.metadata["name"] = "box-inclusion"
    mesh.save(path)


def organs(work: Path, sofa: Path) -> dict[str, list[str]]:
    """The arguments of `upt make` for each."""
    kidney(work / "kidney.obj")
    stiff_box(work / "box.mesh.safetensors")
    liver = [str(sofa / "share/mesh/liver-smooth.obj"), "--unit", "25", "--material", "liver", "--name", "liver"]
    liver += ["--license", "LGPL-2.1-or-later (SOFA's liver-smooth.obj)", "--fixed", "plane:0,0,-1,-10"]
    small = ["--nodes", "1200", "--domain", "ball:-20,100,60,55", "--natural", "40", "--cases", "8"]
    return {
        "liver": [*liver, "--minutes", "3"],
        "liver-coarse": [*liver, *small],
        "kidney": [
            *[str(work / "kidney.obj"), "--material", "kidney", "--license", "Apache-2.0 OR MIT"],
            *["--fixed", "ball:-33,0,0,14", "--push", "8", "--minutes", "3"],
        ],
        "box-inclusion": [
            *[str(work / "box.mesh.safetensors"), "--license", "Apache-2.0 OR MIT", "--minutes", "3"],
        ],
        "brain-supported": [
            *[str(ROOT / "onnx/meshes/brain.mesh.safetensors"), "--license", "Apache-2.0 OR MIT", "--minutes", "11"],
            *["--boundary", "supported", "--tolerance-mm", "0.03", "--name", "brain-supported"],
        ],
    }


def teach(upt: Path, bundle: Path, work: Path) -> None:
    """Adds modes of rigid tools to the coarse space, and measures limits of tools and the certificate anew."""
    mesh = ["--mesh", str(ROOT / "onnx/meshes/brain.mesh.safetensors"), "--boundary", "supported", "--tools", "all"]
    learned, unseen = work / "tools-learned", work / "tools-unseen"
    coarser = ["--train-inner-step-ms", "0.19", "--train-mass-scaling-ms", "0.2"]
    for command in (
        ["dataset", *mesh, "--count", "40", "--seed", "11", *coarser, "--out", str(learned)],
        ["dataset", *mesh, "--count", "50", "--seed", "3", "--out", str(unseen)],
        ["corrections", str(bundle), "--extend", "--data", str(learned)],
        ["envelope", str(bundle), "--tools", str(unseen)],
        ["check", str(bundle), "--write"],
    ):
        subprocess.run([str(upt), *command], check=True)


def row(name: str, certificate: dict) -> str:
    """One line of the table."""
    number = lambda x: "-" if x is None else f"{x:.3g}"  # noqa: E731
    contact, free, speed = certificate["contact"], certificate["free"], certificate["speed"]
    cells = [
        f"`{name}`",
        f"{certificate['bundle']['nodes']:,}",
        str(certificate["tested"]["cases"]),
        number(contact["mse_mm2"]),
        number(contact["linear_mse_mm2"]),
        f"1/{1 / contact['share_of_linear']:.0f}",
        number(free["share_of_linear"]),
        number(certificate["worst_region_over_mean"]),
        number(certificate["force_error"]),
        number(certificate["tested"]["corrections_mean"]),
        number(speed["ms_median"]),
    ]
    return "| " + " | ".join(cells) + " |"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--upt", type=Path, default=ROOT / "target/release/upt")
    parser.add_argument("--sofa", type=Path, required=True)
    parser.add_argument("--out", type=Path, default=Path("gallery"))
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--page", type=Path, required=True, help="page to write into (tests/docs/results.py makes it)")
    parser.add_argument("--only", nargs="*", help="make these alone; the table keeps the lines of others")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    before, rest = options.page.read_text(encoding="utf-8").split("<!-- gallery.py: begin -->")
    table, after = rest.split("<!-- gallery.py: end -->")
    rows = []
    for name, arguments in organs(options.out, options.sofa).items():
        bundle = options.out / name
        if not (bundle / "certificate.json").exists() and (options.only is None or name in options.only):
            command = [str(options.upt), "make", *arguments, "--threads", str(options.threads)]
            subprocess.run([*command, "--out", str(bundle)], check=True)
            if name in TAUGHT:
                teach(options.upt, bundle, options.out)
        if (bundle / "certificate.json").exists():
            rows.append(row(name, json.loads((bundle / "certificate.json").read_text(encoding="utf-8"))))
        else:
            rows += [line for line in table.splitlines() if line.startswith(f"| `{name}` |")]
    head = [
        "| organ | nodes | held-out cases | MSE in contact, mm² | linear elasticity | share | share after release | "
        "worst region over mean | force error | corrections a step | ms a step |",
        "|---|---:|---:|---:|---:|---:|---:|---:|---:|---:|---:|",
    ]
    table = "\n".join([*head, *rows])
    options.page.write_text(
        f"{before}<!-- gallery.py: begin -->\n{table}\n<!-- gallery.py: end -->{after}", encoding="utf-8", newline="\n"
    )


if __name__ == "__main__":
    main()
