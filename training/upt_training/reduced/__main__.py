"""Command line of reduced bundles: `python -m upt_training.reduced COMMAND --help`."""

from __future__ import annotations

import argparse
import json
import sys
from dataclasses import fields
from pathlib import Path

import numpy as np

from upt_training.bundle_folder import file_of, read_manifest
from upt_training.errors import InputError
from upt_training.loads import WITHHELD
from upt_training.mesh_file import load_mesh
from upt_training.reduced.average import average
from upt_training.reduced.build import Options, Progress, build
from upt_training.reduced.columns import load_columns
from upt_training.reduced.compare import compare
from upt_training.reduced.domain import beside_domain, patches_of_domain, worst_of_domain
from upt_training.reduced.evaluate import evaluate, insert_table, table
from upt_training.reduced.export import near_of
from upt_training.reduced.make_prior import check_columns, make_prior, prior_error
from upt_training.reduced.narrow import narrow_command
from upt_training.reduced.prior import load_prior, save_prior
from upt_training.reduced.response_error import response_error
from upt_training.reduced.step_tables import step_command
from upt_training.reduced.sweep import sweep
from upt_training.reduced.train import Settings
from upt_training.reduced.trajectories import open_dataset


def add_build_arguments(whole: argparse.ArgumentParser) -> None:
    """What `build` and `modes` share."""
    whole.add_argument("--mesh", type=Path, required=True)
    whole.add_argument("--columns", type=Path, required=True, help="file of `upt prior` for the wanted boundary")
    whole.add_argument(
        "--data", type=Path, action="append", default=[], help="dataset folder of --mesh; may be repeated"
    )
    whole.add_argument("--out", type=Path, required=True, help="bundle folder")
    whole.add_argument("--work", type=Path, required=True, help="folder of intermediate results")
    whole.add_argument("--name", default="brain-reduced")
    whole.add_argument("--description", default="Linear-elastic response with a learned correction")
    whole.add_argument("--coarse-mesh", type=Path, help="mesh of --coarse-data")
    whole.add_argument("--coarse-columns", type=Path, help="file of `upt prior` for --coarse-mesh")
    whole.add_argument(
        "--coarse-data", type=Path, action="append", default=[], help="interpolated to --mesh for training"
    )
    whole.add_argument("--response-modes", type=int, default=80)
    whole.add_argument("--tolerance", type=float, default=3e-3)
    whole.add_argument("--tables", choices=("f16", "f32"), default="f16")
    whole.add_argument(
        "--near-mm", type=float, help="keep the compliance of contact nodes this near only, the rest from the response"
    )
    whole.add_argument("--hidden", type=int, default=256)
    whole.add_argument(
        "--updates", type=int, default=800, help="0: the ridge regressions alone, on every training case"
    )
    whole.add_argument("--noise", type=float, default=0.03)
    whole.add_argument("--quadratic-modes", type=int, default=24, help="response modes in the second-order term")
    whole.add_argument(
        "--quadratic-ridge", type=float, default=1e-2, help="its ridge, relative to the mean square of its features"
    )
    whole.add_argument("--static-hidden", type=int, default=0, help="width of the equilibria's network; 0: none")
    whole.add_argument("--static-weight", type=float, default=8.0, help="frames that an equilibrium counts for")
    whole.add_argument("--refit", action="store_true", help="train once more on every training case, validation too")
    whole.add_argument("--weight-decay", type=float, default=0.02, help="of the network")
    whole.add_argument("--seeds", type=int, default=1, help="trainings to choose from by validation error")


