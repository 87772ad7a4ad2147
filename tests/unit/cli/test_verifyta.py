"""`ntagen verifyta`: what scripts see of it, written down afresh from what is known of verifyta."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from ntagen.cli import main
from tests.oracles.xtr import read_compiled, read_trace

GATE = """
int[0,3] n;
process P() {
  clock x;
  state Shut { x <= 5 }, Open;
  init Shut;
  trans Shut -> Open { guard x > 3; assign x = 0, n = n + 1; };
}
system P;
"""
QUERIES = "// it opens\nE<> P.Open\n\nA[] n == 0\nA[] n <= 1\n"

HEADER = """Options for the verification:
  Generating {} trace
  Search order is {}
  Using conservative space optimisation
  Seed is 0
  State space representation uses minimal constraint systems with future testing
  Using HashMap + Compress integers for discrete state storage
"""

LAMP = Path(__file__).parents[2] / "corpus" / "games" / "smart_light.xta"


@pytest.fixture
def gate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with a model and queries, which is the current one."""
    (tmp_path / "gate.xta").write_text(GATE, "utf-8")
    (tmp_path / "gate.q").write_text(QUERIES, "utf-8")
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("UPPAAL_COMPILE_ONLY", raising=False)
    return tmp_path


@pytest.mark.usefixtures("gate")
def test_verdicts_with_marks_of_progress(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verifyta", "gate.xta", "gate.q"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert out == HEADER.format("no", "breadth first") + (
        "\x1b[2K\nVerifying formula 1 at gate.q:2\n\x1b[2K -- Formula is satisfied.\n"
        "\x1b[2K\nVerifying formula 2 at gate.q:4\n\x1b[2K -- Formula is NOT satisfied.\n"
        "\x1b[2K\nVerifying formula 3 at gate.q:5\n\x1b[2K -- Formula is satisfied.\n"
    )


@pytest.mark.usefixtures("gate")
def test_a_trace_goes_to_standard_error(capsys: pytest.CaptureFixture[str]) -> None:
    Path("one.q").write_text("A[] n == 0", "utf-8")
    assert main(["verifyta", "-t1", "-o", "1", "-s", "gate.xta", "one.q"]) == 0
    out, err = capsys.readouterr()
    assert out == HEADER.format("shortest", "depth first") + (
        "\nVerifying formula 1 at one.q:1\n -- Formula is NOT satisfied.\n"
        " -- Showing witness trace:\n"
    )
    assert (
        err
        == """
State:
( P.Shut )
n=0 P.x=0

Delay: 3.5

State:
( P.Shut )
n=0 P.x=3.5

Transition:
  P.Shut->P.Open { x > 3, tau, x := 0, n := n + 1 }

State:
( P.Open )
n=1 P.x=0
"""
    )


@pytest.mark.usefixtures("gate")
def test_a_symbolic_trace_has_the_constraints(capsys: pytest.CaptureFixture[str]) -> None:
    Path("one.q").write_text("E<> P.Open", "utf-8")
    assert main(["verifyta", "-t0", "-Y", "-sq", "gate.xta", "one.q"]) == 0
    assert (
        capsys.readouterr().err
        == """
State:
( P.Shut )
n=0 P.x <= 5

Transition:
  P.Shut->P.Open { x > 3, tau, x := 0, n := n + 1 }

State:
( P.Open )
n=1\n"""
    )


