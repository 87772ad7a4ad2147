"""Files of tests: the model's own test code, templates of the user, and the example."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from ntagen import build
from ntagen.checker import load
from ntagen.cli import main
from ntagen.errors import InputError
from ntagen.suites import Harness, Suite, cover, harness_of, rendered
from ntagen.suites.layout import layout_of
from ntagen.suites.rendering import identifier, number, python
from tests.unit.suites.models import lamp, lamp_with_code

EXAMPLES = Path(__file__).resolve().parents[3] / "examples" / "tests"


def made(model: build.Model) -> tuple[Suite, Harness]:
    loaded = model.load()
    return cover(loaded, ["edges"], name="lamp.xml"), harness_of(layout_of(loaded))


def test_test_code_is_written_in_the_order_of_a_step() -> None:
    suite, harness = made(lamp_with_code())
    files = harness.files(suite.tests)
    assert list(files) == ["lamp-0.txt", "lamp-1.txt"]
    assert files["lamp-0.txt"].splitlines() == [
        "begin",
        "is_off(0)",
        "leaves(0, $5)",
        "press(0)",
        "is_on(1, 0)",
        "is_off(1)",
        "end",
    ]


def test_test_code_about_an_unknown_variable_is_refused() -> None:
    model = lamp_with_code()
    model["Lamp"]["On"].extra[0] = '<label kind="testcodeEnter">$(nothing)</label>'
    suite, harness = made(model)
    with pytest.raises(InputError, match=r"\$\(nothing\), which is no variable"):
        harness.files(suite.tests)


def test_a_model_without_test_code_has_none() -> None:
    assert not made(lamp())[1]


def test_a_template_makes_one_file_or_one_for_each_test() -> None:
    suite, harness = made(lamp_with_code())
    text = "{{ model }}: {{ tests | length }}"
    assert rendered(suite, harness, text, "t", "a.txt") == {"a.txt": "lamp.xml: 2"}
    text = "{{ test.name }} {{ test.duration | number }} {{ test.codes | first }}"
    assert rendered(suite, harness, text, "t", "{}.txt") == {
        "test_0.txt": "test_0 20 is_off(0)",
        "test_1.txt": f"test_1 {number(suite.tests[1].duration)} is_off(0)",
    }


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("{% for %}", "t.jinja:1: "),
        ("{{ nothing }}", "'nothing' is undefined"),
        ("{{ tests[0].nothing }}", "has no attribute 'nothing'"),
        ("{{ 1 / 0 }}", "division"),
        ("{{ ''.__class__.__mro__ }}", "unsafe"),
        ("{% include 'other' %}", "no loader"),
    ],
)
def test_a_wrong_template_is_refused(text: str, message: str) -> None:
    suite, harness = made(lamp())
    with pytest.raises(InputError, match=r"^t\.jinja") as refused:
        rendered(suite, harness, text, "t.jinja", "a.txt")
    assert message in str(refused.value)


def test_filters() -> None:
    from fractions import Fraction

    assert [number(Fraction(1, 3)), number(Fraction(5, 4)), number(7)] == ["1/3", "1.25", "7"]
    assert [identifier("A: b -> c"), identifier("3 x"), identifier("?")] == ["A_b_c", "_3_x", "_"]
    assert python({"x": Fraction(1, 2)}) == "{'x': Fraction(1, 2)}"


def outcomes(text: str) -> list[bool]:
    """Runs the generated tests; whether each passes."""
    names: dict[str, Any] = {}
    exec(compile(text, "test_vending.py", "exec"), names)
    found = []
    for name, test in names.items():
        if name.startswith("test_"):
            try:
                test()
                found.append(True)
            except AssertionError:
                found.append(False)
    return found


def test_the_example_passes_on_the_right_machine_and_finds_all_faults(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    template = str(EXAMPLES / "test_vending.py.jinja")
    options = ["--template", template, "--folder", str(tmp_path)]
    assert main(["test", str(EXAMPLES / "vending.xml"), *options]) == 0
    text = (tmp_path / "test_vending.py").read_text()
    monkeypatch.syspath_prepend(str(EXAMPLES))
    right = outcomes(text)
    assert right
    assert all(right)
    from vending import FAULTS  # type: ignore[import-not-found]

    assert len(FAULTS) >= 3
    for fault in FAULTS:
        monkeypatch.setenv("VENDING_FAULT", fault)
        assert not all(outcomes(text)), fault


def test_the_command_writes_test_code_and_suite(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "lamp.xml"
    lamp_with_code().write(model)
    out = tmp_path / "out"
    arguments = ["test", str(model), "--cover", "edges", "-o", str(tmp_path / "s.json")]
    assert main([*arguments, "--folder", str(out)]) == 0
    shown = capsys.readouterr()
    assert "edges: 4 of 5 covered" in shown.out
    assert "unreachable: Lamp: On -> Broken (all " in shown.out
    assert sorted(path.name for path in out.iterdir()) == ["lamp-0.txt", "lamp-1.txt"]
    assert (tmp_path / "s.json").read_text().startswith('{"format": "ntagen-suite"')


def test_a_limit_is_an_exit_code(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = tmp_path / "lamp.xml"
    lamp(9_000).write(model)
    assert main(["test", str(model), "--states", "2"]) == 3
    assert "unknown: " in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--template", "plain.txt"], "does not end in .jinja"),
        (["--template", "plain.txt", "--name", "../a"], "no plain name of a file"),
        (["--template", "missing.jinja"], "missing.jinja"),
        (["--cover", "states"], "'states' is not one of"),
    ],
)
def test_wrong_options_are_refused(
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    arguments: list[str],
    message: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    lamp().write("lamp.xml")
    Path("plain.txt").write_text("x")
    assert main(["test", "lamp.xml", *arguments]) == 2
    assert message in capsys.readouterr().err


def test_a_model_cannot_write_elsewhere(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    model = lamp_with_code()
    model.system = model.system.replace("lamp-", "../lamp-")
    model.write(tmp_path / "lamp.xml")
    assert main(["test", str(tmp_path / "lamp.xml"), "--folder", str(tmp_path / "a")]) == 2
    assert "no plain name of a file" in capsys.readouterr().err
    assert not list(tmp_path.glob("lamp-*"))


def test_a_model_without_xml_is_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "lamp.xta"
    path.write_text("process T() { state A; init A; } system T;")
    assert load(path.read_text())
    assert main(["test", str(path)]) == 2
    assert "ntagen convert" in capsys.readouterr().err
