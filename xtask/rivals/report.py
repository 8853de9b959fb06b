"""Tables and the chart of the study of rivals, from its rows."""

from __future__ import annotations

from pathlib import Path

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402

HEAD = (
    "| method | setting | frames | MSE, mm² | largest, mm | penetration, mm | force error | smallest det F | ms | p99 "
    "| times libupt |"
)
COLOURS = {
    "libupt": "#c0392b",
    "reference solver": "#2c3e50",
    "Jolt": "#2980b9",
    "rapier": "#8e44ad",
    "MuJoCo flex": "#27ae60",
    "Newton VBD": "#d68910",
    "Bullet FEM": "#7f8c8d",
}


def number(value: float | None, digits: int = 2) -> str:
    if value is None:
        return "-"
    return f"{value:,.0f}" if abs(value) >= 99.5 else f"{value:.{digits}g}"


def table(rows: list[dict], case: str) -> list[str]:
    """Lines of the table of a case, and below it what could not be run."""
    lines, missing = [HEAD, "|---" * 11 + "|"], []
    for row in (r for r in rows if r["case"] == case):
        if "why" in row:
            missing.append(f"- {row['method']}, {row['setting']}: {row['why']}")
            continue
        if row["mse_mm2"] is None:
            lines.append(f"| {row['method']} | {row['setting']} | {row['frames']} | blows up |" + " |" * 7)
            continue
        force = "-" if row["force_error"] is None else f"{100 * row['force_error']:.1f} %"
        cut = f" (libupt there {number(row['beside_mse_mm2'])})" if row["frames"] < most(rows, case) else ""
        lines.append(
            f"| {row['method']} | {row['setting']} | {row['frames']} | {number(row['mse_mm2'])}{cut} | "
            f"{number(row['largest_mm'])} | "
            f"{number(row['penetration_mm'])} | {force} | {number(row['smallest_det'])} | {number(row['ms'], 3)} | "
            f"{number(row['ms_p99'], 3)} | {number(row['ratio'])} |"
        )
    return lines + ([""] + missing if missing else [])


def most(rows: list[dict], case: str) -> int:
    return max(r["frames"] for r in rows if r["case"] == case and "frames" in r)


def chart(rows: list[dict], cases: list[str], path: Path) -> None:
    """MSE against processor time, one panel a case."""
    figure, panels = plt.subplots(1, len(cases), figsize=(5.2 * len(cases), 4.6), sharey=True, squeeze=False)
    for panel, case in zip(panels[0], cases, strict=True):
        found = [r for r in rows if r["case"] == case and r.get("mse_mm2")]
        for method in COLOURS:
            own = sorted((r for r in found if r["method"] == method), key=lambda r: r["ms"])
            if not own:
                continue
            colour, is_ours = COLOURS[method], method == "libupt"
            at = [[r["ms"] for r in own], [r["mse_mm2"] for r in own]]
            if is_ours:
                panel.plot(*at, color=colour, lw=1.2)
            # A run that was cut has not met the deepest frames: it is drawn hollow.
            faces = [colour if r["frames"] == most(rows, case) else "white" for r in own]
            size = 60 if is_ours else 30
            panel.scatter(*at, s=size, c=faces, edgecolors=colour, zorder=3)
            panel.scatter([], [], s=size, color=colour, label=method)
        truth = next((r for r in rows if r["case"] == case and r["method"] == "reference solver" and "ms" in r), None)
        if truth:
            panel.axvline(truth["ms"], color=COLOURS["reference solver"], ls="-.", lw=1)
            panel.text(
                truth["ms"],
                0.04,
                "the truth takes ",
                color=COLOURS["reference solver"],
                fontsize=8,
                ha="right",
                transform=panel.get_xaxis_transform(),
            )
        rest = next((r["rest_mse_mm2"] for r in found if r["frames"] == most(rows, case)), None)
        if rest:
            panel.axhline(rest, color="0.7", ls=":", lw=1)
            panel.text(
                0.99,
                rest,
                "tissue that never moves",
                color="0.5",
                fontsize=8,
                ha="right",
                va="bottom",
                transform=panel.get_yaxis_transform(),
            )
        panel.axvline(50, color="0.7", ls="--", lw=1)
        panel.text(50, 0.01, " real time", color="0.5", fontsize=8, transform=panel.get_xaxis_transform())
        panel.set(xscale="log", yscale="log", title=case, xlabel="processor time for 50 ms of tissue, ms")
        panel.grid(alpha=0.25, which="major")
    panels[0][0].set_ylabel("mean squared error, mm²")
    handles = {
        label: handle for panel in panels[0] for handle, label in zip(*panel.get_legend_handles_labels(), strict=True)
    }
    figure.legend(handles.values(), handles.keys(), loc="lower center", ncols=len(handles), frameon=False, fontsize=9)
    figure.tight_layout(rect=(0, 0.06, 1, 1))
    figure.savefig(path, dpi=110)
    plt.close(figure)


def write(rows: list[dict], page: Path, machine: str) -> None:
    cases = list(dict.fromkeys(r["case"] for r in rows))
    lines = []
    for case in cases:
        lines += [f"### {case}", "", *table(rows, case), ""]
    versions = {name: value for row in rows for name, value in row.get("versions", {}).items()}
    lines.append(
        f"Machine: {machine}. Versions: {', '.join(f'{name} {value}' for name, value in sorted(versions.items()))}."
    )
    text = page.read_text()
    begin, end = "<!-- rivals: begin -->\n", "<!-- rivals: end -->"
    if text.count(begin) != 1 or text.count(end) != 1:
        raise SystemExit(f"{page}: needs the marks {begin.strip()} and {end}")
    page.write_text(text[: text.index(begin) + len(begin)] + "\n".join(lines) + "\n" + text[text.index(end) :])
    chart(rows, [case for case in ("press", "stroke") if case in cases], page.parent / "images" / "rivals.png")
