"""The generated model: what is in it, and that it follows from the scene."""

from __future__ import annotations

import re
import xml.etree.ElementTree as ElementTree
from dataclasses import replace

import pytest
from hypothesis import given, settings

from ntagen.errors import InputError
from ntagen.render import render, render_queries
from ntagen.scene import NamedQuery, Pose, Region, Scene
from ntagen.shapes import Sphere
from tests.examples import examples
from tests.oracles.declaration import Instance
from tests.scenes import PAPER, paper, scenes, with_limits

LOCATIONS = {
    "User": ["Init", "Wait_For_Check", "Idle", "Perform_Action", "Request_Check", "End"],
    "Needle": ["Idle", "Push", "Rotate"],
    "Tissue": ["Idle", "React"],
    "Checker": [
        "Idle",
        "Check_Path_Valid",
        "Check_TR_Reached",
        "Check_TR_Reachable",
        "Check_CR_Reached",
        "Path_Invalid",
        "Final_TR_Reached",
        "TR_Unreachable",
        "UR_Reached",
    ],
}


def parse(text: str) -> ElementTree.Element:
    return ElementTree.fromstring(text)


def declaration(scene: Scene) -> str:
    return parse(render(scene)).findtext("declaration", "")


def constant(text: str, name: str) -> object:
    """The value of a name in the declaration, its initialiser as nested tuples."""
    scale = int(re.search(r"const int _SI_ = (\d+);", text)[1])  # type: ignore[index]
    found = re.search(rf"\b{name}(?:\[\w+\])* = ([^;]*);", text)
    assert found is not None, name
    plain = re.sub(r"//.*", "", found[1]).replace("{", "(").replace("}", ",)")
    names = {"_SI_": scale, "true": True, "false": False}
    return eval(re.sub(r"\s+", " ", plain).replace(",,", ","), names)


def check_constants(scene: Scene, instance: Instance) -> None:
    """The declaration of a scene holds the constants of an instance of the oracle."""
    text = declaration(scene)
    assert constant(text, "_SI_") == instance.scale
    assert constant(text, "dt") == instance.dt
    assert constant(text, "needle_vel") == instance.velocity
    assert constant(text, "motion_circle_r") == instance.circle_r
    assert constant(text, "MIN_PROG_BETWEEN_ROTS") == instance.min_progress
    assert constant(text, "MAX_ROT_COUNT") == instance.max_rolls
    assert constant(text, "MAX_ACT_COUNT") == instance.max_actions
    assert constant(text, "allowed_rot_angles") == instance.angles
    assert constant(text, "tip_pos") == instance.tip
    matrices = constant(text, "matrices")
    assert isinstance(matrices, tuple)
    assert matrices[1] == instance.base
    kinds = (
        ("TR", instance.targets),
        ("CR", instance.criticals),
        ("DR", instance.detections),
        *((("UR", instance.unexplored),) if instance.unexplored else ()),
    )
    for kind, spheres in kinds:
        assert constant(text, f"{kind}_COUNT") == len(spheres)
        centers = tuple(sphere.center for sphere in spheres) or ((0, 0, 0),)
        assert constant(text, f"{kind}_center") == centers
        assert constant(text, f"{kind}_radius") == (tuple(s.radius for s in spheres) or (0,))
    assert constant(text, "HAS_CRITICAL_REGIONS") == bool(instance.criticals)
    assert constant(text, "HAS_DETECTION_REGIONS") == bool(instance.detections)


def test_locations_and_processes_have_the_names_of_the_paper() -> None:
    document = parse(render(PAPER))
    found = {
        template.findtext("name"): [name.text for name in template.findall("location/name")]
        for template in document.findall("template")
    }
    assert found == LOCATIONS
    assert "system User, Needle, Tissue, Checker;" in document.findtext("system", "")


def test_only_the_answer_of_the_tissue_is_uncontrollable() -> None:
    found = [
        (template.findtext("name"), edge.findtext("label"))
        for template in parse(render(PAPER)).findall("template")
        for edge in template.findall("transition")
        if edge.get("controllable") is not None
    ]
    assert found == [("Tissue", "finished_tissue_action!")]


@pytest.mark.parametrize("safety", ["sampled", "swept"])
def test_edges_lead_to_locations_of_their_template(safety: str) -> None:
    for template in parse(render(paper(safety=safety))).findall("template"):
        ids = {location.get("id") for location in template.findall("location")}
        ends = template.findall("transition/source") + template.findall("transition/target")
        assert {end.get("ref") for end in [*ends, *template.findall("init")]} <= ids


def test_the_paper_scene_gives_the_published_constants() -> None:
    check_constants(PAPER, Instance())


