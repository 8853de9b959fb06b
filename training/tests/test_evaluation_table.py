"""The evaluation table: a row a group and method with mean, deviation and range, written between a page's marks."""

import json
import subprocess
import sys
from pathlib import Path

from upt_training.metrics import summary

TABLES = Path(__file__).parents[1] / "tables"
PAGE = "before\n<!-- evaluation: begin -->\nold\n<!-- evaluation: end -->\nafter\n"


def scores(mse: float) -> dict[str, float]:
    return {"mse_mm2": mse, "max_mm": 2 * mse, "relative_l2": 0.5, "hausdorff_mm": 3 * mse}


def write(path: Path, **cases: list[float]) -> Path:
    """Results of cases of schemes (`s1=[...]`) with a method at twice the bundle's error."""
    rows = []
    for scheme, values in cases.items():
        for v in values:
            rows.append({"scheme": scheme[1:], "bundle": scores(v), "coarse_fem": scores(2 * v)})

    def table(group):
        return {name: summary([c[name] for c in group]) for name in ("bundle", "coarse_fem")}

    schemes = {s[1:]: table([c for c in rows if c["scheme"] == s[1:]]) for s in cases}
    path.write_text(json.dumps({"bundle": "toy", "nodes": 9, "cases": rows, "schemes": schemes, "all": table(rows)}))
    return path


def run(*arguments) -> subprocess.CompletedProcess:
    return subprocess.run([sys.executable, TABLES, "evaluation", *map(str, arguments)], capture_output=True, text=True)


def test_rows_of_schemes_and_all(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(PAGE)
    results = [write(tmp_path / "a.json", s1=[1.0, 3.0], s2=[4.0]), write(tmp_path / "b.json", s5=[7.0])]
    assert run(*results, "--page", page).returncode == 0
    text = page.read_text()
    assert text.startswith("before\n") and text.endswith("after\n") and "old" not in text
    assert "| scheme 1, K = 9 (2) | **toy** | 2.000 ± 1.000 | 1.000 to 3.000 | 6.000 ± 3.000 | 4.000 ± 2.000 |" in text
    assert "| scheme 1, K = 9 (2) | coarse FEM, embedded | 4.000 ± 2.000 | 2.000 to 6.000 |" in text
    assert "| schemes 1-2, K = 9 (3) | **toy** | 2.667 ± 1.247 | 1.000 to 4.000 |" in text
    assert text.count("| scheme 5, K = 9 (1) |") == 2 and "schemes 5" not in text


def test_a_page_without_marks_stays(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("no marks\n")
    outcome = run(write(tmp_path / "a.json", s1=[1.0]), "--page", page)
    assert outcome.returncode != 0 and "evaluation: begin" in outcome.stderr and page.read_text() == "no marks\n"


def test_the_papers_figures_beside_a_named_bundle(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(PAGE.replace("evaluation", "paper figures"))
    results = f"large={write(tmp_path / 'a.json', s1=[1.0, 3.0], s2=[2.0])}"
    assert run(results, "--paper", "--overall", "--marks", "paper figures", "--page", page).returncode == 0
    text = page.read_text()
    assert "| schemes 1-2, K = 9 (3) | **large** | 2.000 ± 0.816 |" in text and "coarse FEM" not in text
    assert "scheme 1, K = 9" not in text
    assert "| scheme 5, K = 21679 (10) | *the paper* | 0.09 ± 0.04 | - | 1.99 ± 0.27 |" in text


def test_rows_of_other_cases_stay_and_the_papers_come_last(tmp_path):
    page = tmp_path / "page.md"
    page.write_text(PAGE)
    first = [f"small={write(tmp_path / 'a.json', s1=[1.0])}", f"large={write(tmp_path / 'b.json', s5=[2.0])}"]
    assert run(*first, "--paper", "--add", "--page", page).returncode == 0
    again = f"small={write(tmp_path / 'c.json', s1=[3.0, 5.0])}"
    assert run(again, "--paper", "--add", "--page", page).returncode == 0
    rows = [line.split("|")[1:4] for line in page.read_text().splitlines() if line.startswith("| scheme")]
    assert [[cell.strip() for cell in row] for row in rows[:2]] == [
        ["scheme 5, K = 9 (1)", "**large**", "2.000 ± 0.000"],
        ["scheme 1, K = 9 (2)", "**small**", "4.000 ± 1.000"],
    ]
    assert len(rows) == 5 and all("*the paper*" in row[1] for row in rows[2:])
