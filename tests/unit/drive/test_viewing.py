"""Messages for viewers: what is drawn, and what vanishes."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

from google.protobuf.message import Message

from ntagen.drive.knowledge import told
from ntagen.drive.records import Estimated, Forgotten, Learned, Measured, Predicted, Record
from ntagen.drive.settings import Settings
from ntagen.drive.simulate import simulate
from ntagen.drive.viewing import Shaft, show_hidden, show_plan, show_record, show_scene
from ntagen.plan.synthesise import Synthesis
from ntagen.scene import Region, Vector
from tests.drive.runs import Diary
from tests.oracles.synthesiser import oracle_synthesis
from tests.steering import HIDDEN, PAPER, scene, sphere

DOWN: Vector = (0.0, -1.0, 0.0)
UP: Vector = (0.0, 0.0, 1.0)


def updates(messages: Iterable[tuple[str, Message]]) -> Iterator[Any]:
    return (message for topic, message in messages if topic == "/scene")


def drawn(messages: Iterable[tuple[str, Message]]) -> dict[str, Any]:
    """The entities that a viewer shows after these messages, by their ids."""
    shown: dict[str, Any] = {}
    for update in updates(messages):
        for deletion in update.deletions:
            shown.pop(deletion.id, None)
        shown |= {entity.id: entity for entity in update.entities}
    return shown


def measured(depth_mm: float, position_mm: Vector) -> Measured:
    return Measured(depth_mm, depth_mm, position_mm, 0.0, (), ())


def test_all_kinds_of_regions_are_drawn() -> None:
    unknown = sphere("U", "unexplored", (9.0, -20.0, 0.0), 2.0)
    safe = sphere("S", "safe", (0.0, -5.0, 0.0), 3.0)
    shown = drawn(show_scene(PAPER.with_regions(unknown, safe)))
    assert {"target T1", "unexplored U", "safe S"} <= shown.keys()
    assert shown["unexplored U"].spheres[0].size.x == 0.004


def test_hidden_regions_are_drawn_apart_and_paler_than_known_ones() -> None:
    known = told(HIDDEN, "C1")
    hidden = drawn(show_hidden(HIDDEN, known))
    assert hidden
    assert all(name.startswith("hidden ") for name in hidden)
    assert not hidden.keys() & drawn(show_scene(known)).keys()
    pale = next(iter(hidden.values())).spheres[0].color.a
    assert pale < min(e.spheres[0].color.a for e in drawn(show_scene(known)).values())
    assert drawn(show_hidden(PAPER, PAPER)) == {}


def test_a_region_that_is_forgotten_vanishes() -> None:
    region = Region.ball("learned 1", "critical", (0.0, -20.0, 0.0), 2.0)
    learned, forgotten = Learned.of(1.0, region), Forgotten(2.0, "learned 1", "critical")
    assert "critical learned 1" in drawn(show_record(learned))
    assert drawn([*show_record(learned), *show_record(forgotten)]) == {}


def test_a_run_leaves_those_learned_regions_that_the_driver_knows() -> None:
    where = scene(sphere("C1", "critical", (0.0, -25.0, 0.0), 6.0))
    diary = Diary()
    simulate(where, oracle_synthesis, Settings(), diary, known="none")
    messages = [message for record in diary.records for message in show_record(record)]
    balls = {name for name in drawn(messages) if name.startswith("critical learned")}
    known = {f"critical {region.name}" for region in diary.syntheses[-1].scene.criticals}
    assert balls == known != set()


def test_the_plan_vanishes_when_there_is_none() -> None:
    there = oracle_synthesis(PAPER)
    gone = Synthesis(PAPER, "", 0, (), 0.0)
    assert "plan" in drawn(show_plan(there, 1.0))
    assert drawn([*show_plan(there, 1.0), *show_plan(gone, 2.0)]) == {}


def test_the_shaft_goes_from_the_entry_to_the_tip_and_shrinks_when_it_is_pulled() -> None:
    shaft = Shaft((0.0, 0.0, 0.0))
    records: list[Record] = []
    for step in range(1, 21):
        depth_mm = 0.5 * step
        records.append(measured(depth_mm, (0.3, -depth_mm, 0.0)))
        records.append(Predicted(depth_mm, (0.0, -depth_mm, 0.0), DOWN, UP, 0.3))
    pushed = drawn(m for record in records for m in shaft.show(record))["shaft"].lines[0].points
    assert len(pushed) == 11
    assert (pushed[0].y, round(pushed[-1].y, 9)) == (0.0, -0.01)
    # The prediction counts more than the noise of the measurement.
    assert {point.x for point in pushed} == {0.0}
    pulled = drawn(shaft.show(measured(4.0, (0.0, -4.0, 0.0))))["shaft"].lines[0].points
    assert round(pulled[-1].y, 9) == -0.004
    estimated = Estimated(5.0, (0.0, -4.0, 0.0), DOWN, UP, 30.0, 1.0, 0.1)
    assert list(shaft.show(estimated)) == []
