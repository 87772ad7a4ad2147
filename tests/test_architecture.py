"""Which part of the package may know which other, and who may print, exit or look at the clock.

The arrows of the design, downwards only. Stated as what may be imported; all else is an error:
a new arrow is a decision and belongs into `MAY_IMPORT`, with a reason in the change.
"""

from __future__ import annotations

import ast
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import pytest

PACKAGE = Path(__file__).parents[1] / "ntagen"

EVERYWHERE = {"values"}
"""What every room may import: `dataclass`, which knows nothing of this program."""

BASE = {
    "errors",
    "hardware",
    "motion",
    "parameters",
    "rounding",
    "rules",
    "scene",
    "shapes",
    "units",
}
MAY_IMPORT: dict[str, set[str]] = {
    "cache": set(),
    "values": set(),
    "version": set(),
    "system": set(),
    "errors": set(),
    "units": set(),
    "rules": {"units"},
    "scene": {"errors", "motion", "rules", "shapes"},
    "rounding": {"rules", "scene", "shapes"},
    "shapes": set(),
    "motion": {"shapes"},
    "parameters": {"rules", "units"},
    "hardware": {"errors", "rules"},
    "imaging": {"cache", "errors", "files", "shapes"},
    "nsl": BASE | {"cache", "files", "imaging"},
    "render": BASE | {"cache"},
    "files": {"errors", "system"},
    "frames": {"errors"},
    "bags": {"errors"},
    "checker.edges": set(),
    "checker.errors": {"errors", "_checker"},
    "checker.picture": {"errors", "files"},
    "checker.constraints": {"checker.picture"},
    "checker.winning": {"errors", "checker.constraints", "checker.decisions", "checker.picture"},
    "checker.distribution": {"errors", "frames", "checker.picture"},
    "checker.trajectories": {"errors", "frames", "checker.picture"},
    "checker.queries": {"_checker"},
    "checker.facts": {"checker.picture", "checker.queries"},
    "checker.states": {"checker.edges", "checker.errors", "_checker"},
    "checker.state_space": {"errors", "files", "checker.edges", "checker.picture"}
    | {"checker.states"},
    "checker.runs": {"errors", "checker.picture"},
    "checker.machine": {"errors"},
    "checker.learned_trees": {"errors"},
    "checker.learned_map": {"errors", "checker.learned_trees", "checker.picture"},
    "checker.learned": {"checker.errors", "errors", "files", "_checker"}
    | {"checker.learned_map", "checker.learned_trees", "checker.picture"},
    "checker.story": {"checker.runs"},
    "checker.play": {"errors", "checker.errors", "checker.runs", "_checker"},
    "checker.decisions": {"checker.runs"},
    "checker.strategy": {"errors", "files", "checker.runs", "checker.play", "_checker"}
    | {"checker.decisions", "checker.errors", "checker.picture", "checker.winning"},
    "checker.answer": {"checker.edges", "checker.errors", "checker.machine", "checker.runs"}
    | {"checker.learned", "checker.queries"}
    | {"checker.options"}
    | {"checker.story", "checker.strategy", "_checker"}
    | {"errors", "checker.distribution", "checker.picture", "checker.trajectories"},
    "checker.options": {"checker.queries", "checker.strategy"},
    "checker.constants": set(),
    "checker.policy": {"errors"},
    "checker.agents": {"errors", "checker.policy"},
    "checker.stepwise": {"errors", "checker.errors", "_checker"},
    "checker.survey": {"_checker"},
    "checker.names": {"checker.survey"},
    "checker.model": {"errors", "files", "_checker"}
    | {"checker.answer", "checker.edges", "checker.errors", "checker.facts", "checker.runs"}
    | {"checker.constants", "checker.policy", "checker.stepwise"}
    | {"checker.options", "checker.queries", "checker.states"}
    | {"checker.state_space", "checker.strategy"},
    "checker": {"checker.answer", "checker.edges", "checker.errors", "checker.model"}
    | {"checker.options", "checker.queries", "checker.states"}
    | {"checker.distribution", "checker.learned", "checker.trajectories"},
    "explanations": {"nsl", "checker"},
    "loading": BASE | {"nsl", "render", "checker", "checker.strategy"},
    "build": {"errors", "files", "checker", "checker.picture"},
    "convert": {"build", "errors", "checker"}
    | {"checker.facts", "checker.picture", "checker.queries"},
    "suites": {"build", "checker", "checker.runs", "errors", "files"},
    "mutation": {"build", "checker", "checker.runs", "errors", "suites"},
    "verifyta": {"errors", "files", "checker"},
    "xta": set(),
    "gymnasium": {"errors", "loading", "checker", "checker.policy", "checker.stepwise"},
    "simulator": {"errors", "checker", "checker.constraints", "checker.errors", "checker.facts"}
    | {"checker.picture", "checker.play", "checker.queries", "checker.runs", "checker.strategy"},
    "document": {"errors", "files", "build", "checker.names", "checker.picture"}
    | {"checker.survey"},
    "serve": {"document", "errors", "files"},
    "watch": {"drive", "errors", "plan", "plot", "scene", "serve", "shapes"},
    "editor": {"nsl", "parameters", "values", "version"}
    | {"checker", "checker.names", "checker.survey", "explanations", "files", "serve", "xta"},
    "needle": BASE,
    "plan": BASE | {"needle", "render", "checker"},
    "grbl": {"errors", "hardware", "units"},
    "extensions": {"errors"},
    "drive": BASE
    | {
        "bags",
        "extensions",
        "files",
        "frames",
        "imaging",
        "needle",
        "nsl",
        "plan",
        "render",
        "checker",
        "grbl",
    }
    | {"version"},
    "openigtlink": {"errors"},
    "tracking": BASE | {"extensions", "files", "needle", "drive", "openigtlink"},
    "traces": BASE | {"bags", "files", "needle", "nsl", "plan", "tracking"},
    "plugins": {"errors", "drive", "needle", "tracking"},
    "testing": {"errors", "drive", "needle", "plugins"},
    "lab": BASE | {"needle", "grbl", "plan", "drive", "openigtlink", "tracking"},
    "ros": BASE | {"bags", "drive", "files", "lab", "needle", "openigtlink", "plan", "tracking"},
    "plot": BASE | {"files", "needle", "nsl", "plan", "drive", "traces"} | {"checker.picture"},
    "report": BASE | {"checker", "drive", "files", "plan", "plot", "render", "version"},
    "cluster": {"checker", "checker.queries", "errors", "version"},
    "experiment": BASE
    | {
        "cluster",
        "files",
        "frames",
        "grbl",
        "needle",
        "nsl",
        "plan",
        "drive",
        "lab",
        "plot",
        "system",
        "version",
    },
    "cli": BASE
    | {
        "cluster",
        "experiment",
        "files",
        "needle",
        "nsl",
        "plan",
        "render",
        "loading",
        "explanations",
    }
    | {
        "extensions",
        "grbl",
        "drive",
        "lab",
        "plot",
        "ros",
        "testing",
        "traces",
        "tracking",
        "version",
    }
    | {"checker.picture", "report", "system"}
    | {"checker.survey", "editor", "serve", "simulator", "verifyta", "watch", "xta"}
    | {"build", "mutation", "suites"}
    | {"checker", "checker.facts", "checker.play", "checker.runs", "checker.strategy"}
    | {"checker.agents", "checker.survey", "convert"},
    "pytest_plugin": {"checker", "checker.queries", "errors", "loading"},
    "__main__": {"cli"},
}
"""By room: the rooms that it may import. Each may import itself.

The face of the engine is split by module; ``checker`` alone is what it shows to the other rooms.
"""

