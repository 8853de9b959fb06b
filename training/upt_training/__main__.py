"""`python -m upt_training train | evaluate | export | bench | scaling | ablate`; `--help` on each.

Wrong input ends with a message and exit code 2.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from upt_training.errors import InputError
from upt_training.memory import keep_freed_memory


def parser() -> argparse.ArgumentParser:
    top = argparse.ArgumentParser(prog="python -m upt_training", description="Train, evaluate and export the surrogate")
    commands = top.add_subparsers(dest="command", required=True)

    train = commands.add_parser("train", help="train a configuration on a dataset")
    train.add_argument("--config", type=Path, required=True, help="configs/NAME.toml")
    train.add_argument(
        "--data", type=Path, required=True, action="append", help="dataset folder, of schemes or tools; may be repeated"
    )
    train.add_argument("--mesh", type=Path, help="mesh file; default: found by the dataset's mesh hash")
    train.add_argument(
        "--prior",
        type=Path,
        help="prior.safetensors, for configurations that use the linear response",
    )
    train.add_argument("--vibration", type=Path, help="vibration.safetensors, for configurations with `vibration`")
    train.add_argument("--out", type=Path, default=Path("runs/last"), help="run folder")
    train.add_argument("--resume", action="store_true", help="continue the run in --out, exactly")
    train.add_argument("--init", type=Path, help="checkpoint or bundle whose weights to start from")
    train.add_argument("--device", default="auto", help="auto, cpu, cuda, cuda:N")
    train.add_argument("--threads", type=int, default=1)
    train.add_argument("--max-minutes", type=float, default=0.0, help="stop with a checkpoint after this time")

    train.add_argument(
        "--evaluate-minutes",
        type=float,
        default=0.0,
        help="score so often; the schedule then fills --max-minutes, however many steps that makes",
    )
    train.add_argument(
        "--checkpoint-minutes", type=float, default=10.0, help="write last.pt so often; 0: only at scores"
    )

    evaluate = commands.add_parser("evaluate", help="autoregressive rollouts of a bundle on held-out cases, as JSON")
    evaluate.add_argument("bundle", type=Path)
    evaluate.add_argument("--data", type=Path, required=True)
    evaluate.add_argument("--mesh", type=Path, help="another mesh than the bundle's (the data's)")
    evaluate.add_argument("--prior", type=Path, help="prior of that mesh")
    evaluate.add_argument("--vibration", type=Path, help="vibration tables of that mesh")
    evaluate.add_argument("--split", default="test", choices=["train", "test", "all"])
    evaluate.add_argument("--schemes", nargs="*", help="only these")
    evaluate.add_argument("--count", type=int, default=0, help="at most this many cases")
    evaluate.add_argument("--precision", default="f32", choices=["f32", "f16", "int8"])
    evaluate.add_argument("--out", type=Path, help="JSON file; default: standard output")
    evaluate.add_argument("--no-hausdorff", action="store_true")

    export = commands.add_parser("export", help="write the bundle of a run")
    export.add_argument("run", type=Path, help="run folder or checkpoint")
    export.add_argument("--out", type=Path, required=True, help="bundle folder")
    export.add_argument("--mesh", type=Path, required=True)
    export.add_argument(
        "--data",
        type=Path,
        action="append",
        help="dataset: envelope, material, inputs of the self-check; may be repeated",
    )
    export.add_argument(
        "--keep", type=Path, metavar="BUNDLE", help="take corrections, anchors and limits of tools from it"
    )
    export.add_argument("--prior", type=Path)
    export.add_argument("--vibration", type=Path)
    export.add_argument("--name")
    export.add_argument("--description", default="")
    export.add_argument("--radius-mm", type=float, help="another radius of the graph (for another mesh)")
    export.add_argument("--max-degree", type=int, help="another largest number of neighbours")
    export.add_argument("--supernodes", type=int, help="another number of supernodes")
    export.add_argument("--envelope", type=Path, help="bundle whose envelope to take (weights trained on its data)")
    export.add_argument("--errors", type=Path, help="JSON of `evaluate` to put into bundle.json")
    export.add_argument("--paper-split", action="store_true", help="also the paper's two halves")
    export.add_argument("--step", action="store_true", help="also the whole step in one graph")
    export.add_argument("--f16", action="store_true", help="also half-precision graphs")
    export.add_argument("--half-weights", action="store_true", help="store large weights in half precision")
    export.add_argument("--int8", action="store_true", help="also dynamically quantised graphs")

    variants = commands.add_parser("variants", help="a copy of a bundle with f16 and int8 graphs too")
    variants.add_argument("bundle", type=Path)
    variants.add_argument("--f16", action="store_true", help="half-precision graphs")
    variants.add_argument("--int8", action="store_true", help="dynamically quantised graphs")
    variants.add_argument("--out", type=Path, required=True, help="new folder")

    transfer = commands.add_parser("transfer", help="a bundle's weights as a bundle of another mesh")
    transfer.add_argument("bundle", type=Path)
    transfer.add_argument("--mesh", type=Path, required=True)
    transfer.add_argument("--prior", type=Path, help="linear response of that mesh")
    transfer.add_argument("--vibration", type=Path, help="vibration tables of that mesh")
    transfer.add_argument("--name", help="default: that of the folder")
    transfer.add_argument("--out", type=Path, required=True, help="new folder")

    anchors = commands.add_parser("anchors", help="decode a bundle's correction at few nodes, interpolate the others")
    anchors.add_argument("bundle", type=Path, help="bundle folder, changed in place")
    anchors.add_argument("--spacing", type=float, required=True, help="least distance of two anchors, mm")
    anchors.add_argument("--neighbours", type=int, default=8, help="anchors that a node follows")

    seal = commands.add_parser("seal", help="renew a manifest's digest and `requires` after a change by hand")
    seal.add_argument("bundle", type=Path, nargs="+", help="bundle folders, changed in place")

    rest = commands.add_parser("rest", help="measure how far from rest free motion ends, and write it")
    rest.add_argument("bundle", type=Path, nargs="+", help="bundle folders, changed in place")

    bench = commands.add_parser("bench", help="samples a core-second of a training step, lever by lever: a table")
    bench.add_argument("--config", type=Path, required=True)
    bench.add_argument("--data", type=Path, required=True)
    bench.add_argument("--mesh", type=Path)
    bench.add_argument("--prior", type=Path)
    bench.add_argument("--vibration", type=Path)
    bench.add_argument("--init", type=Path, help="checkpoint whose weights the gradients are compared at")
    bench.add_argument("--steps", type=int, default=4, help="places of the schedule, an optimiser step each")
    bench.add_argument("--rounds", type=int, default=2, help="the fastest of so many counts")
    bench.add_argument("--draws", type=int, default=16, help="windows averaged where rows or supernodes are drawn")
    bench.add_argument("--page", type=Path, help="page to write into")

    scaling = commands.add_parser("scaling", help="error against parameters and core-hours: tables and plots")
    scaling.add_argument("--data", type=Path, required=True)
    scaling.add_argument("--configs", type=Path, default=Path("training/configs"), help="folder of configurations")
    scaling.add_argument("--mesh", type=Path)
    scaling.add_argument("--prior", type=Path)
    scaling.add_argument("--vibration", type=Path)
    scaling.add_argument("--out", type=Path, required=True, help="folder of the runs; finished ones are kept")
    scaling.add_argument("--sizes", nargs="*", default=["0.1", "0.2", "0.9", "3.4"], help="millions of parameters")
    scaling.add_argument("--inputs", nargs="*", default=["plain", "prior"], choices=["plain", "prior"])
    scaling.add_argument("--seeds", nargs="*", type=int, default=[1])
    scaling.add_argument("--train-cases", nargs="*", type=int, default=[0], help="0: all")
    scaling.add_argument("--core-minutes", type=float, default=60.0, help="training time of each run")
    scaling.add_argument("--cases", type=int, default=4, help="held-out cases scored")
    scaling.add_argument("--evaluation", type=Path, help="JSON of `evaluate` of a bundle, to compare with")
    scaling.add_argument("--report-only", action="store_true", help="tables and plots of what is done")
    scaling.add_argument("--page", type=Path, help="page to write into, and images/ beside it")

    ablate = commands.add_parser("ablate", help="variants of a configuration at one small budget: tables and plots")
    ablate.add_argument("suite", choices=["windows", "tricks"])
    ablate.add_argument("--config", type=Path)
    ablate.add_argument("--data", type=Path)
    ablate.add_argument("--mesh", type=Path)
    ablate.add_argument("--prior", type=Path)
    ablate.add_argument("--vibration", type=Path)
    ablate.add_argument("--out", type=Path, required=True)
    ablate.add_argument("--steps", type=int, default=2000, help="optimiser steps of each variant")
    ablate.add_argument("--max-minutes", type=float, default=0.0, help="time limit of each variant")
    ablate.add_argument(
        "--minutes", type=float, default=0.0, help="train each variant so long, in place of --steps: the clock leads"
    )
    ablate.add_argument("--merge", type=Path, nargs="*", help="results of runs (SUITE.json), joined; nothing is run")
    ablate.add_argument("--label", default="", help="tells reports of one suite apart: in the page's marks, in names")
    ablate.add_argument("--cases", type=int, default=10, help="held-out cases scored")
    ablate.add_argument("--only", nargs="*", help="only these variants, by name")
    ablate.add_argument("--page", type=Path, help="page to write into, and images/ beside it")
    ablate.add_argument("--device", default="auto")
    ablate.add_argument("--threads", type=int, default=1)
    return top


def main(arguments: list[str] | None = None) -> int:
    options = parser().parse_args(arguments)
    if options.command in ("train", "scaling", "ablate"):
        keep_freed_memory()
    try:
        if options.command == "train":
            from upt_training.run import train_command

            return train_command(options)
        if options.command == "evaluate":
            from upt_training.evaluate import evaluate_command

            return evaluate_command(options)
        if options.command == "ablate":
            from upt_training.ablate import ablate_command

            return ablate_command(options)
        if options.command == "bench":
            from upt_training.bench import bench_command

            return bench_command(options)
        if options.command == "scaling":
            from upt_training.scaling import scaling_command

            return scaling_command(options)
        if options.command == "transfer":
            from upt_training.transfer import transfer_command

            return transfer_command(options)
        if options.command == "anchors":
            from upt_training.add_anchors import anchors_command

            return anchors_command(options)
        if options.command == "rest":
            from upt_training.rest import rest_command

            return rest_command(options)
        if options.command == "seal":
            from upt_training.bundle_folder import seal

            for bundle in options.bundle:
                seal(bundle)
            return 0
        if options.command == "variants":
            from upt_training.variants import variants_command

            return variants_command(options)
        from upt_training.export import export_command

        return export_command(options)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2


if __name__ == "__main__":
    sys.exit(main())
