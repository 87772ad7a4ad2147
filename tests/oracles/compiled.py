"""The generated declaration, compiled as C: what its text computes, without any model checker.

UPPAAL's language is close to C. What is not C is rewritten: the ranged integer type, clocks and
channels (left out), integer constants (enumerators, since C wants constants as array lengths), and
arrays by reference (C has no others).
"""

from __future__ import annotations

import ctypes
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

from tests.oracles.declaration import End, Instance

PRELUDE = """
#include <math.h>
#include <stdbool.h>
static int fint(double value) { return (int)value; }
"""

COMPILER = shutil.which("cc")


def as_c(declaration: str) -> str:
    """The text of a declaration as a C program without `main`."""
    text = re.sub(r"typedef int\[[^]]*\] (\w+);", r"typedef int \1;", declaration)
    text = re.sub(r"^(clock|broadcast chan) .*$", "", text, flags=re.MULTILINE)
    text = re.sub(r"&(\w+\[)", r"\1", text)
    text = re.sub(r"const int (\w+) = (-?\d+);", r"enum { \1 = \2 };", text)
    return PRELUDE + text


class CompiledNeedle:
    """The functions and variables of one compiled declaration; there is one needle in it.

    Args:
        declaration: The text of the declaration.
        instance: The constants, for the shapes of the arrays.
        folder: Where to compile; the name of the library must be new in the process.
    """

    def __init__(self, declaration: str, instance: Instance, folder: Path) -> None:
        assert COMPILER is not None
        source, library = folder / "declaration.c", folder / "declaration.so"
        source.write_text(as_c(declaration), "utf-8")
        # Fused operations would round differently from UPPAAL and from Python.
        options = ["-O1", "-ffp-contract=off", "-shared", "-fPIC"]
        subprocess.run([COMPILER, *options, "-o", str(library), str(source), "-lm"], check=True)
        self._library = ctypes.CDLL(str(library))
        for name in ("check_path_valid", "check_TR_reached", "check_TR_reachable"):
            getattr(self._library, name).restype = ctypes.c_bool
        for name in ("check_CR_reached", "check_rotation_allowed"):
            getattr(self._library, name).restype = ctypes.c_bool
        self._targets = len(instance.targets)
        self._shapes = {
            "actions": (instance.max_actions, 3),
            "curr_ACT_index": (),
            "ROT_counter": (),
            "prev_ROT_index": (),
            "sel_rot_angle": (),
            "curr_TR_index": (),
            "needle_progress": (),
            "tip_pos": (3,),
            "tip_roll": (),
            "motion_circle_center": (3,),
            "motion_circle_yaw": (),
            "vectors": (8, 3),
            "matrices": (6, 3, 3),
        }
        self._flags = ("CR_reached", "TR_reached", "TR_reachable", "path_valid")
        self._memory = [self._variable(name) for name in (*self._shapes, *self._flags)]
        self._start = [bytes(memory) for memory in self._memory]

    def start(self) -> None:
        """Brings all variables to their initial values, then does what the User does first."""
        for memory, values in zip(self._memory, self._start, strict=True):
            ctypes.memmove(ctypes.addressof(memory), values, len(values))
        self._library.initialize()

    def variables(self) -> dict[str, object]:
        """The variables by name, nested as they are declared."""
        found: dict[str, object] = {}
        for name, shape in self._shapes.items():
            memory = self._variable(name)
            found[name] = _nested(memory, shape) if shape else memory.value
        return found | {name: self._variable(name).value for name in self._flags}

    def push(self) -> None:
        """What Needle.Push -> Idle does."""
        self._library.step()

    def roll(self, angle_deg: int) -> None:
        """What the User's choice, Needle.Idle -> Rotate and Rotate -> Idle do."""
        self._variable("sel_rot_angle").value = angle_deg
        self._library.log_push_action()
        self._library.log_rotation_action()
        self._library.rotate_deg(angle_deg)

    def may_roll(self) -> bool:
        """The guard of the User's edge for rolls."""
        return bool(self._library.check_rotation_allowed())

    def check(self) -> End | None:
        """The way of the Checker through its locations (with `safety sampled`)."""
        index = self._variable("curr_TR_index")
        if not self._library.check_path_valid():
            return End.PATH_INVALID
        if self._library.check_TR_reached():
            index.value += 1
            if index.value == self._targets:
                return End.FINAL_TR_REACHED
        if not self._library.check_TR_reachable():
            return End.TR_UNREACHABLE
        return End.UR_REACHED if self._library.check_CR_reached() else None

    def _variable(self, name: str) -> Any:  # noqa: ANN401  a ctypes object of any shape
        kind: Any = ctypes.c_bool if name in self._flags else ctypes.c_int
        for length in reversed(self._shapes.get(name, ())):
            kind = kind * length
        return kind.in_dll(self._library, name)


def _nested(memory: Any, shape: tuple[int, ...]) -> list[Any]:  # noqa: ANN401
    if len(shape) == 1:
        return list(memory)
    return [_nested(part, shape[1:]) for part in memory]
