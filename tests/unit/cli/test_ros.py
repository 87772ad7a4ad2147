"""`ntagen ros` on the command line: what is refused before a node begins, with one message each."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

from ntagen.cli import main
from ntagen.cli.needle.ros import split_arguments

EXAMPLES = Path(__file__).parents[3] / "examples"
STEPPER = str(EXAMPLES / "stepper.nsl")


@pytest.fixture(autouse=True)
def _without_ros(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nothing here needs ROS, and where it is installed it is hidden."""
    monkeypatch.setitem(sys.modules, "rclpy", None)


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (["ros", STEPPER], "the Python package rclpy cannot be imported"),
        (["device", "simulate", STEPPER, "--ros"], "the Python package rclpy cannot be imported"),
        (["ros", STEPPER, "--needle", "grbl+sim"], "a node does not steer grbl+sim"),
        (["ros", STEPPER, "--needle", "none"], "there is no needle 'none'"),
        (["ros", STEPPER, "--known", "C9"], "unknown critical region 'C9'"),
        (["ros", STEPPER, "--topics", "none.toml"], "none.toml"),
        (["ros", STEPPER, "--registration", "none.json"], "none.json"),
        (["drive", STEPPER, "--needle", "ros"], "is driven by a node"),
    ],
    ids=lambda words: " ".join(words[:1] + words[2:]) if isinstance(words, list) else "",
)
def test_a_mistake_gets_one_message(
    words: list[str], says: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(words) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert says in err
    assert "Traceback" not in err


def test_the_way_to_ros_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    main(["ros", STEPPER])
    assert "hint: `pip install 'ntagen[ros]'`" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("words", "ours", "ros"),
    [
        ("a.nsl --log x", "a.nsl --log x", ""),
        ("a.nsl --ros-args -p units:=mm -r a:=b", "a.nsl", "--ros-args -p units:=mm -r a:=b"),
        ("a.nsl --ros-args -p u:=mm -- --log x", "a.nsl --log x", "--ros-args -p u:=mm"),
    ],
)
def test_what_stands_behind_ros_args_is_for_ros(words: str, ours: str, ros: str) -> None:
    assert split_arguments(words.split()) == (ours.split(), ros.split())
