"""The settings of a node: units, frames, names."""

from __future__ import annotations

from pathlib import Path

import pytest

from ntagen.errors import InputError
from ntagen.ros.topics import (
    MARKERS,
    STATUS,
    TIP,
    Topics,
    apart,
    parameters,
    read_topics,
    topics_of,
)


def test_metres_are_the_default() -> None:
    assert Topics().mm_per_unit == 1000.0
    assert topics_of({"units": "mm"}, "here").sensor_mm_per_unit == 1.0
    mixed = topics_of({"sensor_units": "mm"}, "here")
    assert (mixed.mm_per_unit, mixed.sensor_mm_per_unit) == (1000.0, 1.0)


def test_a_file_changes_names_and_units(tmp_path: Path) -> None:
    path = tmp_path / "lab.toml"
    path.write_text('units = "mm"\ndepth = 3\n[names]\n"/sensor/tip" = "/em/tip"\n')
    found = read_topics(path)
    assert (found.units, found.depth, found.tip) == ("mm", 3, "/em/tip")
    assert read_topics(None) == Topics()


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("units = 'cm'", "cm"),
        ("unit = 'mm'", "there is no `unit`"),
        ("units = mm", "this is no TOML"),
        ("depth = 0", "`depth` is 0, and it must be greater than 0"),
        ("stale_s = nan", "`stale_s` is nan"),
        ("latency_s = -1.0", "must not be negative"),
        ("axis = 'z'", "must be one of"),
        ("axis = '+x'\nbevel = '-x'", "on one line"),
        ("tip_from = 'shape'\nbevel = '+x'", "say nothing of its `bevel` +x"),
        ("reliability = 'good'", "good"),
        ("needle_frame = 'stage'", "both 'stage'"),
        ("[names]\n'/tip' = '/em/tip'", "there is no topic /tip"),
        ("[names]\n'/sensor/tip' = ''", "is empty"),
        ("depth = 'many'", "Expected `int`"),
    ],
)
def test_a_mistake_gets_one_message_with_its_place(text: str, says: str, tmp_path: Path) -> None:
    path = tmp_path / "lab.toml"
    path.write_text(text)
    with pytest.raises(InputError) as caught:
        read_topics(path)
    assert says in str(caught.value)
    assert str(caught.value).startswith(str(path))


def test_a_simulation_has_sensors_and_stage_apart() -> None:
    own = apart(Topics(), "/simulated")
    assert own.name(TIP) == "/simulated/sensor/tip"
    assert (own.name(STATUS), own.name(MARKERS)) == (STATUS, MARKERS)


def test_every_setting_but_names_is_a_parameter() -> None:
    assert "names" not in parameters()
    assert topics_of(parameters(), "the parameters of the node") == Topics()
