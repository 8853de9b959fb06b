"""The tables of docs/results/training.md: `python training/tables NAME ARGUMENTS... [--page PAGE] [--add]`.

Each is a module here that says its `COLUMNS`, its `arguments`, and the `rows` of what it measured; `MARKS` names its
place in a page. (Functions `columns` and `marks` say so where it depends on the arguments.) A row is known by its first
`KEY` cells but for numbers in brackets at their ends: `--add` keeps the rows of the page that are not measured again.
Without a page the table is printed (tests/docs/results.py makes and keeps pages).
"""

from __future__ import annotations

import argparse
import sys
from importlib import import_module
from pathlib import Path
from types import ModuleType

sys.path.insert(0, str(Path(__file__).parents[1]))

from upt_training.page import replaced, rows_of, write_table  # noqa: E402

TABLES = ("data_memory", "evaluation", "long_rollout", "precision", "recipe_cost", "rollouts", "runs")


def line(cells: list[str]) -> str:
    """A row of Markdown."""
    return "| " + " | ".join(cells) + " |"


def key(row: str, cells: int) -> tuple[str, ...]:
    """What a row is known by."""
    return tuple(cell.split(" (")[0].strip() for cell in row.split("|")[1 : cells + 1])


def with_kept(old: list[str], new: list[str], cells: int) -> list[str]:
    """`new` behind those rows of `old` that it does not measure again."""
    known = {key(row, cells) for row in new}
    return [row for row in old if key(row, cells) not in known] + new


def parser(tables: dict[str, ModuleType]) -> argparse.ArgumentParser:
    top = argparse.ArgumentParser(prog="python training/tables", description=__doc__.split("\n\n")[0])
    commands = top.add_subparsers(dest="table", required=True)
    for name, table in tables.items():
        says = argparse.RawDescriptionHelpFormatter
        command = commands.add_parser(name, description=table.__doc__, formatter_class=says)
        table.arguments(command)
        command.add_argument("--page", type=Path, help="page to write into, between marks")
        command.add_argument("--marks", help="name of the table there, if not its own")
        command.add_argument("--add", action="store_true", help="keep the page's rows that are not measured again")
    return top


def main(arguments: list[str] | None = None) -> None:
    # Most import torch, which takes seconds: help and wrong names need all, a table none but its own.
    asked = (sys.argv[1:] if arguments is None else arguments)[:1]
    tables = {name: import_module(name) for name in asked if name in TABLES}
    tables = tables or {name: import_module(name) for name in TABLES}
    options = parser(tables).parse_args(arguments)
    table = tables[options.table]
    marks = options.marks or (table.marks(options) if hasattr(table, "marks") else table.MARKS)
    if options.page:  # a page without marks fails before hours of work
        replaced(options.page.read_text(), marks, [], options.page)
    columns = table.columns(options) if hasattr(table, "columns") else table.COLUMNS
    rows = [line(row) for row in table.rows(options)]
    if options.page:
        rows = with_kept(rows_of(options.page, marks), rows, table.KEY) if options.add else rows
    lines = [line(columns), "|---" * len(columns) + "|", *rows]
    if options.page:
        write_table(options.page, marks, lines)
    else:
        print("\n".join(lines))


if __name__ == "__main__":
    main()
