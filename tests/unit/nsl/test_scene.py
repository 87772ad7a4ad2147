"""What environment files mean: the scenes that come out."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from ntagen import nsl
from ntagen.scene import Limits, NamedQuery, Needle, Pose, Region, Scene, Vector

EXAMPLES = Path(__file__).parents[3] / "examples"
SCENARIOS = sorted((EXAMPLES / "scenarios").glob("*.nsl"))

NEEDLE = "needle { radius 30 mm  speed 1 mm/s }"
TARGET = "target T1 sphere (0, -50, 0) mm radius 10 mm"
QUARTER_TURNS_RAD = (math.pi / 2, math.pi, 3 * math.pi / 2)


def scene_of(body: str = "", *, needle: str = NEEDLE, target: str = TARGET, top: str = "") -> Scene:
    """The scene of an environment with the usual needle and target."""
    return nsl.loads(f"{top}\nenvironment e {{ {needle} {target}\n{body}\n}}")


def check_length(written: str, expected_mm: float) -> None:
    """A length, with the constants of `top` before it, has a value."""
    *top, length = written.split(";")
    scene = scene_of(
        f"critical C sphere (0, -25, 300) mm radius {length}",
        top="\n".join(f"let {line}" for line in top),
    )
    assert scene.criticals[0].radius_mm == pytest.approx(expected_mm, rel=1e-12)


def check_point(written: str, expected_mm: Vector) -> None:
    """A point, with the constants of `top` before it, has a value."""
    *top, point = written.split(";")
    scene = scene_of(
        f"critical C sphere {point} radius 1 mm", top="\n".join(f"let {line}" for line in top)
    )
    assert scene.criticals[0].center_mm == pytest.approx(expected_mm, rel=1e-12)


def test_published_instance() -> None:
    assert nsl.load(EXAMPLES / "paper.nsl") == Scene(
        name="paper",
        needle=Needle(Pose((0.0, 0.0, 0.0), (0.0, -1.0, 0.0), (0.0, 0.0, 1.0)), 30.0, 1.0),
        axis=(0.0, -1.0, 0.0),
        limits=Limits(2.0, QUARTER_TURNS_RAD, max_rolls=2, min_roll_distance_mm=2.0),
        targets=(Region.ball("T1", "target", (0.0, -50.0, 0.0), 10.0),),
        criticals=(Region.ball("C1", "critical", (0.0, -25.0, 0.0), 2.0),),
        detections=(Region.ball("D1", "detection", (0.0, -25.0, 0.0), 5.0),),
        resolution_per_mm=1000,
        safety="sampled",
    )


@pytest.mark.parametrize("keyword", ["critical", "detection"])
def test_published_instance_stays_right_without_a_region(keyword: str) -> None:
    lines = (EXAMPLES / "paper.nsl").read_text("utf-8").splitlines(keepends=True)
    rest = [line for line in lines if not line.lstrip().startswith(keyword)]
    assert len(rest) == len(lines) - 1
    task = nsl.loads_task("".join(rest))
    scene, warnings = task.scene, task.warnings
    assert len(scene.regions) == 2
    assert warnings == ()


def test_defaults_are_the_published_instance() -> None:
    paper = nsl.load(EXAMPLES / "paper.nsl")
    scene = scene_of()
    assert (scene.needle, scene.axis, scene.limits) == (paper.needle, paper.axis, paper.limits)
    assert (scene.safety, scene.tissue) == ("sampled", paper.tissue)
    # But for the resolution, which is one that is fine enough.
    assert (paper.resolution_per_mm, scene.resolution_per_mm) == (1000, None)


@pytest.mark.parametrize("path", SCENARIOS, ids=lambda path: path.stem)
def test_scenario_is_right_and_laid_out(path: Path) -> None:
    scene, warnings = nsl.load_with_warnings(path)
    assert warnings == ()
    assert scene.name.lower() == path.stem
    assert len(scene.targets) == 1
    assert len(scene.detections) == len(scene.criticals)
    assert nsl.format_text(path.read_text("utf-8")) == path.read_text("utf-8")


def test_scenarios_are_the_five_of_the_paper() -> None:
    names = ["large_mid_cr", "no_cr", "small_mid_cr", "surface_crs", "tunnel_crs"]
    assert [path.stem for path in SCENARIOS] == names
    assert [len(nsl.load(path).criticals) for path in SCENARIOS] == [1, 0, 1, 5, 32]


def test_regions_of_the_surface_lie_on_the_target() -> None:
    scene = nsl.load(EXAMPLES / "scenarios" / "surface_crs.nsl")
    (target,) = scene.targets
    for region in scene.criticals:
        assert math.dist(region.center_mm, target.center_mm) == pytest.approx(target.radius_mm)


@pytest.mark.parametrize(
    ("written", "expected_mm"),
    [
        ("3 mm", 3.0),
        ("3 cm", 30.0),
        ("250 um", 0.25),
        ("0.004 m", 4.0),
        ("2 * 3 mm", 6.0),
        ("(1 + 2) mm", 3.0),
        ("1 mm + 2 mm * 3", 7.0),
        ("8 mm - 4 mm - 2 mm", 2.0),
        ("8 mm / 4 * 2", 4.0),
        ("--3 mm", 3.0),
        ("2 * -(-3 mm)", 6.0),
        ("sqrt(16 mm * 4 mm)", 8.0),
        ("abs(-3 mm)", 3.0),
        ("min(3 mm, 1 cm, 2 mm)", 2.0),
        ("max(3 mm, 1 cm, 2 mm)", 10.0),
        ("4 * sin(30 deg) * 1 mm", 2.0),
        ("4 * cos(pi / 3 * 1 rad) * 1 mm", 2.0),
        ("3 mm/s * 2 s", 6.0),
        ("6 cm/min * 2 s", 2.0),
        ("6 mm / 2 s * 3 s", 9.0),
        ("a = 2;b = a * 3 mm;b / 2", 3.0),
        ("w = 5;w mm", 5.0),
        ("t = 2 s;v = 3 mm / s;v * t", 6.0),
    ],
)
def test_lengths(written: str, expected_mm: float) -> None:
    check_length(written, expected_mm)


@pytest.mark.parametrize(
    ("written", "expected_mm"),
    [
        ("(1, -25, 2) mm", (1.0, -25.0, 2.0)),
        ("(1 mm, -2.5 cm, 2000 um)", (1.0, -25.0, 2.0)),
        ("-25 mm * y", (0.0, -25.0, 0.0)),
        ("y * -25 mm", (0.0, -25.0, 0.0)),
        ("(0, -50, 4) mm / 2", (0.0, -25.0, 2.0)),
        ("p = (0, -25, 0) mm;p + 2 mm * x - (0, 1, 0) mm", (2.0, -26.0, 0.0)),
        ("-(-x + 25 * y) mm", (1.0, -25.0, 0.0)),
    ],
)
def test_points(written: str, expected_mm: Vector) -> None:
    check_point(written, expected_mm)


def test_directions_become_unit_vectors() -> None:
    scene = scene_of(
        needle="needle { heading (3, -4, 0)  bevel 5 * z  radius 30 mm  speed 1 mm/s }"
    )
    assert scene.needle.tip == Pose((0.0, 0.0, 0.0), (0.6, -0.8, 0.0), (0.0, 0.0, 1.0))
    assert scene.axis == (0.6, -0.8, 0.0)


def test_bevel_is_made_exactly_perpendicular() -> None:
    scene = scene_of(needle="needle { bevel (0, 0.0000005, 1)  radius 30 mm  speed 1 mm/s }")
    assert scene.needle.tip.bevel == (0.0, 0.0, 1.0)


def test_motion() -> None:
    scene = scene_of("motion { step 500 ms roll by 45, 1 deg at least 1 cm apart at most 3 times }")
    assert scene.limits == Limits(0.5, (math.pi / 4, math.pi / 180), 3, 10.0)


def test_loop_ends_are_included_and_indices_are_numbers() -> None:
    scene = scene_of(
        """for i in -1..1 { for j in 0..1 {
             critical C[i][2 * j] sphere (5 * i, -25, j) mm radius 1 mm
             detection D[i][j] around C[i][2 * j] margin 2 mm
           } }"""
    )
    assert [r.name for r in scene.criticals] == [
        *("C[-1][0]", "C[-1][2]", "C[0][0]", "C[0][2]", "C[1][0]", "C[1][2]")
    ]
    assert scene.detections[-1] == Region.ball("D[1][1]", "detection", (5, -25, 1), 3.0, "C[1][2]")


def test_targets_keep_their_order() -> None:
    scene = scene_of("target Z sphere (0, -30, 0) mm radius 3 mm", target=TARGET)
    assert [target.name for target in scene.targets] == ["T1", "Z"]


def test_queries_are_kept_as_written() -> None:
    scene = scene_of("query A = control: A<>  Checker.X && y[1] // c\nquery B = E<> x // y")
    assert scene.queries == (
        NamedQuery("A", "control: A<>  Checker.X && y[1]"),
        NamedQuery("B", "E<> x"),
    )


def test_resolution_and_safety() -> None:
    scene = scene_of("resolution 5000 per cm safety swept")
    assert (scene.resolution_per_mm, scene.safety) == (500, "swept")


def test_large_environment_is_read() -> None:
    scene = scene_of("for i in 1..9999 { critical C[i] sphere (i, -9, 30) mm radius 1 mm }")
    assert len(scene.criticals) == 9999
