"""The tables of docs/results: figures are data in docs/results/data, and pages show parts of them between marks.

    python tests/docs/results.py run NAME -- COMMAND ... {page}  # run a command that writes tables, and keep them
    python tests/docs/results.py show                            # the pages' tables from the data
    python tests/docs/results.py ages                            # which figures are older than the code they measure
    python tests/docs/results.py narrow NAME --measures PATH ... # what measurements measure, where they name too much

Commands write Markdown between marks of their own. `run` gives them a page with the marks and tables of data/NAME.json
(`{page}` is its path, target/results/NAME.md), and keeps what the command wrote, with the command, machine, date and
commit, and images that it left in target/results/images. New files begin with `--mark "LINE" "LINE"`, that the command
looks for.

A page shows a table behind `<!-- results: NAME NUMBER | COLUMN; COLUMN | COLUMN = VALUE -->`, to the next empty line;
tables are counted from 1. `NAME said NUMBER ...` are the sentences before tables, `NAME after NUMBER ...` those at the
end of blocks; `step-times` is the table of step_times.py. Columns and the condition on rows (`~`: a regular expression)
may be left out; a column without a title is `row`. Behind `<!-- results: ages -->` a page says which of its figures are
older than the code that they measure: a measurement keeps the hashes of that code (`inputs`), in which comments and
tests do not count. The docs stage checks
that pages are what their data make them, and that a page names every file; that no figure has become old unsaid is
checked where UPT_NIGHTLY is set, since each change of the code makes figures old.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import re
import subprocess
import sys
from datetime import date
from pathlib import Path

import code_hash
import step_times

ROOT = Path(__file__).resolve().parents[2]
PAGES = ROOT / "docs/results"
DATA = PAGES / "data"
MARK = re.compile(r"^<!-- results: (?P<what>.*?) -->\n(?:(?!<!--).+\n)*", re.MULTILINE)
#: What a step is made of.
LIBRARY = (
    "src",
    *(
        f"crates/{name}"
        for name in """
    bundle contact elements exchange field held implicit kernels lanes prior topology
