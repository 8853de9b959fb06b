"""`bench` and `scaling`: tables in a page, finished runs are kept, an interrupted run goes on."""

import json
import re
import shutil
import subprocess
import sys

import pytest
from conftest import CONFIGS

from upt_training import scaling
from upt_training.__main__ import main
from upt_training.errors import InputError
from upt_training.scaling_report import Reference, read_reference, table


def paths(data, mesh_path) -> list[str]:
    return ["--data", str(data), "--mesh", str(mesh_path)]


def shortened(folder):
    """The configurations, with a recipe of 4 epochs in place of 60: a run has a step of each at least."""
    short = folder / "configs"
    shutil.copytree(CONFIGS, short)
    recipe = short / "plain.toml"
    text, epochs = recipe.read_text(), "\nepochs = 45\nautoregressive_epochs = 15\n"
    assert epochs in text
    recipe.write_text(text.replace(epochs, "\nepochs = 3\nautoregressive_epochs = 1\n"))
    return str(short)


def test_bench_writes_a_row_for_each_lever_of_the_configuration(data, mesh_path, tmp_path, capsys):
    config, page = tmp_path / "levers.toml", tmp_path / "page.md"
    config.write_text((CONFIGS / "tiny.toml").read_text() + "scored_rows = 20\ndrawn_supernodes = 16\n")
    page.write_text("<!-- bench tiny: begin -->\n<!-- bench tiny: end -->\n")
    command = ["bench", "--config", str(config), *paths(data, mesh_path), "--steps", "2", "--rounds", "1"]
    assert main([*command, "--draws", "2", "--page", str(page)]) == 0
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in page.read_text().splitlines()[3:-1]]
    first = [row[0].split()[0] for row in rows]
    assert first == ["plain", "messages", "predictions", "20", "16", "2", "fused", "freed"]
    assert all(row[1] == "4" for row in rows)  # 2 windows of 3 predictions, the first is not scored
    assert all(float(row[5]) < 1e-5 for row in rows[1:3]) and rows[1][6] == "-" and rows[3][6] != "-"
    assert main([*command, "--draws", "0"]) == 2 and "--draws" in capsys.readouterr().err
    config.write_text((CONFIGS / "tiny.toml").read_text())
    assert main([*command, "--page", str(page)]) == 0  # nothing is drawn: every gradient is the plain one
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in page.read_text().splitlines()[3:-1]]
    assert rows[3][0] == "2 windows in one batch" and all(float(row[5]) < 1e-5 for row in rows[1:])


def test_scaling_keeps_what_is_done_and_writes_table_and_plot(data, mesh_path, tmp_path, capsys):
    out, page = tmp_path / "out", tmp_path / "docs/page.md"
    (tmp_path / "docs/images").mkdir(parents=True)
    page.write_text("<!-- scaling: begin -->\nold\n<!-- scaling: end -->\n")
    configs = shortened(tmp_path)
    command = ["scaling", *paths(data, mesh_path), "--configs", configs, "--out", str(out), "--inputs", "plain"]
    command += ["--core-minutes", "0.02", "--cases", "2"]
    assert main([*command, "--report-only"]) == 2 and "no finished run" in capsys.readouterr().err
    assert main([*command, "--sizes", "7"]) == 2 and "'7' is not one of" in capsys.readouterr().err
    assert main([*command, "--sizes", "0.1", "--seeds", "1", "2", "--page", str(page)]) == 0
    first = json.loads((out / "scaling.json").read_text())
    assert len(first) == 2 and all(len(run["curve"]) == 2 for run in first.values())
    assert main([*command, "--sizes", "0.1", "--train-cases", "1", "--page", str(page)]) == 0
    second = json.loads((out / "scaling.json").read_text())
    assert len(second) == 3 and first.items() <= second.items()
    text = page.read_text()
    assert "\nold\n" not in text and len(re.findall(r"^\| plain \|", text, re.M)) == 2 and "predict zero" in text
    assert (tmp_path / "docs/images/scaling.png").stat().st_size > 1000


