"""The command line of verifyta: forms of options, and what is refused."""

from __future__ import annotations

import pytest

from ntagen.errors import InputError
from ntagen.verifyta.options import OPTIONS, idle_in_learning, of_model, parse, statistical
from ntagen.verifyta.output import help_text


@pytest.mark.parametrize(
    "words",
    [
        ["-t0", "-s", "-u", "m.xml", "q.q"],
        ["m.xml", "q.q", "-t", "0", "-us"],
        ["m.xml", "--diagnostic", "0", "q.q", "-sut0"],
        ["--diagnostic=0", "m.xml", "--silence-progress", "--summary", "--", "q.q"],
        ["--diag", "0", "--silence", "m.xml", "q.q", "--summ"],
    ],
)
def test_all_forms_of_options_mean_the_same(words: list[str]) -> None:
    line = parse(words)
    assert line.files == ("m.xml", "q.q")
    assert line.given == {"--diagnostic": "0", "--silence-progress": "", "--summary": ""}


def test_words_that_clients_pass_are_accepted() -> None:
    line = parse(
        ["-s", "-u", "--generate-strategy", "2", "--print-strategies", "out", "m.xml", "q.q"]
    )
    assert line.value("--print-strategies") == "out"
    for words in (
        "-S1 -b -u m.xml",
        "-t0 -T m.xml",
        "m.xml -f x_xtr -t 1 -o 0",
        "-C -H 27 -n4 -squ",
    ):
        parse(words.split())
    assert parse(["-r", "7", "m.xml"]).value("--seed") == "7"
    assert parse(["m.xml", "-"]).files == ("m.xml", "-")


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--nonsense"], "unknown option --nonsense; -h lists the options"),
        (["-sxu"], "unknown option -x in -sxu; -h lists the options"),
        (["-J"], "unknown option -J; -h lists the options"),
        (["m.xml", "-t"], "--diagnostic needs a value: --diagnostic 0|1|2"),
        (["-t7", "m.xml"], "--diagnostic is '7', but must be 0, 1 or 2"),
        (["-O", "json"], "-O is 'json', but must be std"),
        (["--seed", "soon"], "--seed is 'soon', but must be an integer"),
        (["--summary=2"], "--summary has no value, but '2' is given"),
        (["--di", "0"], "the option --di is ambiguous: --diagnostic, --discretization, --discount"),
        (["-f", ""], "-f needs a value: -f PREFIX"),
    ],
)
def test_a_wrong_option_is_named(words: list[str], message: str) -> None:
    with pytest.raises(InputError) as caught:
        parse(words)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    "words",
    [["-A"], ["-Z"], ["-sZ"]],
)
def test_what_would_change_a_verdict_is_not_supported(words: list[str]) -> None:
    with pytest.raises(InputError, match="is not supported: "):
        parse([*words, "m.xml"])


def test_the_help_lists_every_option_and_has_the_lines_that_clients_look_for() -> None:
    text = help_text()
    for option in OPTIONS:
        assert f"  {option.letter or option.long} " in text
        assert option.long in text
    assert "Usage: verifyta [OPTION]... MODEL QUERY" in text
    assert "-h [ --help ]" in text


def test_risks_of_statistical_queries_lie_between_0_and_1() -> None:
    assert parse(["-E", "0.1", "--alpha=0.01"]).value("--alpha") == "0.01"
    for words in (["-E", "0"], ["--alpha=1"], ["-B", "nan"], ["-E", "much"]):
        with pytest.raises(InputError, match="must be a number between 0 and 1"):
            parse(words)


def test_parameters_of_random_runs_become_options_of_queries() -> None:
    risks = ["-E", "0.1", "-a0.01", "-B", "0.2", "--delta", "0.02", "--u1", "2"]
    line = parse([*risks, "-r", "7", "-D", "0.5", "--runs", "9", "-s", "m.xml"])
    assert statistical(line.given) == {
        "epsilon": 0.1,
        "alpha": 0.01,
        "beta": 0.2,
        "seed": 7,
        "discretisation": 0.5,
        "delta": 0.02,
        "odds_ratios": (0.9, 2.0),
        "runs": 9,
    }
    assert statistical(parse(["-s", "m.xml"]).given) == {}
    for words in (["--runs", "0"], ["-D", "-1"], ["--u1", "0.5"], ["--u0", "2"]):
        with pytest.raises(InputError, match="must be a"):
            parse(words)


LEARNING = {
    "--learning-method": "4",
    "--good-runs": "500",
    "--eval-runs": "1",
    "--max-iterations": "30",
    "--reset-no-better": "15",
    "--max-reset-learning": "0",
    "--discount": "1",
    "--qlearning-alpha": "1.2e8",
}

FIELDS = {
    "learning_method": "q",
    "good_runs": 500,
    "eval_runs": 1,
    "max_iterations": 30,
    "reset_no_better": 15,
    "max_reset_learning": 0,
    "discount": 1.0,
    "qlearning_alpha": 1.2e8,
}


def test_options_of_learning_become_options_of_queries() -> None:
    words = [word for pair in LEARNING.items() for word in pair]
    assert statistical(parse(words).given) == FIELDS
    assert of_model(LEARNING) == FIELDS
    assert of_model(LEARNING, ["good_runs", "discount"]).keys() == FIELDS.keys() - {
        "good_runs",
        "discount",
    }
    for number, method in {"-1": "m", "3": "m", "4": "q", "5": "m"}.items():
        assert statistical({"--learning-method": number}) == {"learning_method": method}
    assert of_model({"--discount": "0", "--good-runs": "0", "--eval-runs": "few"}) == {}
    assert statistical({}) == {}


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["--good-runs", "0"], "--good-runs is '0', but must be a positive integer"),
        (["--max-reset-learning", "-1"], "must be an integer that is at least 0"),
        (["--discount", "1.5"], "--discount is '1.5', but must be a number greater than 0 and"),
        (["--qlearning-alpha", "0.5"], "but must be a number at least 1"),
        (["--learning-method", "7"], "--learning-method is '7', but must be 4, 5, -1 or 3"),
    ],
)
def test_wrong_options_of_learning_are_named(words: list[str], message: str) -> None:
    with pytest.raises(InputError) as caught:
        parse(words)
    assert message in str(caught.value)


def test_options_that_learning_does_not_have_are_accepted_and_known() -> None:
    words = ["--total-runs", "50", "--filter", "0", "--split-ks=0.25", "--good-runs", "9"]
    given = parse(words).given
    assert idle_in_learning(given) == ["--total-runs", "--filter", "--split-ks"]
    assert statistical(given) == {"good_runs": 9}


@pytest.mark.parametrize(
    ("number", "rule"), [("0", "error"), ("1", "safe"), ("2", "unsafe"), ("3", "sample")]
)
def test_what_counts_outside_a_grid_has_a_number(number: str, rule: str) -> None:
    assert statistical(parse(["--out-of-bounds", number]).given) == {"out_of_bounds": rule}
    assert of_model({"--out-of-bounds": number}) == {"out_of_bounds": rule}
    with pytest.raises(InputError, match="--out-of-bounds is '4', but must be 0, 1, 2 or 3"):
        parse(["--out-of-bounds", "4"])