""".split()
    ),
)
#: And what drives it beside the solver.
MEASURED = (*LIBRARY, "crates/host", "crates/tissue", "crates/yardstick", "onnx")
#: Behind what a command finds between its marks: where it is gone, the command has measured anew, the same figures too.
UNTOUCHED = "<!-- as it was -->\n"


def git(*words: str) -> str:
    """What git says; empty where it fails."""
    done = subprocess.run(["git", *words], cwd=ROOT, capture_output=True, text=True, check=False)
    return done.stdout.strip() if done.returncode == 0 else ""


def inputs(measured: list[str]) -> dict[str, str]:
    """Hashes of the code that a measurement measures, as it is committed: without comments and tests (code_hash.py)."""
    return {path: code_hash.of(path) for path in measured}


def is_old(block: dict) -> bool:
    """Whether the code of a measurement has changed since."""
    return block.get("inputs") != inputs(block["measures"])


def cells(line: str) -> list[str]:
    """Those of a row of Markdown."""
    return [cell.strip().replace("\\|", "|") for cell in re.split(r"(?<!\\)\|", line.strip())[1:-1]]


def line_of(row: list[str]) -> str:
    """A row of Markdown."""
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in row) + " |"


def parsed(text: str) -> dict:
    """The tables of a piece of Markdown, each with its heading and sentences, and the sentences after the last."""
    tables, said, title = [], [], ""
    lines = iter([*text.splitlines(), ""])
    for line in lines:
        if not line.startswith("|"):
            if line.startswith("#"):
                title = line.strip("# ")
            elif line.strip():
                said.append(line.strip())
            continue
        table = {"title": title, "said": said, "columns": cells(line), "rule": cells(next(lines)), "rows": []}
        while (line := next(lines)).startswith("|"):
            table["rows"].append(cells(line))
        tables.append(table)
        said, title = [], ""
    return {"tables": tables, "after": said}


def written(block: dict) -> str:
    """The piece of Markdown of a block."""
    text = ""
    for table in block["tables"]:
        text += f"\n### {table['title']}\n\n" if table["title"] else ""
        text += "".join(f"{line}\n\n" for line in table["said"])
        text += "".join(f"{line}\n" for line in (line_of(table["columns"]), "|" + "|".join(table["rule"]) + "|"))
        text += "".join(f"{line_of(row)}\n" for row in table["rows"]) + "\n"
    return text + "".join(f"{line}\n\n" for line in block["after"])


def read(name: str) -> list[dict]:
    """The blocks of a file of data; none where there is no file."""
    file = DATA / f"{name}.json"
    return json.loads(file.read_text(encoding="utf-8")) if file.exists() else []


def write(name: str, blocks: list[dict]) -> None:
    """Keeps blocks, a line a row."""

    def dump(value: object) -> str:
        return json.dumps(value, ensure_ascii=False)

    parts = []
    for block in blocks:
        tables = []
        for table in block["tables"]:
            head = dump({key: value for key, value in table.items() if key != "rows"})[:-1]
            rows = ",\n".join(f"   {dump(row)}" for row in table["rows"])
            tables.append(f'  {head}, "rows": [\n{rows}\n  ]}}')
        head = dump({key: value for key, value in block.items() if key != "tables"})[:-1]
        parts.append(f"{head},\n " + '"tables": [\n' + ",\n".join(tables) + "\n ]}")
    DATA.mkdir(exist_ok=True)
    (DATA / f"{name}.json").write_text("[" + ",\n".join(parts) + "]\n", encoding="utf-8")


def processor() -> str:
    """The processor and its cores."""
    info = Path("/proc/cpuinfo")
    named = re.search(r"model name\s*: (.*)", info.read_text()) if info.exists() else None
    cores = subprocess.run(["nproc"], capture_output=True, text=True, check=False).stdout.strip()
    return f"{named[1] if named else platform.machine()}, {cores or '?'} cores"


def run(options: argparse.Namespace) -> None:
    """Runs a command on a page of its own and keeps what it wrote."""
    blocks = read(options.name)
    known = {block["begin"] for block in blocks}
    blocks += [{"begin": begin, "end": end, **parsed("")} for begin, end in options.mark or [] if begin not in known]
    page = ROOT / f"target/results/{options.name}.md"
    (page.parent / "images").mkdir(parents=True, exist_ok=True)
    page.write_text(
        "".join(f"{block['begin']}\n{written(block)}{UNTOUCHED}{block['end']}\n" for block in blocks), encoding="utf-8"
    )
    command = [word.replace("{page}", str(page)) for word in options.command]
    subprocess.run(command, cwd=ROOT, check=True)
    for image in (page.parent / "images").glob("*"):
        image.replace(PAGES / "images" / image.name)
    text = page.read_text(encoding="utf-8")
    for block in blocks:
        inside = text.split(f"{block['begin']}\n", 1)[1].split(block["end"], 1)[0]
        new = parsed(inside.replace(UNTOUCHED, ""))
        if UNTOUCHED not in inside or any(new[key] != block[key] for key in new):
            block |= new | {
                "command": " ".join(options.command),
                "machine": processor(),
                "date": date.today().isoformat(),
                "commit": git("rev-parse", "--short=12", "HEAD"),
                "measures": options.measures,
                "inputs": inputs(options.measures),
            }
    write(options.name, blocks)


def narrow(options: argparse.Namespace) -> None:
    """Names the code of measurements anew; its hashes are those of the commit that they were made at."""
    blocks = read(options.name)
    for number in options.numbers or range(1, len(blocks) + 1):
        block = blocks[number - 1]
        if not git("rev-parse", "--verify", "--quiet", f"{block['commit']}^{{commit}}"):
            sys.exit(f"{options.name} {number}: commit {block['commit']} is not here; measure anew with `run`")
        block["measures"] = options.measures
        block["inputs"] = {path: code_hash.of(path, block["commit"]) for path in options.measures}
    write(options.name, blocks)


def markdown(what: str) -> str:
    """The lines of a mark."""
    source, columns, condition = ([part.strip() for part in re.split(r"\s\|(?=\s)", what)] + ["", ""])[:3]
    name, *part = source.split()
    if name == "step-times":
        return step_times.table(read)
    blocks = read(name)
    tables = [table for block in blocks for table in block["tables"]]
    if part[0] in ("said", "after"):
        sources = tables if part[0] == "said" else blocks
        lines = [line for number in part[1:] for line in sources[int(number) - 1][part[0]]]
        return "".join(f"{'- ' if len(lines) > 1 else ''}{line}\n" for line in lines)
    table = tables[int(part[0]) - 1]

    def place(column: str) -> int:
        return table["columns"].index("" if column.strip() == "row" else column.strip())

    places = [place(column) for column in columns.split(";")] if columns else range(len(table["columns"]))
    rows = table["rows"]
    for column, sign, value in (re.split(r" ([=~]) ", one, maxsplit=1) for one in condition.split(" and ") if one):
        at = place(column)
        rows = [row for row in rows if (row[at] == value if sign == "=" else re.search(value, row[at]))]
    if not rows:
        raise ValueError("no row")
    chosen = [line_of([row[place] for place in places]) for row in [table["columns"], *rows]]
    chosen.insert(1, "|" + "|".join(table["rule"][place] for place in places) + "|")
    return "".join(f"{line}\n" for line in chosen)


def old(text: str) -> str:
    """What a page says of the age of its figures."""
    named = set(re.findall(r"data/([\w-]+)\.json", text)) | {mark["what"].split()[0] for mark in MARK.finditer(text)}
    dates: dict[str, list[str]] = {}
    for name in sorted(named - {"ages"}):
        for block in filter(is_old, read(name)):
            dates.setdefault(block["date"], []).append(name)
    if not dates:
        return ""
    said = (f"{date} ({', '.join(dict.fromkeys(names))})" for date, names in sorted(dates.items()))
    return f"*Older than the code that they measure*, the figures of {'; '.join(said)}.\n"


def shown(page: Path, faults: list[str]) -> str:
    """A page with the tables of the data, and the age of its figures."""
    text = page.read_text(encoding="utf-8")

    def fill(mark: re.Match) -> str:
        try:
            made = old(text) if mark["what"] == "ages" else markdown(mark["what"])
            return f"<!-- results: {mark['what']} -->\n{made}"
        except (OSError, ValueError, IndexError) as error:
            faults.append(f"{page.relative_to(ROOT)}: {mark['what']}: {error}")
            return mark[0]

    return MARK.sub(fill, text)


def pages() -> list[Path]:
    """All pages of docs: each may show results."""
    return sorted((ROOT / "docs").rglob("*.md"))


def compared(text: str) -> str:
    """What the docs stage compares of a page."""
    if os.environ.get("UPT_NIGHTLY"):
        return text
    return MARK.sub(lambda mark: "" if mark["what"] == "ages" else mark[0], text)


def faults() -> list[str]:
    """Pages that are not what the data make them, and files that no page names."""
    found = code_hash.faults() + step_times.faults(ROOT / "README.md", read)
    text = ""
    for page in pages():
        fresh = shown(page, found)
        text += fresh
        if compared(fresh) != compared(page.read_text(encoding="utf-8")):
            found.append(f"{page.relative_to(ROOT)}: a table is stale; run tests/docs/results.py show")
    for file in sorted(DATA.glob("*.json")):
        if f"data/{file.name}" not in text:
            found.append(f"docs/results/data/{file.name}: no page links it")
        for block in read(file.stem):
            if any(parsed(written(block))[key] != block[key] for key in ("tables", "after")):
                found.append(
                    f"docs/results/data/{file.name}: {block['begin']} would change on its way through Markdown"
                )
    return found


def ages() -> list[str]:
    """For each measurement whose code has changed since: its commit, and how many commits changed that code."""
    lines = []
    for file in sorted(DATA.glob("*.json")):
        for block in filter(is_old, read(file.stem)):
            since = git("rev-list", "--count", f"{block['commit']}..HEAD", "--", *block["measures"])
            code = " ".join(block["measures"])
            lines.append(f"{file.stem}: {block['date']}, {block['commit']}: {since or '?'} commits to {code} since")
    return lines


def main() -> int:
    """The command line."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    commands = parser.add_subparsers(required=True, dest="what")
    running = commands.add_parser("run", help="run a command and keep its tables")
    running.add_argument("name")
    running.add_argument("--mark", nargs=2, action="append", help="begin and end of a new block")
    running.add_argument("--measures", nargs="+", default=list(MEASURED), help="paths of the code that is measured")
    running.add_argument("command", nargs="+")
    narrowing = commands.add_parser("narrow", help="name the code that was measured anew")
    narrowing.add_argument("name")
    narrowing.add_argument("numbers", nargs="*", type=int, help="blocks, from 1; all where none is named")
    narrowing.add_argument("--measures", nargs="+", required=True, help="paths, or `library`")
    commands.add_parser("show", help="write the pages' tables")
    commands.add_parser("ages", help="tell which figures are older than their code")
    options = parser.parse_args()
    if hasattr(options, "measures"):
        expanded = [LIBRARY if path == "library" else [path] for path in options.measures]
        options.measures = [path for paths in expanded for path in paths]
    if options.what == "ages":
        print("\n".join(ages()))
        return 0
    if options.what == "run":
        run(options)
    if options.what == "narrow":
        narrow(options)
    said: list[str] = []
    for page in pages():
        text = shown(page, said)
        if text != page.read_text(encoding="utf-8"):
            page.write_text(text, encoding="utf-8")
    print("\n".join(said), end="")
    return min(len(said), 1)


if __name__ == "__main__":
    sys.exit(main())
