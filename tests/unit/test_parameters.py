"""The table of settings: it has every field, and file and command line read it alike."""

from __future__ import annotations

import dataclasses
import math
import re
from pathlib import Path

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from ntagen import nsl
from ntagen.drive.configure import COMMAND_LINE, Configuration, configure
from ntagen.drive.reliance import clearance_without_force_mm, relies_on
from ntagen.drive.settings import Settings, value_of
from ntagen.errors import InputError
from ntagen.needle.virtual import Errors
from ntagen.nsl.driving import read_settings
from ntagen.parameters import BY_WORDS, MEASURES, PARAMETERS, PARTS, Given, Parameter, Value
from ntagen.shapes import Sphere
from tests.scenes import PAPER, paper

BODY = (
    "environment e {{ needle {{ radius 30 mm speed 1 mm/s }}"
    " target T sphere (0, -50, 0) mm radius 10 mm drive {{ {} }} }}"
)
QUANTITIES = [p for p in PARAMETERS if p.kind not in ("switch", "words")]


def in_file(text: str) -> tuple[Given, ...]:
    """The settings of a file with this text in the braces of `drive`."""
    return nsl.loads_task(BODY.format(text), "e.nsl").given


def on_line(words: str, text: str) -> Given:
    """A setting on the command line."""
    (given,) = read_settings([f"{words} {text}"], COMMAND_LINE)
    return given


def test_every_setting_is_a_row_of_the_table() -> None:
    defaults = Settings()
    fields = {
        one.name: getattr(defaults, one.name)
        for one in dataclasses.fields(Settings)
        if one.name not in ("margins", "priors")
    }
    for part in ("margins", "priors"):
        inner = getattr(defaults, part)
        fields |= {
            f"{part}.{one.name}": getattr(inner, one.name) for one in dataclasses.fields(inner)
        }
    fields |= {f"needle.{one.name}": None for one in dataclasses.fields(Errors)}
    assert {p.field for p in PARAMETERS} == {*fields, "needle.seed"}
    assert len({p.words for p in PARAMETERS}) == len(PARAMETERS)
    assert {p.part for p in PARAMETERS} == set(PARTS)


@pytest.mark.parametrize("parameter", PARAMETERS, ids=lambda parameter: parameter.words)
def test_the_default_is_allowed_and_can_be_written_as_it_is_shown(parameter: Parameter) -> None:
    default = Configuration().value(parameter)
    if default is None:
        return
    assert parameter.breach(default) is None
    shown = parameter.shown(default)
    (read,) = in_file(f"{parameter.words} {shown}")
    for value in (read.value, parameter.parse(shown)):
        if isinstance(value, tuple):
            assert value == default
        else:
            assert value == pytest.approx(default, rel=1e-5)


@given(st.sampled_from(QUANTITIES), st.data())
def test_file_and_command_line_read_the_same_value(
    parameter: Parameter, data: st.DataObject
) -> None:
    measure = MEASURES[parameter.kind]
    unit = data.draw(st.sampled_from(sorted(measure.units)))
    if parameter.kind == "count":
        number: float = data.draw(st.integers(1, 10**6))
    else:
        low = max(parameter.least, 1e-3) / measure.units[unit]
        number = data.draw(st.floats(low, low + 100.0)) if parameter.least >= 0.0 else 0.1
    assume(parameter.breach(number * measure.units[unit]) is None)
    text = f"{number!r} {unit}".rstrip()
    (read,) = in_file(f"{parameter.words} {text}")
    assert parameter.parse(text) == read.value
    assert parameter.parse(text.replace(" ", "")) == read.value
    assert on_line(parameter.words, text).value == read.value
    assert re.fullmatch(r"e\.nsl:1:\d+", read.origin)


@pytest.mark.parametrize(
    ("words", "text", "value"),
    [
        ("pull", "4mm", 4.0),
        ("pull", "4", 4.0),
        ("pull", "0.4cm", 4.0),
        ("roll error", "2deg", math.radians(2.0)),
        ("roll error", "2", math.radians(2.0)),
        ("true bevel", "-2", math.radians(-2.0)),
        ("radius error", "-10", -0.1),
        ("radius error", "10 %", 0.1),
        ("time limit", "0.05 min", 3.0),
        ("force", "100mN", 0.1),
        ("force rise", "500N/m", 0.5),
        ("roll speed", "90deg/s", math.pi / 2),
        ("engine memory", "1GiB", 2.0**30),
        ("seed", "7", 7),
        ("force sensing", "off", False),
    ],
)
def test_values_on_the_command_line(words: str, text: str, value: Value) -> None:
    assert BY_WORDS[words].parse(text) == pytest.approx(value)
    assert on_line(words, text).value == pytest.approx(value)