NEEDLE = {
    "rules",
    "scene",
    "nsl",
    "render",
    "needle",
    "plan",
    "drive",
    "plot",
    "report",
    "tracking",
    "traces",
    "lab",
    "watch",
    "ros",
}
"""The rooms that are about needles; the face of the engine serves any model."""

SPLIT = {"checker"}
"""Folders each part of which is a room of its own."""

ONLY_IN: dict[str, set[str]] = {
    "click": {"cli"},
    "pytest": {"pytest_plugin"},
    "rich": {"cli"},
    "lark": {"nsl"},
    "jinja2": {"render", "suites"},
    "markupsafe": {"render"},
    "matplotlib": {"checker.picture", "experiment", "plot"},
    "scipy": {"experiment", "imaging", "needle", "plan", "traces"},
    "nibabel": {"imaging"},
    "gymnasium": {"gymnasium"},
    "dask": {"cluster"},
    "distributed": {"cluster"},
    "mcap": {"drive"},
    "lz4": {"drive"},
    "zstandard": {"drive"},
    "mcap_protobuf": {"drive", "watch"},
    "foxglove": {"watch"},
    "foxglove_schemas_protobuf": {"drive", "watch"},
    "serial": {"grbl"},
    "rosbags": {"bags"},
    # ROS 2.
    "rclpy": {"ros"},
    "builtin_interfaces": {"ros"},
    "diagnostic_msgs": {"ros"},
    "geometry_msgs": {"ros"},
    "rcl_interfaces": {"ros"},
    "rosgraph_msgs": {"ros"},
    "std_msgs": {"ros"},
    "std_srvs": {"ros"},
    "visualization_msgs": {"ros"},
    # Devices and clocks.
    "socket": {"drive", "openigtlink"},
    "selectors": {"openigtlink"},
    "select": {"drive", "grbl"},
    "asyncio": {"drive", "editor"},
    # Windows has none of these.
    "fcntl": {"system"},
    "pty": {"grbl"},
    "tty": {"grbl"},
    "termios": set(),
    "resource": {"serve"},
    "threading": {"cluster", "drive", "grbl", "cli", "experiment", "lab", "openigtlink"}
    | {"plugins", "ros", "serve", "testing", "watch"},
    "time": {
        "cluster",
        "drive",
        "grbl",
        "cli",
        "experiment",
        "lab",
        "openigtlink",
        "plot",
        "ros",
        "serve",
        "testing",
        "watch",
    },
    "datetime": {"drive", "cli"},
    # What must not happen by itself: random numbers have a seed, and are drawn by the simulation
    # and for random tasks.
    "random": {"needle", "drive", "experiment", "checker.runs", "checker.play", "simulator"},
}
"""By library: the rooms that may import it. Libraries that are not listed may be used anywhere."""

