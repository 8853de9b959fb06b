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