def test_the_command_line_wins_over_the_file_and_the_file_over_the_default() -> None:
    found = configure((*in_file("pull 8 mm push 3 mm"), on_line("pull", "6mm")), PAPER)
    assert (found.settings.pull_mm, found.settings.push_mm) == (6.0, 3.0)
    assert found.settings.deviation_mm == Settings().deviation_mm
    origins = {words: origin for words, _, origin in found.rows()}
    assert origins["pull"] == "command line"
    assert origins["push"].startswith("e.nsl:1:")
    assert origins["deviation"] == "default"


def test_settings_that_do_not_fit_together_are_refused_with_their_origins() -> None:
    with pytest.raises(InputError, match="must be greater than `push`") as caught:
        configure((*in_file("push 12 mm"), on_line("pull", "6mm")), PAPER)
    assert "`push`: e.nsl:1:" in str(caught.value)
    assert "`pull`: command line" in str(caught.value)


def test_the_priors_follow_the_errors_of_the_needle_unless_they_are_given() -> None:
    noisy = on_line("noise", "0.7mm")
    assert configure((noisy,), PAPER).settings.priors.noise_mm == 0.7
    wrong = configure((noisy, on_line("prior noise", "0.2mm")), PAPER)
    assert wrong.settings.priors.noise_mm == 0.2
    assert wrong.errors.noise_mm == 0.7


def test_a_deep_target_has_more_time() -> None:
    assert configure((), PAPER).settings.timeout_s == 150.0
    (target,) = PAPER.targets
    deep = dataclasses.replace(target, shape=Sphere((0.0, -80.0, 0.0), 5.0))
    assert configure((), PAPER.with_targets([deep])).settings.timeout_s == 240.0
    near = dataclasses.replace(target, shape=Sphere((0.0, -20.0, 0.0), 5.0))
    assert configure((), PAPER.with_targets([near])).settings.timeout_s == 120.0
    given = configure((on_line("time limit", "90s"),), PAPER.with_targets([deep]))
    assert given.settings.timeout_s == 90.0


def test_without_force_sensing_plans_keep_a_distance() -> None:
    off = on_line("force sensing", "off")
    assert configure((), PAPER).settings.margins.clearance_mm == 0.0
    settings = configure((off,), PAPER).settings
    assert settings.margins.clearance_mm == pytest.approx(1.5 + 3 * 0.25 + 3 * 0.1)
    assert settings.margins.clearance_mm == clearance_without_force_mm(settings)
    wider = configure((off, on_line("deviation", "2mm"), on_line("noise", "0.5mm")), PAPER).settings
    assert wider.margins.clearance_mm == pytest.approx(2.0 + 3 * 0.25 + 3 * 0.5)
    given_by_user = configure((off, on_line("clearance", "0")), PAPER).settings
    assert given_by_user.margins.clearance_mm == 0.0


def test_what_the_driver_relies_on_is_said() -> None:
    assert "on the force: stops when it rises by 0.1 N" in relies_on(Settings(), PAPER)
    blind = configure((on_line("force sensing", "off"),), PAPER).settings
    said = relies_on(blind, PAPER)
    assert "not on the force" in said
    assert "on 1 known critical region: plans stay more than 2.55 mm away" in said
    assert "on no known critical region" in relies_on(blind, paper(criticals=()))


def test_devices_and_trackers_are_read() -> None:
    path = Path(__file__).parents[1] / "corpus" / "nsl" / "ok" / "driver_and_devices.nsl"
    task = nsl.load_task(path)
    assert task.device is not None
    assert task.device.port == "/dev/ttyACM0"
    assert (task.device.insert.letter, task.device.insert.steps_per_unit) == ("X", 80.0)
    assert (task.device.roll.letter, task.device.roll.steps_per_unit) == ("A", -8.89)
    assert task.tracker is not None
    assert (task.tracker.host, task.tracker.port, task.tracker.name) == ("::1", 18944, "")
    settings = configure(task.given, task.scene).settings
    assert (settings.pull_mm, settings.push_mm, settings.spacing_mm) == (4.0, 2.0, 0.25)
    assert value_of(settings, "engine_memory_bytes") == 2**30
