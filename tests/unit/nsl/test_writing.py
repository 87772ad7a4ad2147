"""Tasks made in Python: their text says the same, and what it cannot say is refused."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import Phase, event, given, settings
from hypothesis import strategies as st

import ntagen
from ntagen import nsl
from ntagen.errors import InputError
from ntagen.motion import Breath, Gate, Motion
from ntagen.nsl import SourceError, Task
from ntagen.nsl.writing_shapes import region_text
from ntagen.parameters import BY_WORDS, Given
from ntagen.scene import Limits, NamedQuery, Needle, Pose, Region, Scene, Tissue, Vector
from ntagen.shapes import Box, Capsule, Cylinder, Ellipsoid, HalfSpace, Shape, Sphere, turning
from tests.examples import examples
from tests.scenes import PAPER, lengths, paper, poses, scenes

ROOT = Path(__file__).parents[3]


def is_environment(path: Path) -> bool:
    return "environment" in path.read_text("utf-8") and "segmentation" not in path.parts


FILES = [
    *filter(is_environment, sorted((ROOT / "examples").glob("**/*.nsl"))),
    *sorted((ROOT / "tests" / "corpus" / "nsl" / "ok").glob("*.nsl")),
]


def given_values(task: Task) -> list[tuple[str, object]]:
    return [(one.parameter.words, one.value) for one in task.given]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_the_text_of_a_file_s_task_says_the_same_to_the_last_digit(path: Path) -> None:
    task = nsl.load_task(path)
    text = task.to_nsl()
    again = nsl.loads_task(text)
    assert again.scene == task.scene
    assert (again.device, again.tracker) == (task.device, task.tracker)
    assert given_values(again) == given_values(task)
    assert nsl.format_text(text) == text
    assert Task(again.scene, again.given, again.device, again.tracker).to_nsl() == text


def flat(value: object) -> list[object]:
    """The parts of a value in their order."""
    if isinstance(value, tuple):
        return [part for one in value for part in flat(one)]
    if hasattr(value, "__dataclass_fields__"):
        return [part for name in value.__dataclass_fields__ for part in flat(getattr(value, name))]
    return [value]


def components() -> st.SearchStrategy[Vector]:
    return st.tuples(*(lengths(-30.0, 30.0) for _ in range(3)))


def directions() -> st.SearchStrategy[Vector]:
    return components().filter(lambda vector: math.hypot(*vector) > 1.0)


@st.composite
def shapes(draw: st.DrawFn) -> Shape:
    start, end = draw(components()), draw(directions())
    size = draw(st.tuples(*(lengths(1.0, 9.0) for _ in range(3))))
    axes = turning(draw(directions()), draw(st.floats(-7.0, 7.0)))
    length = math.hypot(*end)
    towards: Vector = (end[0] / length, end[1] / length, end[2] / length)
    apart: Vector = (start[0] + end[0], start[1] + end[1], start[2] + end[2])
    made: list[Shape] = [
        Sphere(start, size[0]),
        Box(start, size),
        Box(start, size, axes),
        Ellipsoid(start, size, axes),
        Capsule(start, apart, size[0], size[1]),
        Cylinder(start, apart, size[0]),
        HalfSpace(start, towards),
    ]
    return draw(st.sampled_from(made))


@st.composite
def motions(draw: st.DrawFn) -> Motion:
    if draw(st.booleans()):
        return Motion(4.0, draw(components()), draw(st.floats(0.0, 6.28)))
    times = sorted(draw(st.sets(st.integers(0, 39), min_size=1, max_size=4)))
    return Motion(4.0, table=tuple((0.1 * time, draw(components())) for time in times))


@st.composite
def drawn(draw: st.DrawFn) -> Scene:
    """Scenes of files: any shapes, shells, motions, and a tissue."""
    scene = draw(scenes())
    pose = draw(poses())
    shape, motion = draw(shapes()), draw(st.none() | motions())
    region = Region("V1", "critical", shape, None, motion)
    margin = draw(lengths(0.5, 5.0))
    shell = Region("V2", "detection", shape.grown(margin), "V1", motion)
    tissue = Tissue("adversarial", *(draw(st.floats(0.001, 0.2)) for _ in range(3)))
    gate = draw(st.none() | st.just(Gate(1.0, 6.0)))
    return replace(
        scene,
        needle=replace(scene.needle, tip=pose),
        axis=pose.heading,
        criticals=(*scene.criticals, region),
        detections=(*scene.detections, shell),
        tissue=draw(st.sampled_from((Tissue(), tissue, replace(tissue, kind="stochastic")))),
        breath=None if motion is None else Breath(4.0, 0.5, 2, gate),
        queries=(NamedQuery("Reach", "E<> Checker.Final_TR_Reached"),),
    )


@given(drawn())
@settings(
    deadline=None, max_examples=examples(40), phases=(Phase.explicit, Phase.reuse, Phase.generate)
)
def test_the_text_of_a_scene_loads_as_the_same_scene_or_breaks_a_rule(scene: Scene) -> None:
    try:
        text = Task(scene).to_nsl()
    except SourceError as error:
        # The drawn regions may lie where the rules forbid it; the text itself is well formed.
        event("a rule")
        codes = {one.code for one in error.diagnostics if one.severity == "error"}
    else:
        event("a text")
        codes = set()
        _compare(text, scene)
    assert codes <= RULES_OF_PLACES


def _compare(text: str, scene: Scene) -> None:
    """Fails if a text does not say what a scene is."""
    again = nsl.loads(text)
    for own, other in zip(flat(scene), flat(again), strict=True):
        is_number = isinstance(own, float)
        assert other == (pytest.approx(own, rel=1e-12, abs=1e-12) if is_number else own)
    assert nsl.format_text(text) == text


RULES_OF_PLACES = {f"N{number:03}" for number in range(60, 130)}
"""The rules on values; those below are about the form of a text."""


@given(shapes(), lengths(0.5, 5.0))
@settings(deadline=None, max_examples=examples(100))
def test_a_shell_is_written_by_its_margin(shape: Shape, margin_mm: float) -> None:
    inner = Region("V", "critical", shape)
    shell = Region("S", "detection", shape.grown(margin_mm), "V")
    words = region_text(shell, inner).split()
    assert words[:5] == ["detection", "S", "around", "V", "margin"]
    assert float(words[5]) == pytest.approx(margin_mm, rel=1e-9)


def test_turns_and_ways_are_written_as_a_person_would() -> None:
    box = Box((0.0, 0.0, 0.0), (1.0, 2.0, 3.0), turning((0.0, 1.0, 1.0), math.radians(20)))
    moving = Region("B", "critical", box, None, Motion(4.0, (0.0, 0.0, 12.0), math.pi / 2))
    assert region_text(moving, None) == (
        "critical B box (0, 0, 0) mm size (1, 2, 3) mm turned 20 deg about (0, 1, 1)"
        " moves 12 mm along (0, 0, 1) every 4 s phase 90 deg"
    )


def test_a_scene_made_in_python_is_a_model() -> None:
    answer = ntagen.load(PAPER).check("control: A<> Checker.Final_TR_Reached")
    assert answer.verdict == "satisfied"
    assert ntagen.load(Task(PAPER)).network_json() == ntagen.load(PAPER).network_json()


def test_settings_of_the_driver_keep_their_digits() -> None:
    settings = tuple(
        Given(BY_WORDS[words], value, "here")
        for words, value in (("pull", 0.1 + 0.2), ("roll error", 1.0), ("force sensing", False))
    )
    text = Task(PAPER, settings).to_nsl()
    assert given_values(nsl.loads_task(text)) == [
        (one.parameter.words, one.value) for one in settings
    ]
    assert "pull 0.30000000000000004 mm" in text


def mistake(scene: Scene) -> str:
    with pytest.raises(InputError) as caught:
        Task(scene).to_nsl()
    return str(caught.value)


def test_a_broken_rule_names_the_part_of_the_task() -> None:
    inside = paper(targets=(Region.ball("T1", "target", (0.0, -25.0, 0.0), 1.0),))
    with pytest.raises(SourceError) as caught:
        Task(inside).to_nsl()
    (first,) = caught.value.diagnostics
    assert first.message == "`T1` lies inside the critical region `C1`"
    assert first.notes[0] == "this line is made of `targets[0]`"
    with pytest.raises(SourceError, match="lies inside"):
        ntagen.load(inside)
    away = Task(paper(targets=(Region.ball("T1", "target", (0.0, -25.0, 0.0), 9.0),))).checked()
    assert [one.notes[0] for one in away.warnings] == ["this line is made of `targets[0]`"]


@pytest.mark.parametrize(
    ("scene", "start"),
    [
        (paper(name="a b"), "name: `a b` cannot be a name"),
        (paper(name="target"), "name: `target` is a word of the language"),
        (
            paper(safe=(Region.ball("learned 1", "safe", (0.0, -5.0, 0.0), 1.0),)),
            "safe[0].name: `learned 1` cannot be a name",
        ),
        (paper(axis=(0.0, 0.0, 1.0)), "axis[1] is 0.0, but the language can only say -1.0"),
        (paper(shaft_mm=((0.0, 0.0, 0.0),)), "shaft_mm is ((0.0, 0.0, 0.0),), but the language"),
        (
            paper(detections=(Region.ball("D1", "detection", (0.0, -25.0, 1.0), 5.0, "C1"),)),
            "detections[0].shape.middle_mm[2] is 1.0, but the language can only say 0.0",
        ),
        (
            paper(queries=(NamedQuery("Q", "E<> x // y"),)),
            "queries[0]: the text of `Q` has a line break or a comment",
        ),
        (
            paper(limits=Limits(2.0, (), 2, 2.0)),
            "limits.roll_angles_rad: there is no roll",
        ),
        (
            paper(
                safe=(
                    Region(
                        "S",
                        "safe",
                        Sphere((0.0, -5.0, 0.0), 1.0),
                        None,
                        Motion(4.0, (math.nan, 0.0, 0.0)),
                    ),
                ),
                breath=Breath(4.0, 0.5, 1),
            ),
            "safe[0].motion.way_mm[0] is nan",
        ),
        (
            paper(
                needle=Needle(Pose((0.0, 0.0, 0.0), (0.0, -1.0, 0.0), (1.0, 0.0, 0.0)), 30.0, 1.0),
                limits=replace(PAPER.limits, free_bevel=True),
            ),
            "needle.tip.bevel[0] is 1.0, but the language can only say 0.0",
        ),
    ],
)
def test_what_the_language_cannot_say_is_refused_with_its_place(scene: Scene, start: str) -> None:
    message = mistake(scene)
    assert message.startswith(start)
    assert "\nhint: " in message


def test_the_shape_of_a_file_is_refused() -> None:
    task = nsl.load_task(ROOT / "examples" / "segmentation" / "biopsy.nsl")
    with pytest.raises(InputError, match="`Tumour` is the shape of a mesh or segmentation"):
        task.to_nsl()