def arguments() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m upt_training.reduced", description=__doc__)
    commands = parser.add_subparsers(dest="command", required=True)

    prior = commands.add_parser("prior", help="prior.safetensors with the linear response alone")
    prior.add_argument("--mesh", type=Path, required=True)
    prior.add_argument("--columns", type=Path, required=True, help="file of `upt prior`")
    prior.add_argument("--out", type=Path, required=True)
    prior.add_argument("--tolerance", type=float, default=3e-3, help="RMS truncation error of the block basis, mm")
    prior.add_argument("--tables", choices=("f16", "f32"), default="f16")
    prior.add_argument(
        "--near-mm", type=float, help="keep the compliance of contact nodes this near only, the rest from the response"
    )

    whole = commands.add_parser("build", help="a reduced bundle: modes, training, tables, evaluation; resumes")
    add_build_arguments(whole)
    whole.add_argument("--modes", type=int, default=120)
    whole.add_argument(
        "--keep", type=Path, metavar="BUNDLE", help="take modes and tables from this bundle: only latent.onnx is new"
    )

    counts = commands.add_parser("modes", help="one bundle for each number of modes, and their errors as a table")
    add_build_arguments(counts)
    counts.add_argument("--counts", default="60,120,240", help="numbers of modes; bundles are OUT-60, ...")
    counts.add_argument("--into", type=Path, help="also write the table into this page, at the markers NAME-modes")
    counts.set_defaults(keep=None)

    check = commands.add_parser("evaluate", help="errors of a bundle over full rollouts")
    check.add_argument("--bundle", type=Path, required=True)
    check.add_argument("--data", type=Path, action="append", required=True)
    check.add_argument("--all", action="store_true", help="every case, not only the split `test` and scheme 5")
    check.add_argument("--json", type=Path, help="also write the result here")
    check.add_argument("--into", type=Path, help="also write the table into this page, between its table markers")
    check.add_argument("--label", help="name of those markers (default: the bundle's name)")

    regimes = commands.add_parser("compare", help="bundles of both kinds and linear elasticity on several regimes")
    regimes.add_argument("--reduced", type=Path, required=True, help="bundle of kind reduced")
    regimes.add_argument("--upt", type=Path, help="bundle of kind upt, same mesh and boundary")
    regimes.add_argument(
        "--data", action="append", required=True, metavar="LABEL=FOLDER", help="a regime; may be repeated"
    )
    regimes.add_argument("--all", action="store_true", help="every case, not only the split `test` and scheme 5")
    regimes.add_argument("--into", type=Path, help="also write the table into this page, at the markers of --label")
    regimes.add_argument("--label", default="compare")

    mean = commands.add_parser("average", help="the mean of trainings of one bundle (`build --keep`) as a bundle")
    mean.add_argument("bundles", type=Path, nargs="+", help="bundle folders; the first gives everything but the mean")
    mean.add_argument("--out", type=Path, required=True, help="bundle folder")

    small = commands.add_parser("narrow", help="smaller tables for finished bundles of one body, which share them")
    small.add_argument("bundles", type=Path, nargs="+", help="bundle folders; the first is the body of the others")
    small.add_argument("--out", type=Path, required=True, help="folder for the new ones")
    small.add_argument("--tolerance-mm", type=float, default=6e-3, help="what a block's basis may leave out, RMS")
    small.add_argument("--mode-mm", type=float, default=1.0, help="how much of a mode counts beside pushes of 10 mm")
    small.add_argument("--near-mm", type=float, default=20.0, help="pairs of contact nodes with exact compliance")
    small.add_argument("--drop", type=float, default=1e-3, help="of a block's response to 1 mN, what is left out, mm")
    small.add_argument("--one-space", action="store_true", help="corrections and whole modes of the first for all")

    coded = commands.add_parser("step", help="the tables of a finished body in whole steps, for it and its predictors")
    coded.add_argument("bundles", type=Path, nargs="+", help="bundle folders; the first is the body of the others")
    coded.add_argument("--out", type=Path, required=True, help="folder for the new ones")
    coded.add_argument("--response-step", type=float, default=2e-4, help="step of the response, mm/mN")
    coded.add_argument("--basis-mm", type=float, default=5e-4, help="step of the basis where a coordinate is largest")
    coded.add_argument("--mode-mm", type=float, default=2.0, help="how much of a mode counts beside pushes of 10 mm")

    domain = commands.add_parser("domain", help="a copy of a mesh with another domain; its hash stays")
    domain.add_argument("--mesh", type=Path, required=True)
    domain.add_argument("--out", type=Path, required=True)
    where = domain.add_mutually_exclusive_group(required=True)
    where.add_argument("--beside", type=float, metavar="MM", help="the free surface around the domain, up to there")
    where.add_argument("--patches", type=int, metavar="N", help="N patches of the domain")
    where.add_argument(
        "--worst", type=Path, metavar="JSON", help="around the sites of largest error of `upt_training evaluate --out`"
    )
    domain.add_argument("--share", type=float, default=0.25, help="share of the evaluated cases that --worst takes")
    domain.add_argument("--radius", type=float, default=15.0, help="distance from those sites, mm")

    exact = commands.add_parser("response-error", help="L(c) of a bundle against exact columns of its mesh")
    exact.add_argument("--bundle", type=Path, required=True)
    exact.add_argument("--columns", type=Path, required=True, help="file of `upt prior`, of the domain or a part of it")
    exact.add_argument("--sites", type=int, default=1, help="patches pushed at a time")
    return parser


