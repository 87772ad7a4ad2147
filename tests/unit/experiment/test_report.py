"""The table in all its forms, the report, and the pictures of a small made-up table."""

from __future__ import annotations

import copy
import csv
import io
import json
import sys
from collections.abc import Mapping
from html.parser import HTMLParser
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

import ntagen
from ntagen.errors import InputError
from ntagen.experiment import pictures
from ntagen.experiment.description import Experiment, Row
from ntagen.experiment.record import Felt, Profile, Run, Synthesised
from ntagen.experiment.report import report_of, worst_of
from ntagen.experiment.results import Campaign, read_table
from ntagen.experiment.table import document_of
from ntagen.experiment.writing import HEADINGS, csv_of, latex_of, lines_of, markdown_of
from ntagen.nsl import load
from tests.unit.experiment.files import SCENARIOS, written

SCENE = SCENARIOS / "small_mid_cr.nsl"


def run(row: str, seed: int, *, reached: bool = True, clear_mm: float = 1.0, **more: Any) -> Run:  # noqa: ANN401
    facts: dict[str, Any] = {
        "outcome": "target reached" if reached else "no strategy",
        "reason": "<the> reason & more",
        "adjustments": 0,
        **more,
    }
    return Run(
        row=row,
        seed=seed,
        is_reached=reached,
        is_hit=clear_mm <= 0.0,
        clearance_mm=clear_mm,
        target_mm=-1.0 if reached else 5.0,
        depth_mm=40.0,
        cut_mm=45.0,
        confidence=0.96 + 0.01 * (seed % 4) if reached else None,
        error_mm=0.2 if reached else None,
        needle_s=40.0 + seed,
        syntheses=(Synthesised(10, 8, 0.01, 0.05), Synthesised(4, 0, 0.02, 0.06)),
        profile=Profile((0, 1, 2), (3.0, 2.0, clear_mm), (None, 0.1, 0.2)),
        felt=(Felt(12.5, (0.0, -20.0, 1.0)),),
        seconds=0.3,
        log=f"runs/{row}-{seed}.mcap",
        **facts,
    )


@pytest.fixture(scope="module")
def document() -> dict[str, Any]:
    """A table of two rows."""
    rows = (
        Row("a_b%", SCENE, "none", "virtual", {"needle.noise_mm": 0.1}, (1, 2, 3, 4), "Small/None"),
        Row("free", SCENE, "all", "phantom", {}, (1, 2)),
    )
    runs = [
        run("a_b%", 1),
        run("a_b%", 2, reached=False, clear_mm=0.5),
        run("a_b%", 3, reached=False, clear_mm=-0.25, adjustments=2),
        run("a_b%", 4, clear_mm=0.75, adjustments=1),
        run("free", 1),
    ]
    experiment = Experiment("A & <B>", rows)
    lost = {("free", 2): "its worker died 2 times"}
    return json.loads(json.dumps(document_of(experiment, {r.key: r for r in runs}, lost)))  # type: ignore[no-any-return]


def test_rows_count_reached_and_hits(document: Mapping[str, Any]) -> None:
    row, free = document["rows"]
    assert (row["reached"], row["hits"], row["runs"], row["wanted"]) == (2, 1, 4, 4)
    assert (row["plans_total"], row["plans_hold_total"]) == (56, 32)
    assert row["adjustments"] == {"min": 0, "avg": 0.75, "max": 2}
    assert row["cut_mm"] == {"min": 45.0, "avg": 45.0, "max": 45.0}
    # Only of runs that end in the target.
    assert row["confidence"]["min"] == pytest.approx(0.96)
    assert row["error_mm"] == {"min": 0.2, "avg": pytest.approx(0.2), "max": 0.2}
    assert row["synthesis_s"] == {"min": 0.01, "avg": pytest.approx(0.015), "max": 0.02}
    assert row["overall_s"]["max"] == pytest.approx(44.11)
    assert row["settings"] == {"noise": "0.1 mm"}
    assert (free["runs"], free["wanted"], free["paper"]) == (1, 2, None)


def test_lines_have_those_of_the_paper_below_them(document: Mapping[str, Any]) -> None:
    first, paper, free = lines_of(document)
    assert first[:5] == ("a_b%", "none", "4", "50.0% (6.8 to 93.2)", "25.0% (0.6 to 80.6)")
    assert first[5:7] == ("(0.960, 0.965, 0.970)", "(0.20, 0.20, 0.20)")
    assert first[7:] == ("(0, 0.75, 2)", "56", "(0.010, 0.015, 0.020)", "(41.1, 42.6, 44.1)")
    assert paper[:4] == ("paper: Small/None", "", "50", "100.0%")
    assert paper[9:] == ("(6.63, 6.71, 6.96)", "(18.8, 23.8, 33.3)")
    assert free[2] == "1 of 2"


def test_markdown_and_latex_have_all_cells(document: Mapping[str, Any]) -> None:
    table = [line for line in markdown_of(document).splitlines() if line.startswith("|")]
    assert len(table) == 5
    assert {line.replace("\\|", "").count("|") for line in table} == {len(HEADINGS) + 1}
    assert "a\\_b%" in table[2]
    latex = latex_of(document)
    rows = [line for line in latex.splitlines() if line.endswith("\\\\")]
    assert len(rows) == 4
    assert {line.replace("\\&", "").count("&") for line in rows} == {len(HEADINGS) - 1}
    assert "a\\_b\\% & none & 4 & 50.0\\% (6.8 to 93.2)" in latex


