"""The oracle itself, against the census of a hand-written enumerator in C."""

import pytest

from ntagen.scene import Scene
from tests.oracles.declaration import End, Instance, Needle, enumerate_paths
from tests.scenes import PAPER, paper, with_limits


def check_census(instance: Instance, nodes: int, plans: int, others: tuple[int, int, int]) -> None:
    """Compares an enumeration; `others` are the invalid, unreachable and pierced paths."""
    census = enumerate_paths(instance)
    ends = (End.PATH_INVALID, End.TR_UNREACHABLE, End.UR_REACHED)
    assert (census.nodes, census.plans) == (nodes, plans)
    assert tuple(census.ends[end] for end in ends) == others


def test_the_paper_scene_gives_the_published_constants() -> None:
    assert Instance.of_scene(PAPER) == Instance()


@pytest.mark.parametrize(
    ("scene", "nodes", "plans", "others"),
    [
        (PAPER, 1679, 4, (51, 13, 5)),
        (paper(detections=()), 1749, 5, (54, 13, 1)),
        (paper(criticals=(), detections=()), 1769, 5, (55, 13, 0)),
    ],
    ids=["all regions", "no detection", "no region"],
)
def test_census_with_one_roll(
    scene: Scene, nodes: int, plans: int, others: tuple[int, int, int]
) -> None:
    check_census(Instance.of_scene(with_limits(scene, max_rolls=1)), nodes, plans, others)


@pytest.mark.slow
def test_census_with_two_rolls() -> None:
    check_census(Instance.of_scene(PAPER), 85_737, 129, (2405, 1932, 137))


def test_five_pushes_from_the_skin() -> None:
    needle = Needle.start(Instance())
    seen = []
    for _ in range(5):
        needle.push()
        seen.append((needle.needle_progress, tuple(needle.tip_pos), needle.motion_circle_yaw))
    assert seen == [
        (2000, (0, -1950, -89), 66),
        (4000, (0, -3930, -269), 132),
        (6000, (0, -5880, -600), 198),
        (8000, (0, -7800, -1050), 264),
        (10000, (0, -9720, -1620), 330),
    ]
