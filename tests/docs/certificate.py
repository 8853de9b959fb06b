"""A bundle's certificate as sentences, for docs/guide/make.md (`bundles.py --write` writes them)."""

from __future__ import annotations

import json
from pathlib import Path


def length(square: float) -> str:
    """Root of a mean square, mm, in two digits."""
    return f"{float(f'{square**0.5:.2g}'):g} mm"


def aloud(folder: Path) -> str:
    """The figures of a certificate, and what each says."""
    told = json.loads((folder / "certificate.json").read_text(encoding="utf-8"))
    contact, free, speed = told["contact"], told["free"], told["speed"]
    errors = [region["mse_mm2"] for region in told["regions"]]
    low, high = told["envelope"]["contact_area_mm2"]
    slow = f"{speed['ms_p99']:.2g} ms"
    rows = (
        (
            "`tested`",
            f"the solver and the bundle made {told['tested']['cases']} contacts that nothing was fitted to: "
            f"{contact['steps']} steps in contact and {free['steps']} after a release",
        ),
        (
            f"`contact.mse_mm2` {contact['mse_mm2']:g}",
            f"take the root: nodes lie {length(contact['mse_mm2'])} from the solver's (root mean square), where they "
            f"move {length(contact['true_mean_square_mm2'])}",
        ),
        (
            f"`contact.share_of_linear` {contact['share_of_linear']:g}",
            f"linear elasticity would lie {length(contact['linear_mse_mm2'])} off: "
            f"{1 / contact['share_of_linear']:.0f} times the squared error",
        ),
        (f"`contact.max_mm` {contact['max_mm']:g}", f"no node was ever farther off than {contact['max_mm']:.2g} mm"),
        (
            f"`free.mse_mm2` {free['mse_mm2']:g}",
            f"while the organ swings back after a release nodes lie {length(free['mse_mm2'])} off, "
            f"{free['max_mm']:.2g} mm at most; by linear elasticity {length(free['linear_mse_mm2'])}",
        ),
        (
            f"`force_error` {told['force_error']:g}",
            f"the sum of the contact's forces is {100 * told['force_error']:.1g} % off",
        ),
        (
            f"`regions`, worst over mean {max(errors) * len(errors) / sum(errors):.1f}",
            "pushes at the worst of six sites err by that many times the mean: is yours there?",
        ),
        (
            f"`speed.ms_median` {speed['ms_median']:g}, `ms_p99` {speed['ms_p99']:g}",
            f"half of the steps take {speed['ms_median']:.2g} ms or less on one core, one in a hundred takes more than "
            f"{slow}: plan for the second figure",
        ),
        (
            "`envelope`",
            f"this holds for pushes of up to {told['envelope']['max_push_mm']:g} mm by faces of {low:g} to {high:g} "
            "mm²; beyond, steps say so by a flag",
        ),
    )
    nodes = f"{told['bundle']['nodes']:,} nodes"
    head = f"That of `onnx/{folder.name}` ({nodes}), read aloud:\n\n| it says | that is |\n|---|---|\n"
    return head + "".join(f"| {figure} | {words} |\n" for figure, words in rows)