@settings(max_examples=examples(50), deadline=None)
@given(scenes())
def test_any_scene_gives_the_constants_of_the_oracle(scene: Scene) -> None:
    check_constants(scene, Instance.of_scene(scene))


def test_a_scene_is_always_written_the_same_way() -> None:
    assert render(PAPER, "paper.nsl") == render(PAPER, "paper.nsl")


def test_a_fractional_step_becomes_the_unit_of_time() -> None:
    scene = with_limits(paper(needle=replace(PAPER.needle, speed_mm_per_s=0.7)), step_s=1.5)
    text = declaration(scene)
    assert (constant(text, "dt"), constant(text, "needle_vel")) == (1, 1050)
    assert "one push: 1.5 s" in text


def test_another_direction_of_insertion_gives_the_same_model() -> None:
    def swapped(x: float, y: float, z: float) -> tuple[float, float, float]:
        return (-y, x, z)

    def moved(region: Region) -> Region:
        return replace(region, shape=Sphere(swapped(*region.center_mm), region.radius_mm))

    along_x = paper(
        axis=swapped(*PAPER.axis),
        needle=replace(PAPER.needle, tip=Pose((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))),
        targets=tuple(moved(region) for region in PAPER.targets),
        criticals=tuple(moved(region) for region in PAPER.criticals),
        detections=tuple(moved(region) for region in PAPER.detections),
    )
    check_constants(along_x, Instance())
    assert "The scene was turned" in declaration(along_x)


def test_names_cannot_break_out_of_their_comments() -> None:
    name = "a\nconst int x = 1; </declaration> */"
    text = declaration(paper(targets=(replace(PAPER.targets[0], name=name),)))
    assert "\nconst int x" not in text
    assert "// a const int x = 1; </declaration> */\n" in text


def test_only_swept_models_hold_the_swept_check() -> None:
    assert "arc" not in re.sub(r"search", "", declaration(PAPER))
    assert "bool arc_touches" in declaration(paper(safety="swept"))


@pytest.mark.parametrize(
    ("scene", "message"),
    [
        (paper(targets=()), "no target"),
        (with_limits(PAPER, roll_angles_rad=()), "no roll"),
        (paper(resolution_per_mm=10), "a push of 2 mm does not bend the needle"),
        (paper(needle=replace(PAPER.needle, radius_mm=0.0001)), "which is rounded to 0"),
        (paper(needle=replace(PAPER.needle, radius_mm=3e5)), "the radius of the motion circle"),
        (with_limits(PAPER, step_s=1e6), "a push does not fit"),
        (with_limits(paper(safety="swept"), step_s=100.0), "half around"),
    ],
)
def test_what_the_model_cannot_hold_is_refused(scene: Scene, message: str) -> None:
    with pytest.raises(InputError, match=message):
        render(scene)


def test_the_queries_of_the_paper_come_first() -> None:
    scene = paper(
        queries=(
            NamedQuery("Safe", "A[] not\n  Checker.UR_Reached"),
            NamedQuery("Quick", "control: A<> Checker.Final_TR_Reached && t < 60"),
            NamedQuery("ReachFinalTR", "control: A<> Checker.Final_TR_Reached"),
        )
    )
    formulas = [
        "E<> Checker.Final_TR_Reached",
        "strategy ReachFinalTR = control: A<> Checker.Final_TR_Reached",
        "A[] not Checker.UR_Reached",
        "strategy Quick = control: A<> Checker.Final_TR_Reached && t < 60",
    ]
    in_model = [query.text for query in parse(render(scene)).findall("queries/query/formula")]
    lines = [line for line in render_queries(scene).splitlines() if line[:2] not in ("", "//")]
    assert in_model == formulas
    assert lines == formulas


def test_two_different_queries_of_one_name_are_refused() -> None:
    scene = paper(queries=(NamedQuery("ReachFinalTR", "E<> User.End"),))
    with pytest.raises(InputError, match="in every model"):
        render(scene)


LEFT = Region.ball("Left", "unexplored", (9.0, -25.0, 0.0), 3.0)
ENTRY = Region.ball("Entry", "safe", (0.0, -9.0, 0.0), 5.0)


def test_unexplored_and_safe_regions_are_in_the_model_only_if_there_are_any() -> None:
    plain = declaration(PAPER)
    assert not re.search(r"\b[US]R_(COUNT|center|radius)\b", plain)
    text = declaration(paper(unexplored=(LEFT,), safe=(ENTRY,)))
    assert constant(text, "UR_center") == ((9000, -25000, 0),)
    assert constant(text, "UR_radius") == (3000,)
    assert constant(text, "SR_center") == ((0, -9000, 0),)
    assert constant(text, "SR_radius") == (5000,)
