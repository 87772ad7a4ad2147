"""The generated declaration computes what the oracle computes, bit for bit."""

from __future__ import annotations

import tempfile
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from ntagen.render import render
from ntagen.scene import Scene
from tests.oracles.compiled import COMPILER, CompiledNeedle
from tests.oracles.declaration import Instance, Needle
from tests.scenes import PAPER, choices, scenes

pytestmark = pytest.mark.skipif(COMPILER is None, reason="needs a C compiler")

PATHS_OF_THE_PAPER = 2000
"""Every run of the tests draws others."""
SCENES = 20
PATHS_A_SCENE = 50


def compiled(scene: Scene, instance: Instance, folder: str) -> CompiledNeedle:
    declaration = ElementTree.fromstring(render(scene)).findtext("declaration", "")
    return CompiledNeedle(declaration, instance, Path(folder))


def check_path(needle: Needle, other: CompiledNeedle, picks: list[int]) -> None:
    """Both walk the same path; after every check and at the end all variables are the same."""
    other.start()
    angles = needle.instance.angles
    for pick in picks:
        end = needle.check()
        assert other.check() == end
        assert other.variables() == needle.variables()
        if end is not None:
            return
        may_roll = needle.may_roll()
        assert other.may_roll() == may_roll
        move = pick % (1 + len(angles) * may_roll)
        if move:
            needle.roll(angles[move - 1])
            other.roll(angles[move - 1])
        else:
            needle.push()
            other.push()
    assert other.variables() == needle.variables()


@pytest.mark.slow
def test_two_thousand_paths_of_the_paper_scene() -> None:
    with tempfile.TemporaryDirectory() as folder:
        other = compiled(PAPER, Instance(), folder)

        @settings(max_examples=PATHS_OF_THE_PAPER, deadline=None, database=None)
        @given(choices())
        def walk(picks: list[int]) -> None:
            check_path(Needle.start(Instance()), other, picks)

        walk()


@pytest.mark.slow
@settings(max_examples=SCENES, deadline=None, suppress_health_check=list(HealthCheck))
@given(scenes(), st.lists(choices(), min_size=PATHS_A_SCENE // 2, max_size=PATHS_A_SCENE))
def test_paths_of_any_scene(scene: Scene, paths: list[list[int]]) -> None:
    instance = Instance.of_scene(scene)
    with tempfile.TemporaryDirectory() as folder:
        other = compiled(scene, instance, folder)
        for picks in paths:
            check_path(Needle.start(instance), other, picks)
