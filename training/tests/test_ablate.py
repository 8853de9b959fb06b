"""`ablate`: chosen variants run, finished ones are kept, and the marked table of a page is exchanged."""

import json

import pytest
from conftest import CONFIGS

from upt_training.__main__ import main
from upt_training.ablate import variants
from upt_training.config import load_settings

PAGE = "before\n<!-- ablate windows: begin -->\nold\n<!-- ablate windows: end -->\nafter\n"


@pytest.fixture
def page(tmp_path):
    (tmp_path / "images").mkdir()
    path = tmp_path / "page.md"
    path.write_text(PAGE)
    return path


def ablate(suite, data, mesh_path, page, *only):
    return main(["ablate", suite, "--config", str(CONFIGS / "tiny.toml"), "--data", str(data), "--mesh", str(mesh_path),
                 "--device", "cpu", "--steps", "8", "--out", str(page.parent / "out"), "--page", str(page),
                 "--only", *only])  # fmt: skip


def test_variants_are_added_one_by_one_and_the_page_holds_them_all(data, mesh_path, page):
    assert ablate("windows", data, mesh_path, page, "stochastic, window 3") == 0
    first = json.loads((page.parent / "out/windows.json").read_text())["variants"]["stochastic, window 3"]
    assert ablate("windows", data, mesh_path, page, "teacher forcing") == 0
    result = json.loads((page.parent / "out/windows.json").read_text())
    assert list(result["variants"]) == ["teacher forcing", "stochastic, window 3"]
    assert result["variants"]["stochastic, window 3"] == first and first["steps"] == 8
    text = page.read_text()
    assert text.startswith("before\n") and text.endswith("after\n") and "\nold\n" not in text
    assert f"| stochastic, window 3 | {first['mse_mm2']:.4f} |" in text and "*predict zero*" in text
    assert {p.name for p in (page.parent / "images").iterdir()} == {"window-size.png", "error-accumulation.png"}


def test_variants_of_some_minutes_are_joined_under_a_label(data, mesh_path, page):
    page.write_text(PAGE.replace("ablate windows", "ablate windows paper"))
    out = page.parent
    for name, only in (("a", "stochastic, window 3"), ("b", "teacher forcing")):
        assert main(["ablate", "windows", "--config", str(CONFIGS / "tiny.toml"), "--data", str(data), "--mesh",
                     str(mesh_path), "--device", "cpu", "--minutes", "0.02", "--out", str(out / name),
                     "--only", only]) == 0  # fmt: skip
    row = json.loads((out / "a/windows.json").read_text())["variants"]["stochastic, window 3"]
    assert row["steps"] > 1 and row["samples"] == row["steps"] * samples("tiny.toml", window=3)
    assert row["curve"][-1]["mse_mm2"] == row["mse_mm2"] and "unfinished" not in row
    files = [str(out / name / "windows.json") for name in "ab"]
    assert main(["ablate", "windows", "--merge", *files, "--out", str(out / "both"), "--label", "paper",
                 "--page", str(page)]) == 0  # fmt: skip
    text = page.read_text()
    assert f"| stochastic, window 3 | {row['mse_mm2']:.4f} |" in text and f"| {row['samples']:,} | " in text
    assert text.index("| teacher forcing |") < text.index("| stochastic, window 3 |")
    names = {p.name for p in (page.parent / "images").iterdir()}
    assert names == {"paper-window-size.png", "paper-error-accumulation.png"}


def samples(config, **changes):
    settings = load_settings(CONFIGS / config)
    settings.train.strategy = "stf"
    for name, value in changes.items():
        setattr(settings.train, name, value)
    return settings.train.samples_per_step


def test_an_unknown_variant_or_a_page_without_marks_is_an_error(data, mesh_path, page, capsys):
    assert ablate("windows", data, mesh_path, page, "window 3") == 2
    assert "'window 3' is not a variant of windows" in capsys.readouterr().err
    page.write_text("no marks\n")
    assert ablate("windows", data, mesh_path, page, "teacher forcing") == 2
    assert "ablate windows: begin" in capsys.readouterr().err and page.read_text() == "no marks\n"


def test_every_variant_differs_from_the_base_recipe():
    base = load_settings(CONFIGS / "tricks.toml")
    suite = variants("tricks", base)
    parts = {n: (s.to_dict()["model"], s.to_dict()["train"]) for n, s in suite.items()}
    unchanged = parts.pop("base recipe")
    assert unchanged == (base.to_dict()["model"], base.to_dict()["train"])
    assert all(p != unchanged for p in parts.values())
    assert len({json.dumps(p) for p in parts.values()}) == len(parts) == 20