def test_an_interrupted_run_of_scaling_goes_on_and_ends_as_planned(data, mesh_path, tmp_path, monkeypatch):
    command = [
        "scaling",
        *paths(data, mesh_path),
        "--configs",
        shortened(tmp_path),
        "--out",
        str(tmp_path),
        "--inputs",
        "plain",
    ]
    command += ["--sizes", "0.1", "--core-minutes", "0.02", "--cases", "1"]
    monkeypatch.setattr(scaling, "scores", lambda *a: (_ for _ in ()).throw(KeyboardInterrupt))
    monkeypatch.setattr(scaling, "SAVE_SECONDS", 0.0)
    with pytest.raises(KeyboardInterrupt):
        main(command)
    monkeypatch.undo()
    assert main(command) == 0
    (run,) = json.loads((tmp_path / "scaling.json").read_text()).values()
    assert [point["step"] for point in run["curve"]] == [run["steps"] // 2, run["steps"]]


def test_sizes_come_from_one_configuration_and_inputs_from_another():
    for size in scaling.SIZES:
        plain, prior = (scaling.settings_of(scaling.Run(i, size, 1, 0, 1.0), CONFIGS) for i in ("plain", "prior"))
        assert plain.model.features == ["displacement", "collision"] and plain.model.base == "none"
        assert prior.model.base == "prior" and "prior" in prior.model.features
        assert plain.model.encoder == prior.model.encoder and plain.train.strategy == "stf"
        assert prior.train.learning_rate <= 1.2e-3 and prior.train.loss_nodes == 0


def test_the_table_gives_the_spread_of_the_seeds():
    end = {"core_hours": 0.5, "step": 10, "train_mse_mm2": 0.3, "max_mm": 2.0, "cases": 3}
    run = {"inputs": "prior", "parameters": 100, "size": "0.1", "training_cases": 8, "core_minutes": 30.0, "steps": 10}
    run |= {"samples": 160, "references": {"predict zero": 5.0}}
    runs = {str(seed): run | {"seed": seed, "curve": [end | {"mse_mm2": 0.1 * seed}]} for seed in (1, 3)}
    lines = table(runs)
    bundle = Reference("other", [{"index": i, "bundle": {"mse_mm2": float(i)}} for i in range(7)])
    assert "`other`, same 3 cases* | | | | | | | | 3.0000 |" in table(runs, bundle)[4]
    assert "| prior | 100 | 8 | 2 | 10 | 160 | 0.500 |" in lines[2] and "0.2000 (0.1000 to 0.3000)" in lines[2]
    assert lines[3] == "| *predict zero* | | | | | | | | 5.0000 | |"


def test_the_table_of_runs_says_what_a_run_got(trained, tmp_path):
    page = tmp_path / "page.md"
    page.write_text("<!-- paper runs: begin -->\n<!-- paper runs: end -->\n")
    tables, other = CONFIGS.parent / "tables", tmp_path / "other.json"
    cases = [{"index": i, "bundle": {"mse_mm2": float(i)}} for i in (3, 1)]
    other.write_text(json.dumps({"bundle": "other", "cases": cases}))
    command = [sys.executable, tables, "runs", trained, "--evaluation", other, "--page", page]
    subprocess.run(command, check=True, capture_output=True)
    cells = [cell.strip() for cell in page.read_text().splitlines()[3].strip("|").split("|")]
    assert cells[:5] == ["`tiny-replay`", "10,691", "400", "400", "6,400"] and float(cells[5]) >= 0
    assert cells[6].endswith("after step 400)") and cells[8:] == ["2.0000", "-", "-"]
    own = [{"index": i, "bundle": {"mse_mm2": 0.5, "max_mm": 3.0}} for i in (1, 3)]
    other.with_name("own.json").write_text(json.dumps({"bundle": "own", "cases": own}))
    command[3] = f"{trained}={other.with_name('own.json')}"
    subprocess.run(command, check=True, capture_output=True)
    cells = [cell.strip() for cell in page.read_text().splitlines()[3].strip("|").split("|")]
    assert cells[6:8] == ["0.5000 (2, after step 400)", "3.00"]


def test_a_reference_that_is_no_evaluation_names_its_file(tmp_path):
    path = tmp_path / "other.json"
    with pytest.raises(InputError, match="other.json: no such file"):
        read_reference(path)
    path.write_text("{}")
    with pytest.raises(InputError, match="other.json: not the JSON of `evaluate`"):
        read_reference(path)