PRINTS_OR_EXITS = {"print", "input", "exit", "quit", "breakpoint"}
EXITING_ATTRIBUTES = {("sys", "exit"), ("os", "_exit"), ("os", "abort")}
ALLOWED_TO_PRINT = {"cli", "__main__"}


@dataclass(frozen=True)
class Import:
    """One imported module: where it stands and what it names."""

    room: str
    place: str
    module: str


def room_named(parts: tuple[str, ...]) -> str:
    """The room of a module, by the parts of its name below ``ntagen``."""
    return ".".join(parts[:2]) if parts[0] in SPLIT else parts[0]


def room_of(path: Path) -> str:
    """The part of the package that a file belongs to; the package's own face is ``ntagen``."""
    parts = path.relative_to(PACKAGE).with_suffix("").parts
    parts = parts[:-1] if parts[-1] == "__init__" else parts
    return room_named(parts) if parts else "ntagen"


def is_module(name: str) -> bool:
    """Whether there is a module of the package by this name."""
    top, *parts = name.split(".")
    path = PACKAGE.joinpath(*parts)
    return top == "ntagen" and (path.is_dir() or path.with_suffix(".py").is_file())


@cache
def trees() -> list[tuple[Path, ast.Module]]:
    """The files of the package; they are read once for all tests."""
    return [
        (path, ast.parse(path.read_text("utf-8"), str(path)))
        for path in sorted(PACKAGE.rglob("*.py"))
        if "templates" not in path.relative_to(PACKAGE).parts
    ]


@cache
def imports() -> list[Import]:
    found = []
    for path, tree in trees():
        for node in ast.walk(tree):
            match node:
                case ast.Import(names=names):
                    modules = [alias.name for alias in names]
                case ast.ImportFrom(module="ntagen", names=names, level=0):
                    modules = [f"ntagen.{alias.name}" for alias in names]
                case ast.ImportFrom(module=str(module), names=names, level=0):
                    inner = [f"{module}.{alias.name}" for alias in names]
                    modules = sorted({name if is_module(name) else module for name in inner})
                case ast.ImportFrom():
                    modules = ["relative import"]
                case _:
                    continue
            place = f"{path.relative_to(PACKAGE)}:{node.lineno}"
            found += [Import(room_of(path), place, module) for module in modules]
    return found


def test_every_room_is_known() -> None:
    rooms = {room_of(path) for path, _ in trees()} - {"ntagen"}
    assert rooms <= set(MAY_IMPORT)


def test_arrows_between_rooms_point_downwards() -> None:
    wrong = []
    for item in imports():
        parts = item.module.split(".")
        if parts[0] == "ntagen" and len(parts) > 1 and item.room != "ntagen":
            allowed = MAY_IMPORT[item.room] | {item.room} | EVERYWHERE
            if room_named(tuple(parts[1:])) not in allowed:
                wrong.append(f"{item.place}: {item.room} must not import {item.module}")
    assert wrong == []