def test_csv_has_a_column_for_each_number(document: Mapping[str, Any]) -> None:
    first, free = csv.DictReader(io.StringIO(csv_of(document)))
    assert first["reach_rate"] == "0.5"
    assert first["paper.overall_s.max"] == "33.3"
    assert free["paper.overall_s.max"] == ""
    assert float(first["adjustments.avg"]) == 0.75


class Page(HTMLParser):
    """What a page links to and loads, and whether its elements end where they must."""

    def __init__(self) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.text = ""
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        for name, value in attrs:
            if tag == "a" and name == "href":
                self.links.append(str(value))
            elif name in ("src", "href", "xlink:href") and not str(value).startswith("#"):
                self.loads.append(str(value))
        if tag in ("table", "svg", "h2", "tr"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        if tag in ("table", "svg", "h2", "tr"):
            assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


def test_the_report_needs_no_other_file_and_links_the_worst_runs(
    document: Mapping[str, Any],
) -> None:
    text = report_of(document, {"a_b%": load(SCENE)})
    page = Page()
    page.feed(text)
    assert page.open == []
    assert page.loads == []
    worst = [f"runs/a_b%25-{seed}.mcap" for seed in (3, 2, 4, 1)]
    assert page.links == [*worst, "runs/free-1.mcap"]
    assert text.count("<svg") == 1 + 3 + 2
    assert "<B>" not in text
    for words in ("A & <B>", "<the> reason & more", "Not made: seed 2 of free", "paper: Small"):
        assert words in page.text


def test_the_worst_runs_come_first(document: Mapping[str, Any]) -> None:
    assert [one["seed"] for one in worst_of(document, "a_b%", 3)] == [3, 2, 4]


def test_equal_tables_give_equal_pictures(document: Mapping[str, Any]) -> None:
    one, other = (pictures.svg_of(pictures.rates(copy.deepcopy(document))) for _ in range(2))
    assert one == other


def drawn(figure: Any, axes: int) -> list[list[tuple[float, float]]]:  # noqa: ANN401
    return [list(map(tuple, line.get_xydata())) for line in figure.axes[axes].lines]


def test_pictures_show_the_numbers(document: Mapping[str, Any]) -> None:
    rates = drawn(pictures.rates(document), 0)
    assert [(50.0, 0.0)] in rates
    assert [(100.0, 0.25)] in rates
    over = pictures.over_depth(document, "a_b%")
    assert drawn(over, 0)[1] == [(0, 3.0), (1, 2.0), (2, -0.25)]
    assert drawn(over, 1)[0] == [(1, 0.1), (2, 0.2)]
    felt = drawn(pictures.felt(document, "a_b%", load(SCENE)), 0)
    assert felt[0] == [(0.0, -20.0)] * 4
    counts = [sum(a.patches[0].get_data().values) for a in pictures.times(document, "a_b%").axes]
    assert counts == [8, 4]


def test_a_frame_needs_a_library(
    document: Mapping[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    campaign = Campaign(document, Path(), {})
    polars = ModuleType("polars")
    polars.DataFrame = dict  # type: ignore[attr-defined]
    monkeypatch.setitem(sys.modules, "pandas", None)
    monkeypatch.setitem(sys.modules, "polars", polars)
    frame = campaign.to_frame()
    assert frame["id"] == ["a_b%", "free"]
    assert frame["paper.plans"] == [150, None]
    monkeypatch.setitem(sys.modules, "polars", None)
    with pytest.raises(InputError, match=r"pandas or polars(.|\n)*hint: pip install polars"):
        campaign.to_frame()


def test_a_campaign_from_a_script(tmp_path: Path) -> None:
    file = written(tmp_path)
    made = ntagen.campaign(file, runs=1, workers=0, folder=tmp_path / "x")
    assert [row["id"] for row in made.table] == ["blocked", "free"]
    assert {path.name for path in (tmp_path / "x").glob("[tr]*.*")} == {
        *("table.json", "table.csv", "table.md", "table.tex", "report.html")
    }
    assert read_table(tmp_path / "x").table == json.loads(json.dumps(made.table))
    page = Page()
    page.feed((tmp_path / "x" / "report.html").read_text("utf-8"))
    assert page.links
    assert all((tmp_path / "x" / link).is_file() for link in page.links)
    assert "<table>" in made._repr_html_()


@pytest.mark.parametrize("wrong", [{"runs": 0}, {"workers": -1}])
def test_wrong_numbers_are_refused(tmp_path: Path, wrong: dict[str, int]) -> None:
    with pytest.raises(InputError, match="must be at least"):
        ntagen.campaign(written(tmp_path), folder=tmp_path / "x", **wrong)  # type: ignore[arg-type]


def test_a_folder_without_a_table_is_refused(tmp_path: Path) -> None:
    (tmp_path / "table.json").write_text("[]", "utf-8")
    with pytest.raises(InputError, match="is no table of an experiment"):
        read_table(tmp_path)
