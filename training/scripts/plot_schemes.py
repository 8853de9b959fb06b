"""Draws push factor and angles of the simulation schemes.

python training/scripts/plot_schemes.py [docs/images/schemes.png]
"""

import csv
import pathlib
import subprocess
import sys

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

ROOT = pathlib.Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "training"))

from upt_training.loads import SCHEMES  # noqa: E402


def span(low, high):
    """A range as `20 to 40`."""
    return f"{low:g}" if low == high else f"{low:g} to {high:g}"


def main():
    target = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else ROOT / "docs/images/schemes.png"
    command = ["cargo", "run", "--quiet", "--release", "-p", "tissue", "--example", "scheme_poses"]
    text = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=True).stdout
    schemes = {}
    for row in csv.DictReader(text.splitlines()):
        schemes.setdefault(row.pop("scheme"), []).append({key: float(value) for key, value in row.items()})
    figure, axes = plt.subplots(2, 5, figsize=(15, 5), sharex=True, sharey=True, constrained_layout=True)
    for axis, (name, rows) in zip(axes.flat, schemes.items(), strict=True):
        time = [row["t_s"] for row in rows]
        axis.plot(time, [row["push"] for row in rows], color="tab:blue", label="push factor")
        axis.set_ylim(-0.05, 1.1)
        spec = SCHEMES[name]
        axis.set_title(f"{name}: {span(*spec['magnitude_mm'])} mm, {span(*spec['faces'])} faces", fontsize=10)
        angles = axis.twinx()
        angles.plot(time, [row["phi_deg"] for row in rows], color="tab:orange", lw=1, label="tilt phi")
        angles.plot(time, [row["theta_deg"] for row in rows], color="tab:green", lw=1, ls="--", label="turn theta")
        angles.set_ylim(-60, 400)
        if axis not in axes[:, -1]:
            angles.set_yticklabels([])
        else:
            angles.set_ylabel("degrees")
    for axis in axes[-1]:
        axis.set_xlabel("time, s")
    for axis in axes[:, 0]:
        axis.set_ylabel("push factor")
    lines = axes[0, 0].get_lines() + [line for other in figure.axes[10:11] for line in other.get_lines()]
    figure.legend(lines, [line.get_label() for line in lines], loc="outside lower center", ncols=3)
    target.parent.mkdir(parents=True, exist_ok=True)
    figure.savefig(target, dpi=80)
    print(target)


if __name__ == "__main__":
    main()
