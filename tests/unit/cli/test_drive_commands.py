"""The commands drive, replay and plot: messages, exit codes, JSON, files."""

from __future__ import annotations

import gzip
import json
from pathlib import Path

import pytest

import ntagen
from ntagen.cli import main
from ntagen.drive.reading import read_log
from ntagen.drive.records import Estimated, Relied
from ntagen.parameters import PARAMETERS

EXAMPLES = Path(__file__).parents[3] / "examples"
PAPER = str(EXAMPLES / "paper.nsl")
LARGE = str(EXAMPLES / "scenarios" / "large_mid_cr.nsl")


def check_refused(capsys: pytest.CaptureFixture[str], says: str, *arguments: str) -> None:
    assert main(arguments) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert says in err
    assert "Traceback" not in err


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("run") / "run.mcap"
    assert main(["drive", PAPER, "--seed", "1", "--quiet", "--log", str(path)]) == 0
    return path


def test_drive_reaches_the_target_and_tells_how(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["drive", PAPER, "--seed", "1"]) == 0
    out = capsys.readouterr().out
    assert "initial push" in out
    assert "synthesis 1 from 0.00 mm deep" in out
    assert "synthesis 2 from 5.00 mm deep" in out
    assert "target reached: the tip is in the last target" in out
    assert "mm inside T1" in out


def test_drive_says_that_there_is_no_strategy(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["drive", LARGE, "--json"]) == 1
    summary = json.loads(capsys.readouterr().out)
    assert summary["outcome"] == "no strategy"
    assert summary["depth_mm"] == pytest.approx(5.0)