def run_prior(args: argparse.Namespace) -> None:
    mesh, columns = load_mesh(args.mesh), load_columns(args.columns)
    prior, info = make_prior(mesh, columns, args.tolerance, Progress("block basis"))
    dtype = np.float16 if args.tables == "f16" else np.float32
    save_prior(args.out, prior, dtype, near_of(mesh, prior, args.near_mm))
    error = prior_error(mesh, columns, load_prior(args.out))
    print(json.dumps({"file": str(args.out), "bytes": args.out.stat().st_size, "basis": info, "error": error}))


def run_evaluate(args: argparse.Namespace) -> None:
    manifest = read_manifest(args.bundle)
    mesh = load_mesh(file_of(args.bundle, manifest, "mesh.safetensors"))
    cases = [case for folder in args.data for case in open_dataset(folder, mesh.sha256)]
    if not args.all:
        cases = [case for case in cases if case.split == "test" or case.scheme == WITHHELD]
    if not cases:
        raise InputError("no case to evaluate: the datasets have no finished test case (use --all for every case)")
    result = evaluate(args.bundle, cases, Progress("evaluation"))
    if args.json:
        args.json.write_text(json.dumps(result, indent=2))
    if args.into:
        insert_table(args.into, args.label or manifest["name"], table(result))
    print(table(result))


def run_build(args: argparse.Namespace) -> None:
    sweeping = args.command == "modes"
    names = {field.name for field in fields(Options)} - {"modes", "tolerance_mm"}
    options = Options(
        modes=0 if sweeping else args.modes,
        tolerance_mm=args.tolerance,
        **{name: getattr(args, name) for name in names},
    )
    settings = Settings(
        hidden=args.hidden,
        updates=args.updates,
        noise=args.noise,
        weight_decay=args.weight_decay,
        quadratic_modes=args.quadratic_modes,
        quadratic_ridge=args.quadratic_ridge,
        static_hidden=args.static_hidden,
        static_weight=args.static_weight,
    )
    if not sweeping:
        build(options, settings, args.description)
        return
    try:
        counts = [int(count) for count in args.counts.split(",")]
    except ValueError:
        raise InputError(f"--counts {args.counts}: expected whole numbers, such as 60,120,240") from None
    text = sweep(options, settings, args.description, counts)
    if args.into:
        insert_table(args.into, f"{options.name}-modes", text)
    print(text)


def run_compare(args: argparse.Namespace) -> None:
    regimes = []
    for entry in args.data:
        label, _, folder = entry.rpartition("=")
        if not label:
            raise InputError(f"--data {entry}: expected LABEL=FOLDER")
        regimes.append((label, Path(folder)))
    text = compare(args.reduced, args.upt, regimes, args.all, Progress)
    if args.into:
        insert_table(args.into, args.label, text)
    print(text)


def run_average(args: argparse.Namespace) -> None:
    manifest = average(args.bundles, args.out)
    print(f"{args.out}: {manifest['name']}, the mean of {len(args.bundles)} trainings")


def run_domain(args: argparse.Namespace) -> None:
    mesh = load_mesh(args.mesh)
    if args.worst:
        other = worst_of_domain(mesh, args.worst, args.share, args.radius)
    else:
        other = beside_domain(mesh, args.beside) if args.beside else patches_of_domain(mesh, args.patches)
    other.save(args.out)
    print(f"{args.out}: {len(other.domain)} faces, {len(other.domain_nodes)} nodes in the domain")


def run_response_error(args: argparse.Namespace) -> None:
    mesh = load_mesh(file_of(args.bundle, read_manifest(args.bundle), "mesh.safetensors"))
    columns = load_columns(args.columns)
    check_columns(mesh, columns)
    print(json.dumps(response_error(args.bundle, columns, mesh, sites=args.sites)))


COMMANDS = {
    "narrow": narrow_command,
    "step": step_command,
    "prior": run_prior,
    "build": run_build,
    "modes": run_build,
    "evaluate": run_evaluate,
    "compare": run_compare,
    "average": run_average,
    "domain": run_domain,
    "response-error": run_response_error,
}


def main() -> int:
    args = arguments().parse_args()
    try:
        COMMANDS[args.command](args)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
