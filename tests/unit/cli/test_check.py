"""`ntagen check`: verdicts, JSON, evidence, exit codes, and what it says of bad input."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

import ntagen
from ntagen.cli import main
from ntagen.drive.records import Synthesised
from ntagen.drive.story import tell
from ntagen.nsl import load
from ntagen.plan.synthesise import EngineSynthesiser
from ntagen.plot.run import picture_of_plans

PAPER = Path(__file__).resolve().parents[3] / "examples" / "paper.nsl"

GATE = """
chan go;
process Driver() { state Here, There; init Here; trans Here -> There { sync go!; }; }
process Gate() {
  clock x;
  int[0,2] n;
  state Closed, Open { x <= 5 };
  init Closed;
  trans Closed -> Open { sync go?; assign x = 0; },
        Open -> Closed { guard x >= 2; assign n = n + 1; };
}
system Driver, Gate;
"""

RECORD = {
    "query",
    "name",
    "verdict",
    "value",
    "message",
    "wrapped",
    "stop",
    "explored",
    "stored",
    "seconds",
    "load_seconds",
    "peak_bytes",
    "plans",
}


@pytest.fixture
def gate(tmp_path: Path) -> Path:
    path = tmp_path / "gate.xta"
    path.write_text(GATE)
    return path


def check_run(
    capsys: pytest.CaptureFixture[str], code: int, *arguments: str | Path
) -> tuple[str, str]:
    """The command ends with the exit code and never with a stack trace; its two outputs."""
    assert main(["check", *(str(argument) for argument in arguments)]) == code
    captured = capsys.readouterr()
    assert "Traceback" not in captured.out + captured.err
    return captured.out, captured.err


def test_satisfied_and_not_satisfied_queries(
    gate: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, _ = check_run(capsys, 0, gate, "--query", "E<> Gate.Open")
    assert "yes" in out
    out, _ = check_run(capsys, 1, gate, "--query", "E<> Gate.n > 1", "--query", "E<> Gate.Open")
    assert "no " in out


def test_mistakes_in_a_file_of_queries_are_shown_at_their_places(
    gate: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "gate.q"
    file.write_text(
        "// the first\nE<> Gate.Open\n\n  E<> Gate.Opn\n"
        "E<> Gate.Open /* twice */ && \\\n   Gate.Shut\n"
        'strategy S = loadStrategy("none.json")\n'
        "E<> 5 / (Gate.n - Gate.n) == 1\n"
    )
    out, err = check_run(capsys, 2, gate, file)
    assert f"{file}:4:12: error" in err
    assert "  |   E<> Gate.Opn\n  |            ^" in err
    assert f"{file}:6:9: error" in err
    assert f"{file}:7:1: error[E0805]" in err
    assert f"division by zero, at {file}:8:5: " in out
    _, err = check_run(capsys, 2, gate, "--query", "E<> Gate.Opn")
    assert err.startswith("query:1:10: error")
    assert "  in " not in err


def test_json_has_the_promised_fields_and_nothing_else_is_printed(
    gate: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    queries = ["--query", "E<> Gate.Open", "--query", "A[] Gate.Closed"]
    out, _ = check_run(capsys, 1, gate, "--json", *queries)
    records = [json.loads(line) for line in out.splitlines()]
    assert [set(record) for record in records] == [RECORD, RECORD]
    assert [record["verdict"] for record in records] == ["satisfied", "not satisfied"]


def test_queries_of_a_file_and_their_names(
    gate: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "gate.q"
    file.write_text("// opens\nE<> Gate.Open\n\nA[] \\\nGate.Closed\n")
    out, _ = check_run(capsys, 1, gate, "--queries", file, "--json")
    assert [json.loads(line)["query"] for line in out.splitlines()] == [
        "E<> Gate.Open",
        "A[] Gate.Closed",
    ]
    assert check_run(capsys, 1, gate, file, "--json")[0].count("\n") == 2
    _, err = check_run(capsys, 2, gate, file, "--queries", file)
    assert "two files of queries" in err


@pytest.mark.parametrize("more", [[], ["ReachFinalTR"]])
def test_the_strategy_that_a_query_is_asked_under_is_made_before(
    more: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    chance = str(PAPER.parent / "chance" / "chance.nsl")
    asked = [part for name in ["ReachProbability", *more] for part in ("--query", name)]
    assert main(["check", chance, *asked, "--json", "--runs", "50"]) == 0
    answers = [json.loads(line) for line in capsys.readouterr().out.splitlines()]
    assert [answer["name"] for answer in answers] == ["ReachFinalTR", "ReachProbability"]


def test_a_limit_is_an_answer(gate: Path, capsys: pytest.CaptureFixture[str]) -> None:
    loop = "--query", "E<> Checker.UR_Reached && Checker.Path_Invalid"
    out, _ = check_run(capsys, 3, PAPER, *loop, "--states", "50", "--json")
    record = json.loads(out)
    assert (record["verdict"], record["stop"]) == ("unknown", "states")
    out, _ = check_run(capsys, 3, PAPER, *loop, "--timeout", "1ms", "--json")
    assert json.loads(out)["stop"] == "time"
    out, _ = check_run(capsys, 3, PAPER, *loop, "--memory", "100kB", "--json")
    assert json.loads(out)["stop"] == "memory"


def test_a_run_time_error_is_no_verdict(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "overflow.xta"
    path.write_text(
        "int[0,3] i = 3;\nprocess P() { state A, B; init A; trans A -> B { assign i++; }; }\n"
        "system P;\n"
    )
    out, _ = check_run(capsys, 4, path, "--query", "E<> P.B", "--json")
    record = json.loads(out)
    assert record["verdict"] == "error"
    assert "out of range" in record["message"]
    assert "overflow.xta:2" in record["message"]


def test_traces_and_strategies_and_plans_are_written(
    gate: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out, _ = check_run(capsys, 0, gate, "--query", "E<> Gate.Open", "--trace", "-")
    assert "Driver.Here -> There go!" in out
    files = {name: tmp_path / f"{name}.json" for name in ("trace", "strategy", "plans")}
    options = [word for name, path in files.items() for word in (f"--{name}", str(path))]
    check_run(capsys, 0, gate, "--query", "E<> Gate.Open", *options)
    check_run(capsys, 0, gate, "--query", "control: A<> Gate.Open", *options)
    documents = {name: json.loads(path.read_text()) for name, path in files.items()}
    assert len(documents["trace"]["states"]) == 2
    assert documents["plans"]["count"] == 1
    decisions = documents["strategy"]["states"][0]["decisions"]
    assert decisions[0]["action"][0]["sync"] == "go!"


def test_strategies_are_written_as_text(
    gate: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    query = "control: A<> Gate.Open"
    out, _ = check_run(capsys, 0, gate, "--query", query, "--strategy", "-")
    assert "\nStrategy to win:\n\nState: ( Driver.Here Gate.Closed ) Gate.n=0\nWhen" in out
    assert "take transition Driver.Here->Driver.There { 1, go!, 1 } Gate.Closed->Gate.Open" in out
    path = tmp_path / "strategy.txt"
    check_run(capsys, 0, gate, "--query", query, "--strategy", path)
    text = path.read_text()
    assert text.startswith(f"{query}\n\nInitial state:\n")
    assert text.partition("\n\n")[2] in out
    _, err = check_run(capsys, 2, gate, "--query", query, "--strategy", "-", "--json")
    assert "standard output" in err


def test_strategy_is_written_as_a_controller(
    gate: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "controller.c"
    query = ("--query", "control: A<> Gate.Open", "--strategy", path)
    out, _ = check_run(capsys, 0, gate, *query)
    assert f"controller written to {path}" in out
    assert "control: A<> Gate.Open" in path.read_text()
    assert "\ncontroller_decision controller_decide(" in path.read_text()
    gate.write_text(GATE.replace("x <= 5", "x <= 5 && x' == 0"))
    _, err = check_run(capsys, 2, gate, *query)
    assert "stopwatches" in err


def test_a_single_plan_is_found_without_the_others(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ("--query", "ReachFinalTR", "--plans", tmp_path / "plans.json", "--json")
    everything, _ = check_run(capsys, 0, PAPER, *options)
    first, _ = check_run(capsys, 0, PAPER, *options, "--set", "max plans 1")
    assert json.loads(first)["plans"] == 1
    assert json.loads(first)["stored"] * 10 < json.loads(everything)["stored"]


def test_a_single_plan_leaves_open_whether_there_are_more(
    gate: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "plans.json"
    query = ("--query", "control: A<> Gate.Open", "--plans", path)
    check_run(capsys, 0, gate, *query)
    assert json.loads(path.read_text())["complete"] is True
    check_run(capsys, 0, gate, *query, "--set", "max plans 1")
    assert json.loads(path.read_text())["complete"] is False
    for wrong in ("0", "last"):
        _, err = check_run(capsys, 2, gate, *query, "--set", f"max plans {wrong}")
        assert "max plans" in err


def test_plans_of_an_environment_are_ranked_and_certified(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "plans.json"
    out, _ = check_run(capsys, 0, PAPER, "--query", "ReachFinalTR", "--plans", path)
    document = json.loads(path.read_text())
    plans = document["plans"]
    assert len(plans) == 129
    assert "129 plans found, 101 hold in exact kinematics" in out
    assert "best first: by clearance (up to 5 mm counts), then rolls, then length" in out
    assert plans[0]["certificate"]
    assert sum(plan["holds"] for plan in plans) == 101
    assert document["margins"]["depth_mm"] == 0.3


def test_plans_on_the_terminal_are_marked(capsys: pytest.CaptureFixture[str]) -> None:
    out, _ = check_run(capsys, 0, PAPER, "--query", "ReachFinalTR", "--plans", "-")
    lines = [line.split() for line in out.splitlines() if line.strip()[:1].isdigit()]
    verdicts = [line[1] for line in lines if line[0].endswith(".")]
    assert (verdicts.count("holds"), verdicts.count("fails")) == (101, 28)
    _, err = check_run(capsys, 2, PAPER, "--plans", "-", "--json")
    assert "give --plans a FILE" in err


def test_check_plot_and_drive_count_plans_in_the_same_words(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    count = "129 plans found, 101 hold in exact kinematics"
    picture = picture_of_plans(load(PAPER), EngineSynthesiser()(load(PAPER)), 1)
    assert picture.caption.startswith(count)
    record = Synthesised(1.0, 1, 0.0, 129, 101, "push 1 mm", 1.0, "")
    assert count in (tell(record) or "")
    out, _ = check_run(capsys, 0, PAPER, "--plans", tmp_path / "plans.json")
    assert count in out


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"", "empty"),
        (b"\x00\x01\x02\xff\xfe binary", "error"),
        (b"<html><body>no model</body></html>", "error"),
        (b"<nta><template>", "error"),
        (b"process P( {", "error"),
    ],
    ids=["empty", "binary", "other XML", "broken XML", "broken XTA"],
)
def test_files_that_are_no_model_are_rejected(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], content: bytes, said: str
) -> None:
    path = tmp_path / "model.xml"
    path.write_bytes(content)
    _, err = check_run(capsys, 2, path, "--query", "E<> true")
    assert said in err
    assert "model.xml" in err


def test_missing_files_and_folders_are_named(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for path in (tmp_path / "none.xml", tmp_path / "none.nsl", tmp_path):
        _, err = check_run(capsys, 2, path)
        assert str(path) in err


@pytest.mark.parametrize(
    "arguments",
    [
        ("--query", "Nonsense"),
        ("--query", "E<> Gate.Nowhere"),
        ("--query", "E<> Gate.Open +"),
        ("--query", ""),
        ("--queries", "none.q"),
        ("--memory", "4 parsecs"),
        ("--memory", "4"),
        ("--states", "0"),
        ("--states", "1.5"),
        ("--states", "many"),
        ("--timeout", "soon"),
        ("--engine", "steam"),
        (),
    ],
)
def test_wrong_queries_and_options_are_rejected(
    gate: Path, capsys: pytest.CaptureFixture[str], arguments: tuple[str, ...]
) -> None:
    _, err = check_run(capsys, 2, gate, *arguments)
    assert err


def test_an_output_that_cannot_be_written_is_said(
    gate: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ("--query", "E<> Gate.Open", "--trace", tmp_path)
    _, err = check_run(capsys, 2, gate, *options)
    assert str(tmp_path) in err


@pytest.mark.parametrize("engine", ["jit", "interpreter"])
@pytest.mark.parametrize("search", ["bfs", "dfs", "random"])
def test_answers_do_not_depend_on_engine_and_order(
    gate: Path, capsys: pytest.CaptureFixture[str], engine: str, search: str
) -> None:
    options = ("--engine", engine, "--search", search, "--json")
    out, _ = check_run(capsys, 1, gate, "--query", "A[] Gate.x < 7", *options)
    assert json.loads(out)["verdict"] == "not satisfied"


@pytest.mark.parametrize("threads", ["1", "3", "all", "0"])
def test_answers_do_not_depend_on_the_number_of_threads(
    gate: Path, capsys: pytest.CaptureFixture[str], threads: str
) -> None:
    options = ("--threads", threads, "--json")
    out, _ = check_run(capsys, 1, gate, "--query", "A[] Gate.x < 7", *options)
    assert json.loads(out)["verdict"] == "not satisfied"


@pytest.mark.parametrize("threads", ["-1", "2049", "many", "1.5", ""])
def test_a_wrong_number_of_threads_is_refused(
    gate: Path, capsys: pytest.CaptureFixture[str], threads: str
) -> None:
    _, err = check_run(capsys, 2, gate, "--query", "A[] Gate.x < 7", "--threads", threads)
    message = f"{threads!r} is not a number of threads; write 1 to 2048, or all"
    assert message in " ".join(err.split())


TAKING_TURNS = """
typedef scalar[4] member;
member last;
process P(const member me) {
  state Idle, Done;
  init Idle;
  trans Idle -> Done { assign last = me; };
}
system P;
"""


@pytest.mark.parametrize(
    ("reductions", "stored"), [("all", 5), ("symmetry", 5), ("partial-order,live-variables", 33)]
)
def test_members_of_scalar_sets_are_told_apart_only_if_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], reductions: str, stored: int
) -> None:
    model = tmp_path / "turns.xta"
    model.write_text(TAKING_TURNS)
    options = ("--reductions", reductions, "--json")
    query = "E<> forall (i : member) P(i).Idle && last == i"
    out, _ = check_run(capsys, 1, model, "--query", query, *options)
    answer = json.loads(out)
    assert (answer["verdict"], answer["stored"]) == ("not satisfied", stored)


def test_an_unknown_reduction_is_refused_with_the_known_ones(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "turns.xta"
    model.write_text(TAKING_TURNS)
    _, err = check_run(capsys, 2, model, "--reductions", "symmetry,orbits")
    assert "'orbits' is not a reduction" in err
    assert "symmetry, partial-order and live-variables" in err
    with pytest.raises(ValueError, match="unknown reduction: orbits"):
        ntagen.load(TAKING_TURNS).check("E<> false", reductions="orbits")


LOOP = """
int[0,2] n; clock x;
process P() {
  state A { x <= 9 }, B { x <= 9 }, Done;
  init A;
  trans A -> A { guard x >= 2 && n < 2; assign x = 0, n++; }, A -> B { guard n == 0; },
        B -> B { assign x = 0, n = 2; }, A -> Done { };
}
system P;
"""


@pytest.mark.parametrize(
    ("query", "wanted", "moves"),
    [
        ("E[] !P.Done", "shortest", 3),
        ("sup{!P.Done}: n", "shortest", 2),
        ("sup{P.Done}: n", "shortest", 3),
        ("sup{!P.Done}: n", "fastest", 2),
        ("sup{P.Done}: n", "fastest", 3),
    ],
)
def test_shortest_and_fastest_traces_of_values_and_of_runs_without_end(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], query: str, wanted: str, moves: int
) -> None:
    model, trace = tmp_path / "loop.xta", tmp_path / "trace.json"
    model.write_text(LOOP)
    options = ("--set", f"trace {wanted}", "--trace", trace, "--json")
    out, _ = check_run(capsys, 0, model, "--query", query, *options)
    assert json.loads(out)["message"] is None
    document = json.loads(trace.read_text())
    (only,) = document.get("traces", [document])
    assert len(only["run"]["steps"]) == moves


def test_runs_without_end_take_no_least_time(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    model = tmp_path / "loop.xta"
    model.write_text(LOOP)
    out, _ = check_run(
        capsys, 0, model, "--query", "E[] !P.Done", "--set", "trace fastest", "--json"
    )
    assert "a run that never ends takes no least time" in json.loads(out)["message"]


SIDE_BY_SIDE = """
process P() {
  state First, Second, Done;
  urgent First, Second;
  init First;
  trans First -> Second { }, Second -> Done { };
}
A = P(); B = P(); C = P();
system A, B, C;
"""


@pytest.mark.parametrize(("reductions", "stored"), [("all", 7), ("none", 27)])
def test_independent_urgent_moves_are_interleaved_only_if_asked(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], reductions: str, stored: int
) -> None:
    model = tmp_path / "side_by_side.xta"
    model.write_text(SIDE_BY_SIDE)
    options = ("--reductions", reductions, "--json")
    out, _ = check_run(capsys, 1, model, "--query", "E<> false", *options)
    answer = json.loads(out)
    assert (answer["verdict"], answer["stored"]) == ("not satisfied", stored)


FAILING = """
int[0,3] n; int a[3];
process P() {
  clock x;
  state A { x <= 2 }, B, C;
  init A;
  trans A -> A { guard x >= 2; assign x = 0, n = n + 1; },
        A -u-> B { guard n == 2; assign a[n] = 1 / (n - 2); },
        B -> C { };
}
system P;
"""

SYMBOLIC = ["E<> P.C", "A[] not P.C", "E[] n < 3", "A<> P.C", "P.A --> P.C", "sup: n"]
GAMES = ["control: A<> P.C", "control: A[ n < 3 U P.C ]", "control: A[] n < 3"]


@pytest.fixture
def failing(tmp_path: Path) -> Path:
    path = tmp_path / "failing.xta"
    path.write_text(FAILING)
    return path


WRAPPING = """\
int32_t used = -1;
bool fits() { return 5 <= INT32_MAX - used; }
process P() {
    state A, B, C;
    init A;
    trans A -> B { guard fits(); }, A -> C { guard !fits(); };
}
system P;
"""


@pytest.mark.parametrize("engine", ["jit", "interpreter"])
def test_arithmetic_wraps_round_and_the_answer_says_where(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, engine: str
) -> None:
    path = tmp_path / "wrapping.xta"
    path.write_text(WRAPPING)
    place = {"place": f"{path}:2:27", "text": "INT32_MAX - used"}
    for query, code in [("E<> P.B", 1), ("E<> P.C", 0), ("control: A<> P.C", 0)]:
        common = (path, "--query", query, "--engine", engine)
        out, _ = check_run(capsys, code, *common, "--json")
        assert json.loads(out)["wrapped"] == place
        out, _ = check_run(capsys, code, *common)
        assert f"wraps round, first at {path}:2:27: INT32_MAX - used" in out
        out, _ = check_run(capsys, 4, *common, "--overflow", "error")
        assert f"does not fit into 32 bits, at {path}:2:27: INT32_MAX - used" in out
        assert "wraps round" not in out
    path.write_text(WRAPPING.replace("used = -1", "used = 0"))
    out, _ = check_run(capsys, 0, path, "--query", "E<> P.B", "--engine", engine, "--json")
    assert json.loads(out)["wrapped"] is None


def test_a_constant_that_wraps_round_is_an_error_for_every_query_if_overflow_is_one(
    capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    path = tmp_path / "constant.xta"
    path.write_text("const int c = INT32_MAX + 1;\nprocess P() { state A; init A; }\nsystem P;\n")
    query = f"E<> c == {-(2**31)}"
    out, err = check_run(capsys, 0, path, "--query", query)
    assert "W0212" in err
    assert f"wraps round, first at {path}:1:15: INT32_MAX + 1" in out
    out, _ = check_run(capsys, 4, path, "--query", query, "--overflow", "error")
    assert f"does not fit into 32 bits, at {path}:1:15: INT32_MAX + 1" in out


def test_what_happens_at_overflows_holds_for_all_that_a_model_is_asked(tmp_path: Path) -> None:
    path = tmp_path / "wrapping.xta"
    path.write_text(WRAPPING)
    model = ntagen.load(path, overflow="error")
    assert model.overflow == "error"
    assert model.check("E<> P.C").verdict == "error"
    with pytest.raises(ntagen.ModelError, match="does not fit into 32 bits"):
        model.simulate(steps=1)
    model.overflow = "wrap"
    answer = model.check("E<> P.C")
    assert (answer.verdict, str(answer.wrapped)) == (
        "satisfied",
        f"{path}:2:27: INT32_MAX - used",
    )
    assert model.simulate(steps=1).states[-1].locations == {"P": "C"}
    model.overflow = "error"
    with pytest.raises(ntagen.ModelError, match="does not fit into 32 bits"):
        list(model.states(limit=10))


@pytest.mark.parametrize("query", [*SYMBOLIC, *GAMES])
@pytest.mark.parametrize("engine", ["jit", "interpreter"])
def test_a_run_time_error_is_shown_with_the_way_to_it(
    capsys: pytest.CaptureFixture[str], failing: Path, query: str, engine: str
) -> None:
    out, _ = check_run(capsys, 4, failing, "--query", query, "--engine", engine)
    lines = [" ".join(line.split()) for line in out.splitlines()]
    column = FAILING.splitlines()[7].index("1 / (") + 1
    assert f"division by zero, at {failing}:8:{column}: 1 / (n - 2)" in lines
    assert "the way there, 2 steps (--trace - shows all steps):" in lines
    assert lines.count("1. P.A -> A { x >= 2; x = 0, n = n + 1 }") == 1
    assert lines[lines.index("in the state") + 1].startswith("P.A n=2 a[0]=0 a[1]=0 a[2]=0")
    assert lines[lines.index("in the step") + 1] == "P.A -> B { n == 2; a[n] = 1 / (n - 2) }"


@pytest.mark.parametrize("query", ["E<> a[n] == 7", "control: A<> a[n] == 7", "A<> a[n] == 7"])
def test_an_error_in_the_query_is_shown_with_the_way_to_it(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, query: str
) -> None:
    path = tmp_path / "failing.xta"
    path.write_text(FAILING.replace("1 / (n - 2)", "1"))
    out, _ = check_run(capsys, 4, path, "--query", query)
    lines = [" ".join(line.split()) for line in out.splitlines()]
    column = query.index("n]") + 1
    assert f"array index out of bounds, at query:1:{column}: n" in lines
    assert lines[lines.index("in the state") + 1].startswith("P.A n=3 ")
    assert "in the step" not in lines


def test_the_trace_to_an_error_is_written(
    capsys: pytest.CaptureFixture[str], failing: Path, tmp_path: Path
) -> None:
    target = tmp_path / "trace.json"
    query = "control: A<> P.C"
    out, _ = check_run(capsys, 4, failing, "--query", query, "--json", "--trace", target)
    assert set(json.loads(out)) == RECORD
    trace = json.loads(target.read_text())
    assert [state["variables"]["n"] for state in trace["states"]] == [0, 1, 2]
    assert len(trace["transitions"]) == 2
    assert [edge["update"] for edge in trace["failing"]] == ["a[n] = 1 / (n - 2)"]
    out, _ = check_run(capsys, 4, failing, "--query", query, "--trace", "-")
    assert "fails in the next step:\n              P.A -> B\n              n = 2" in out
    assert "the way there" not in out


@pytest.mark.parametrize("query", ["E<> P.B", "A[] not deadlock", "control: A<> P.B"])
@pytest.mark.parametrize(
    ("model", "place"),
    [
        ("urgent chan c[2];\nprocess P() {{ {} A -> B {{ sync c[k]!; }}; }}", "k"),
        ("int a[2];\nprocess P() {{ {} A -> B {{ guard a[k] == 0; }}; }}", "k"),
    ],
)
def test_an_error_in_the_initial_state_has_a_way_of_no_steps(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, query: str, model: str, place: str
) -> None:
    path = tmp_path / "failing.xta"
    path.write_text(f"int k = 2; {model.format('state A, B; init A; trans')}\nsystem P;\n")
    out, _ = check_run(capsys, 4, path, "--query", query, "--trace", tmp_path / "trace.json")
    column = path.read_text().splitlines()[1].index(f"[{place}]") + 2
    assert f"array index out of bounds, at {path}:2:{column}: {place}" in out
    out, _ = check_run(capsys, 4, path, "--query", query)
    lines = [" ".join(line.split()) for line in out.splitlines()]
    assert "the way there, 0 steps (--trace - shows all steps):" in lines
    assert "k=2" in lines[lines.index("in the state") + 1]
    trace = json.loads((tmp_path / "trace.json").read_text())
    assert [state["locations"] for state in trace["states"]] == [{"P": "A"}]
    with pytest.raises(ntagen.ModelError, match="array index out of bounds"):
        ntagen.load(path).simulate(steps=1)


def test_an_error_beyond_the_end_of_play_is_none(
    capsys: pytest.CaptureFixture[str], failing: Path
) -> None:
    check_run(capsys, 0, failing, "--query", "control: A<> n == 1")


GAME = """
process P() {
  clock x;
  state Here { x <= 3 }, There, Lost;
  init Here;
  trans Here -> There { guard x >= 1; }, Here -u-> Lost { guard x >= 2; };
}
system P;
"""


@pytest.mark.parametrize(
    ("query", "options", "said"),
    [
        (
            "{ P.Here, P.There } control: A<> P.There",
            ["--threads", "2"],
            "--threads has no effect here: games under partial observation",
        ),
        ("control: A<> P.There", ["--search", "dfs"], "--search has no effect here: games"),
        ("control: A<> P.There", ["--set", "trace shortest"], "--set 'trace …' has no effect here"),
        (
            "E<> P.There",
            ["--set", "trace shortest"],
            "--set 'trace …' has no effect without --trace",
        ),
        ("E<> P.There", ["--forced", "neutral"], "--forced has no effect here"),
        ("E<> P.There", ["--set", "priorities keep"], "--set 'priorities …' has no effect here"),
        ("E<> P.There", ["--seed", "3"], "--seed has no effect without --search random"),
        ("E<> P.There", ["--search", "dfs", "--threads", "2"], "--threads has no effect here"),
        ("E[] not P.Lost", ["--threads", "2"], "--threads has no effect here"),
        (
            "control: A<> P.There",
            ["--verify", "--reductions", "none"],
            "--reductions has no effect here: of the reductions games make live-variables only",
        ),
        (
            "control: A<> P.There",
            ["--set", "max plans 3"],
            "--set 'max plans …' has no effect without",
        ),
        (
            "control: A<> P.There",
            ["--set", "ranking rolls"],
            "--set 'ranking …' has no effect without --plans",
        ),
    ],
)
def test_options_without_an_effect_are_named(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, query: str, options: list[str], said: str
) -> None:
    path = tmp_path / "game.xta"
    path.write_text(GAME)
    _, err = check_run(capsys, 0, path, "--query", query, *options)
    assert f"note: {said}" in err
    _, err = check_run(capsys, 0, path, "--query", query)
    assert err == ""


@pytest.mark.parametrize(
    ("query", "option", "why"),
    [
        ("E<> P.There", "--strategy", "no answer has a strategy"),
        ("control: A<> P.There", "--trace", "no answer has a trace"),
        ("control: A<> P.There", "--certificate", "only an E<>"),
        ("E<> P.There", "--plans", "plans are listed for control: A<>"),
        ("control: A[] not P.Lost", "--plans", "plans are listed for control: A<>"),
    ],
)
def test_files_that_are_not_written_are_named(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, query: str, option: str, why: str
) -> None:
    path = tmp_path / "game.xta"
    path.write_text(GAME)
    target = tmp_path / "target.json"
    _, err = check_run(capsys, 0, path, "--query", query, option, target)
    assert f"note: {option}: nothing was written: {why}" in err
    assert not target.exists()
    target.write_text("old")
    _, err = check_run(capsys, 0, path, "--query", query, option, target)
    assert f"nothing was written, {target} is unchanged" in err


@pytest.mark.parametrize(
    "query",
    [
        "control: A[] not P.Lost",
        "control: A[] (not P.Lost && A<> P.There)",
        "control_t*: A<> P.There",
        "E<> control: A<> P.There",
        "control: A<> P.There under Safe",
    ],
)
def test_games_without_plans_say_so(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, query: str
) -> None:
    path = tmp_path / "game.xta"
    path.write_text(GAME)
    safe = ["--query", "strategy Safe = control: A[] not P.Lost"] if "under" in query else []
    plans = tmp_path / "plans.json"
    out, _ = check_run(capsys, 0, path, *safe, "--query", query, "--json", "--plans", plans)
    assert "not under a strategy" in json.loads(out.splitlines()[-1])["message"]


def test_queries_beside_a_rejected_one_are_answered(
    gate: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    asked = ("--query", "E<> Gate.Open", "--query", "acontrol: A[] true { Gate.x[0,9]:9 }")
    asked += ("--query", "A[] Gate.Closed")
    out, err = check_run(capsys, 2, gate, *asked, "--json")
    verdicts = [json.loads(line)["verdict"] for line in out.splitlines()]
    assert verdicts == ["satisfied", "refused", "not satisfied"]
    refused = json.loads(out.splitlines()[1])
    assert refused["place"] == "query:1:1"
    assert refused["message"].startswith("query:1:1: error[E0277]: ")
    assert err.count("error[E0277]") == 1
    out, err = check_run(capsys, 2, gate, *asked)
    rows = [
        line.split()[0] for line in out.splitlines() if line.startswith("  ") and line[2:3] != " "
    ]
    assert rows == ["yes", "refused", "no"]
    assert out.endswith("3 queries: 1 satisfied, 1 not satisfied, 1 refused\n")
    assert err.rstrip().endswith("ntagen explain E0277")


@pytest.mark.parametrize(
    ("query", "meant"),
    [
        ("EF Gate.Open", "E<> Gate.Open"),
        ("AG(Gate.x < 7 && true)", "A[] (Gate.x < 7 && true)"),
        ("AF Gate.Open", "A<> Gate.Open"),
        ("EG  not   Gate.Open", "E[] not Gate.Open"),
        ("<>Gate.Open under S", "E<> Gate.Open"),
        ("[] not deadlock", "A[] not deadlock"),
        ("<>", "E<> p"),
    ],
)
def test_path_quantifiers_of_other_notations_get_that_of_uppaal(
    gate: Path, capsys: pytest.CaptureFixture[str], query: str, meant: str
) -> None:
    _, err = check_run(capsys, 2, gate, "--query", query)
    assert f"  hint: did you mean `{meant}`?\n" in err