def test_traces_go_to_files_that_the_compiled_form_explains(
    gate: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(["verifyta", "-sq", "-t", "0", "gate.xta", "gate.q", "-f", "out", "-X", "out"]) == 0
    out, err = capsys.readouterr()
    assert err == ""
    assert sorted(path.name for path in gate.glob("out*")) == [
        "out-1",
        "out-2",
        "out1.xml",
        "out2.xml",
    ]
    assert out == (
        "\nVerifying formula 1 at gate.q:2\n -- Formula is satisfied.\n"
        " -- Writing witness trace to out-1\nXMLTrace outputted to: out1.xml\n"
        "\nVerifying formula 2 at gate.q:4\n -- Formula is NOT satisfied.\n"
        " -- Writing witness trace to out-2\nXMLTrace outputted to: out2.xml\n"
        "\nVerifying formula 3 at gate.q:5\n -- Formula is satisfied.\n"
    )
    monkeypatch.setenv("UPPAAL_COMPILE_ONLY", "1")
    assert main(["verifyta", "gate.xta", "-"]) == 0
    compiled = read_compiled(capsys.readouterr().out)
    trace = read_trace((gate / "out-2").read_text("ascii"), compiled)
    assert [state.locations["P"] for state in trace.states] == ["Shut", "Open"]
    assert trace.states[0].zone["P.x", "t(0)"] == (5.0, 0)


@pytest.mark.usefixtures("gate")
def test_an_empty_variable_means_a_normal_run(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("UPPAAL_COMPILE_ONLY", "")
    assert main(["verifyta", "gate.xta", "gate.q"]) == 0
    assert "Verifying formula 3" in capsys.readouterr().out


@pytest.mark.usefixtures("gate")
def test_the_summary_has_counts_time_and_memory(capsys: pytest.CaptureFixture[str]) -> None:
    Path("one.q").write_text("A[] n <= 1", "utf-8")
    assert main(["verifyta", "-squ", "gate.xta", "one.q"]) == 0
    lines = capsys.readouterr().out.splitlines()[3:]
    assert lines[:2] == [" -- States stored : 2 states", " -- States explored : 2 states"]
    assert re.fullmatch(r" -- CPU user time used : \d+ ms", lines[2])
    if Path("/proc/self/statm").exists():
        assert [re.sub(r"\d+", "N", line) for line in lines[3:]] == [
            " -- Virtual memory used : N KiB",
            " -- Resident memory used : N KiB",
        ]


@pytest.mark.usefixtures("gate")
def test_values_have_a_line_each(capsys: pytest.CaptureFixture[str]) -> None:
    Path("one.q").write_text("sup: n, P.x\n\ninf{P.Open}: n\n\nbounds: n\n", "utf-8")
    assert main(["verifyta", "-sq", "gate.xta", "one.q"]) == 0
    out = capsys.readouterr().out
    assert " -- Formula is satisfied.\n -- sup: n = 1\n -- sup: P.x = inf\n" in out
    assert " -- inf: n = 1\n" in out
    assert " -- bounds: n = [0, 1]\n" in out


def test_strategies_are_written_by_name(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    queries, folder = tmp_path / "lamp.q", tmp_path / "found"
    queries.write_text("strategy Light = control: A<> Lamp.Bright\n\nE<> Lamp.Bright under Light\n")
    words = ["-sq", "--generate-strategy", "2", "--print-strategies", str(folder)]
    assert main(["verifyta", *words, str(LAMP), str(queries)]) == 0
    out, err = capsys.readouterr()
    assert (out.count("Formula is satisfied"), err) == (2, "")
    assert [path.name for path in folder.iterdir()] == ["Light"]
    text = (folder / "Light").read_text("utf-8")
    assert "Strategy to win:" in text
    assert "take transition User.Idle->User.Idle { 1, touch!, 1 }" in text


def test_a_strategy_is_shown_where_a_trace_is_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    query = tmp_path / "lamp.q"
    query.write_text("control: A<> Lamp.Bright", "utf-8")
    assert main(["verifyta", "-sq", "-t0", str(LAMP), str(query)]) == 0
    assert "Strategy to win:" in capsys.readouterr().out
    assert main(["verifyta", "-sq", str(LAMP), str(query)]) == 0
    assert capsys.readouterr().out.splitlines()[2:] == [" -- Formula is satisfied."]


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "verifyta: [error] no MODEL; usage: verifyta [OPTION]... MODEL [QUERY]."),
        (["no.xml"], "no.xml: [error] no such file or directory."),
        (["gate.xta", "no.q"], "no.q: [error] no such file or directory."),
        (["gate.xta"], "gate.xta: [error] there are no queries; give a file of queries after"),
        (["gate.xta", "wrong.q"], "wrong.q:1: [error] syntax error: "),
        (
            ["-X", "o", "-t0", "o1.xml", "gate.q"],
            "o1.xml: [error] the trace o1.xml would replace the",
        ),
        (["--nope", "gate.xta"], "verifyta: [error] unknown option --nope; -h lists the options."),
        (["-D", "0", "gate.xta"], "verifyta: [error] --discretization is '0', but must be a"),
        (["fails.xta", "fails.q"], "fails.xta:2: [error] value out of range: n + 1."),
        (["gate.xta", "smc.q"], "smc.q:1: [error] "),
    ],
)
def test_a_mistake_is_one_line_and_exit_code_1(
    words: list[str], message: str, gate: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (gate / "o1.xml").write_text(GATE, "utf-8")
    (gate / "wrong.q").write_text("E<> P.Open &&", "utf-8")
    (gate / "smc.q").write_text("acontrol: A[] true { P.location }", "utf-8")
    (gate / "fails.xta").write_text(
        "int[0,1] n;\nprocess P() { state A; init A; trans A -> A { assign n = n + 1; }; }\n"
        "system P;",
        "utf-8",
    )
    (gate / "fails.q").write_text("A[] n <= 1\n\nA[] true\n", "utf-8")
    assert main(["verifyta", *words]) == 1
    out, err = capsys.readouterr()
    assert err.startswith(message), err
    assert err.count("\n") == 1
    assert "formula 2" not in out or "gate.q" in words


@pytest.mark.usefixtures("gate")
def test_the_queries_after_a_wrong_one_are_answered(capsys: pytest.CaptureFixture[str]) -> None:
    Path("mixed.q").write_text("E<> P.Nowhere\n\nE<> P.Open\n", "utf-8")
    assert main(["verifyta", "-sq", "gate.xta", "mixed.q"]) == 1
    out, err = capsys.readouterr()
    assert err == "mixed.q:1: [error] the process has no location or variable 'Nowhere'.\n"
    assert out.endswith("\nVerifying formula 2 at mixed.q:3\n -- Formula is satisfied.\n")


def test_the_version_satisfies_clients_and_is_honest(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verifyta", "-v"]) == 0
    words = capsys.readouterr().out.split(" ")
    assert words[0] == "ntagen"
    assert words[words.index("UPPAAL") + 1] == "5.0.0"


def test_the_program_of_the_package_is_the_command() -> None:
    script = "import sys; from ntagen.cli import verifyta; sys.exit(verifyta())"
    run = subprocess.run(
        [sys.executable, "-c", script, "--version"], capture_output=True, text=True, check=True
    )
    assert run.stdout.startswith("ntagen ")
    assert 'verifyta-ntagen = "ntagen.cli:verifyta"' in (
        Path(__file__).parents[3] / "pyproject.toml"
    ).read_text("utf-8")


@pytest.mark.usefixtures("gate")
def test_licences_are_not_needed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["verifyta", "--lease-request"]) == 0
    assert capsys.readouterr().out == "ntagen needs no licence\n"
    assert main(["verifyta", "--key", "K", "--lease", "1", "gate.xta", "gate.q"]) == 0


def test_check_writes_the_same_traces(gate: Path) -> None:
    assert main(["verifyta", "-t0", "-f", "v", "-X", "v", "gate.xta", "gate.q"]) == 0
    for name, same in (("c.xtr", "v-1"), ("c.xml", "v1.xml")):
        assert main(["check", "gate.xta", "--query", "E<> P.Open", "--trace", name]) == 0
        assert (gate / name).read_bytes() == (gate / same).read_bytes()