def test_drive_takes_settings_from_file_and_command_line(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    path = tmp_path / "task.nsl"
    block = "drive { noise 0.01 mm  pull 8 mm  push 3 mm  force sensing off }"
    path.write_text(f"{Path(PAPER).read_text().rstrip().removesuffix('}')} {block} }}")
    log_path = tmp_path / "run.mcap"
    arguments = [str(path), "--set", "pull 6", "--set", "true radius 33 mm  true bevel 5deg"]
    assert main(["drive", *arguments, "--settings"]) == 0
    rows = {
        line[2:22].strip(): line.split("  ")[-1] for line in capsys.readouterr().out.splitlines()
    }
    assert rows["pull"] == "command line"
    assert rows["push"].strip().startswith(str(path))
    assert main(["drive", *arguments, "--log", str(log_path)]) == 0
    assert "not on the force: unknown regions are not felt" in capsys.readouterr().out
    log = read_log(log_path)
    assert (log.settings.pull_mm, log.settings.push_mm) == (6.0, 3.0)
    assert log.settings.margins.clearance_mm > 2.0
    assert json.loads(log.metadata["origins"])["pull_mm"] == "command line"
    assert json.loads(log.metadata["true_radius_mm"]) == 33.0
    assert log.actual.needle.radius_mm == 33.0
    assert log.scene.needle.radius_mm == 30.0
    estimates = [record for record in log.records if isinstance(record, Estimated)]
    assert abs(estimates[-1].radius_mm - 33.0) < abs(estimates[0].radius_mm - 33.0)
    assert isinstance(log.records[0], Relied)
    assert main(["replay", str(log_path)]) == 0
    assert main(["info", str(path), "--json"]) == 0
    told = json.loads(capsys.readouterr().out.splitlines()[-1])["settings"]
    assert told["push"]["value"] == 3.0
    assert told["push"]["origin"].startswith(str(path))


def test_the_strategy_of_each_synthesis_is_in_the_log(run: Path, tmp_path: Path) -> None:
    attachments = read_log(run).attachments
    folders = {name.split("/")[0] for name in attachments if name.startswith("rebuild-")}
    assert folders
    for folder in folders:
        model = ntagen.load(attachments[f"{folder}/model.xml"].decode())
        path = tmp_path / f"{folder}.json"
        path.write_bytes(gzip.decompress(attachments[f"{folder}/strategy.json.gz"]))
        strategy = ntagen.load_strategy(path, model)
        assert strategy.owner == "controller"


def test_drive_ends_at_the_time_limit(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["drive", PAPER, "--timeout", "0.05 min", "--quiet"]) == 6
    out = capsys.readouterr().out
    assert out == "no strategy in the time left: no plan can end within the time limit\n"


def test_drive_prints_one_object_with_json(capsys: pytest.CaptureFixture[str]) -> None:
    assert (
        main(["drive", PAPER, "--json", "--seed", "3", "--noise", "0.01", "--known", "none"]) == 0
    )
    out, err = capsys.readouterr()
    summary = json.loads(out)
    assert out.count("\n") == 1
    assert err == ""
    assert summary["outcome"] == "target reached"
    assert summary["true_clearance_mm"] > 0.0
    assert (summary["seed"], summary["known"]) == (3, "none")
    each = summary["each_synthesis"]
    assert len(each) == summary["syntheses"]
    for one in each:
        assert one["hold"] <= one["found"]
        assert 0.0 < one["engine_seconds"] < one["loop_seconds"]


@pytest.mark.parametrize(
    ("says", "arguments"),
    [
        ("nowhere.nsl", ["nowhere.nsl"]),
        ("no needle 'rubber'", [PAPER, "--needle", "rubber"]),
        ("unknown critical region 'C9'", [PAPER, "--known", "C9"]),
        ("write for example `time limit 60 s`", [PAPER, "--timeout", "soon"]),
        ("`time limit` must be greater than 0 s", [PAPER, "--timeout", "0"]),
        ("`noise` must be at least 0 mm", [PAPER, "--noise", "-1"]),
        ("`push`: command line", [PAPER, "--set", "push 12mm"]),
        ("`seed` must be at least 0", [PAPER, "--seed", "-1"]),
        ("it is a folder", [PAPER, "--log", "."]),
        ("would replace", [PAPER, "--log", PAPER]),
    ],
)
def test_drive_refuses_bad_input(
    capsys: pytest.CaptureFixture[str], says: str, arguments: list[str]
) -> None:
    check_refused(capsys, says, "drive", *arguments)


@pytest.mark.parametrize(
    ("settings", "says"),
    [
        (["ranking beauty"], ["`ranking` cannot be `beauty`", "write `clearance` or"]),
        (["roll error nan"], [":1:12: ", "`nan` is no value", "for example `roll error 2 deg`"]),
        (["true bevel 2mm"], [":1:12: ", "is an angle, but this is a length"]),
        (["learned radius 0 mm"], ["`learned radius` must be at least 0.01 mm"]),
        (["deviation count 2.5"], ["must be a whole number"]),
        (["force sensing maybe"], ["cannot be `maybe`", "write `on` or `off`"]),
        (["pull 4 mn"], [":1:8: ", "there is no unit `mn`", "did you mean"]),
        (["pull"], ["expected a value", "write for example `pull 2 mm`"]),
        (["prior nosie 2"], ["no statement begins with `prior`", "did you mean `prior noise`?"]),
        (["force sesning off"], ["command line:1:7: ", "did you mean `force sensing`?"]),
        (["xyzzy 3"], ["`ntagen drive --help-settings` prints all settings"]),
        (["push 1", "pull 8  push 2"], ["`push` is written a second time", "first is `push 1`"]),
        (["pull 8 mn", "psuh 2"], ["no unit `mn`", "did you mean `push`?"]),
        (["pull 8 mn", "push 2 mn"], ["command line:1:8: ", "command line:2:8: "]),
        (["noise 1 mm"], ["`noise` is written a second time", "the first is `noise 1 mm`"]),
    ],
)
def test_mistakes_in_settings_are_shown_at_their_place(
    capsys: pytest.CaptureFixture[str], settings: list[str], says: list[str]
) -> None:
    words = [word for text in settings for word in ("--set", text)]
    assert main(["drive", PAPER, "--noise", "2mm", *words]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    for part in says:
        assert part in err


@pytest.mark.parametrize(
    ("words", "now"),
    [
        (["--initial-push", "4mm"], "initial push 4mm"),
        (["--initial-push=4mm"], "initial push 4mm"),
        (["--rank", "rolls,length"], "ranking rolls,length"),
        (["--prior-noise"], "prior noise …"),
    ],
)
def test_options_that_are_gone_say_what_replaces_them(
    capsys: pytest.CaptureFixture[str], words: list[str], now: str
) -> None:
    assert main(["drive", PAPER, *words]) == 2
    option = words[0].partition("=")[0]
    assert capsys.readouterr().err == f"error: no such option: {option}; write --set '{now}'\n"


def test_all_settings_are_listed_and_completed(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    assert main(["drive", "--help-settings"]) == 0
    listed = capsys.readouterr().out
    for parameter in PARAMETERS:
        assert f"\n  {parameter.words} " in listed
    assert "[default: 5 mm]" in listed
    assert main(["sweep", "--help-settings"]) == 0
    assert "\n  seed " not in capsys.readouterr().out
    monkeypatch.setenv("_NTAGEN_COMPLETE", "bash_complete")
    monkeypatch.setenv("COMP_WORDS", 'ntagen drive --set "force s')
    monkeypatch.setenv("COMP_CWORD", "3")
    assert main([]) == 0
    said = capsys.readouterr().out
    assert said == "plain,force sensing\nplain,force sensing on\nplain,force sensing off\n"


def test_replay_reaches_the_same_decisions(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["replay", str(run)]) == 0
    out = capsys.readouterr().out
    assert "initial push" in out
    assert "the same decisions again: all" in out


def test_replay_reads_a_torn_log(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    torn = tmp_path / "torn.mcap"
    torn.write_bytes(run.read_bytes()[: run.stat().st_size // 2])
    assert main(["replay", str(torn)]) == 0
    assert "is cut off: it can be read up to byte" in capsys.readouterr().out
    assert main(["replay", str(torn), "--json"]) == 0
    summary = json.loads(capsys.readouterr().out)
    assert summary["same"]
    assert not summary["complete"]
    assert 0 < summary["torn_at_byte"] <= run.stat().st_size // 2


@pytest.mark.parametrize("data", [b"", b"\x89MCAP0\r\n", b"environment"])
def test_replay_refuses_what_is_no_log(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], data: bytes
) -> None:
    path = tmp_path / "run.mcap"
    path.write_bytes(data)
    check_refused(capsys, "not the log of a run", "replay", str(path))


def test_plot_draws_a_scene_and_a_run(
    run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for source in (PAPER, str(run)):
        path = tmp_path / f"{Path(source).stem}.svg"
        assert main(["plot", source, "-o", str(path), "--plans", "3"]) == 0
        assert capsys.readouterr().out == f"wrote {path}\n"
        assert "best plan" in path.read_text() or "last plan" in path.read_text()


@pytest.mark.parametrize(
    ("says", "arguments"),
    [
        ("nowhere.nsl", ["nowhere.nsl"]),
        ("no such file", ["nowhere.mcap"]),
        ("unknown kind of picture", [PAPER, "-o", "scene.bmp"]),
        ("unknown ranking criterion", [PAPER, "--set", "ranking beauty"]),
        ("--plans", [PAPER, "--plans", "-1"]),
    ],
)
def test_plot_refuses_bad_input(
    capsys: pytest.CaptureFixture[str], says: str, arguments: list[str]
) -> None:
    check_refused(capsys, says, "plot", *arguments)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["drive", PAPER, "--seed", "1", "--quiet"], "--seed has no effect without --noise or"),
        (["drive", PAPER, "--json", "--quiet"], "--quiet has no effect with --json"),
        (
            ["plot", PAPER, "--plans", "0", "--set", "ranking rolls"],
            "--set 'ranking …' has no effect with --plans 0",
        ),
    ],
)
def test_options_without_an_effect_are_named(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, arguments: list[str], said: str
) -> None:
    output = ["-o", str(tmp_path / "scene.svg")] if arguments[0] == "plot" else []
    assert main([*arguments, *output]) == 0
    assert f"note: {said}" in capsys.readouterr().err