def test_the_allowed_arrows_make_no_circle() -> None:
    done: set[str] = {"_checker"}
    while done < set(MAY_IMPORT) | done:
        ready = {room for room, below in MAY_IMPORT.items() if room not in done and below <= done}
        assert ready, f"a circle among {sorted(set(MAY_IMPORT) - done)}"
        done |= ready


def rooms_below(room: str) -> set[str]:
    """All rooms that a room may get to by imports."""
    below = MAY_IMPORT.get(room, set())
    return below.union(*map(rooms_below, below))


def test_the_face_of_the_engine_knows_nothing_of_the_needle() -> None:
    face = {room for room in MAY_IMPORT if room.partition(".")[0] == "checker"}
    assert {f"checker.{name}" for name in ("facts", "play", "strategy")} < face
    assert {room: wrong for room in sorted(face) if (wrong := rooms_below(room) & NEEDLE)} == {}
    # The package's own face leads everywhere.
    assert [one.place for one in imports() if one.room in face and one.module == "ntagen"] == []


def test_libraries_stay_in_their_rooms() -> None:
    wrong = [
        f"{item.place}: {item.module} belongs into {sorted(ONLY_IN[top])}"
        for item in imports()
        if (top := item.module.partition(".")[0]) in ONLY_IN and item.room not in ONLY_IN[top]
    ]
    assert wrong == []


def test_imports_are_absolute() -> None:
    assert [item.place for item in imports() if item.module == "relative import"] == []


def test_only_the_command_line_prints_or_exits() -> None:
    wrong = []
    for path, tree in trees():
        if room_of(path) in ALLOWED_TO_PRINT:
            continue
        for node in ast.walk(tree):
            match node:
                case ast.Call(func=ast.Name(id=name)) if name in PRINTS_OR_EXITS:
                    wrong.append(f"{path.relative_to(PACKAGE)}:{node.lineno}: {name}")
                case ast.Attribute(value=ast.Name(id=module), attr=name) if (
                    module,
                    name,
                ) in EXITING_ATTRIBUTES or (
                    module == "sys" and name in ("stdout", "stderr", "stdin")
                ):
                    wrong.append(f"{path.relative_to(PACKAGE)}:{node.lineno}: {module}.{name}")
                case ast.Name(id="SystemExit"):
                    wrong.append(f"{path.relative_to(PACKAGE)}:{node.lineno}: SystemExit")
    assert wrong == []


@pytest.mark.parametrize("module", ["ntagen._checker"])
def test_the_compiled_engine_has_one_door(module: str) -> None:
    users = {item.room for item in imports() if item.module.startswith(module)}
    doors = {"checker.answer", "checker.errors", "checker.model", "checker.states"}
    assert users <= doors | {
        "checker.learned",
        "checker.play",
        "checker.queries",
        "checker.stepwise",
        "checker.strategy",
        "checker.survey",
    }


def test_commands_print_by_the_terminal_module_only() -> None:
    """Its functions show control characters from files by their numbers."""
    wrong = []
    for path, tree in trees():
        if room_of(path) != "cli" or path.name == "terminal.py":
            continue
        for node in ast.walk(tree):
            match node:
                case ast.Attribute(value=ast.Name(id="click"), attr="echo" | "secho" | "style"):
                    wrong.append(f"{path.relative_to(PACKAGE)}:{node.lineno}: click.{node.attr}")
                case ast.Call(func=ast.Name(id="print")):
                    wrong.append(f"{path.relative_to(PACKAGE)}:{node.lineno}: print")
                case ast.Call(
                    func=ast.Attribute(value=ast.Name(id="console"), attr="print"), args=[first, *_]
                ) if not isinstance(first, ast.Name) and not (
                    isinstance(first, ast.Call)
                    and isinstance(first.func, ast.Name)
                    and first.func.id == "safe"
                ):
                    wrong.append(f"{path.relative_to(PACKAGE)}:{node.lineno}: console.print")
    assert wrong == []


def test_the_commands_on_models_know_no_needle() -> None:
    """What one of them says of a task, it imports when it has one."""
    folder = PACKAGE / "cli" / "models"
    rooms = tuple(f"ntagen.{room}" for room in ("cli.needle", *NEEDLE))
    wrong = []
    for path in sorted(folder.glob("*.py")):
        for node in ast.parse(path.read_text("utf-8")).body:
            if isinstance(node, ast.ImportFrom) and str(node.module).startswith(rooms):
                wrong.append(f"{path.name}: {node.module}")
    assert wrong == []
