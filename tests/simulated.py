"""Models for the tests of the simulator, and a way to talk to one."""

from __future__ import annotations

from typing import Any, Final

from ntagen import checker
from ntagen.simulator.session import Session

LAMP: Final = """
// A push lights the lamp; a second one within 3 units makes it bright.
chan push; int[0, 9] pushes = 0;
process Lamp() { clock since;
  state Off, Low, Bright; init Off;
  trans Off -> Low { sync push?; assign since = 0; },
    Low -> Bright { guard since < 3; sync push?; }, Low -> Off { guard since >= 3; sync push?; },
    Bright -> Off { sync push?; }; }
process Hand() { clock rest;
  state Idle; init Idle;
  trans Idle -> Idle { guard rest >= 1 && pushes < 9; sync push!; assign rest = 0, pushes++; }; }
system Lamp, Hand;
"""

CROSSING: Final = """
// Two carts share a bridge. Who comes second waits until the bridge is free.
const int N = 2;
typedef int[0, N - 1] cart;
chan come[cart], leave[cart]; urgent chan enter[cart];
process Cart(const cart id) { clock x;
  state Away, Near { x <= 9 }, Halted, On { x <= 5 }; init Away;
  trans Away -> Near { sync come[id]!; assign x = 0; }, Near -> Halted { guard x >= 4; },
    Halted -> On { sync enter[id]?; assign x = 0; }, On -> Away { guard x > 2; sync leave[id]!; }; }
process Bridge() { int[0, N] waiting = 0;
  state Free, Used; init Free;
  trans Free -> Free { select c : cart; sync come[c]?; assign waiting++; },
    Used -> Used { select c : cart; sync come[c]?; assign waiting++; },
    Free -> Used { select c : cart; guard waiting > 0; sync enter[c]!; assign waiting--; },
    Used -> Free { select c : cart; sync leave[c]?; }; }
system Cart, Bridge;
query { E<> Cart(0).On and Cart(1).Halted }
query { simulate [<=40; 25] { Bridge.waiting, Cart(0).x } }
"""

MATCHES: Final = """
// The keeper strikes a match, which burns within 2 units; the wind may blow it out before.
int[0, 3] tries = 0;
process Keeper() { clock x;
  state Dark, Striking { x <= 2 }, Lit; init Dark;
  trans Dark -> Striking { guard tries < 3; assign x = 0, tries++; },
    Striking -> Lit { guard x >= 1; },
    Striking -u-> Dark { guard x < 2 && tries < 3; }; }
system Keeper;
query { control: A<> Keeper.Lit }
"""


class Talk:
    """A simulation of a model, and the answer to the last request."""

    def __init__(self, text: str) -> None:
        self.model = checker.load(text)
        self._session = Session(self.model, timeout_s=20.0, memory_bytes=1 << 30)

    def __call__(self, do: str, **more: Any) -> dict[str, Any]:  # noqa: ANN401
        return self._session.answer({"do": do, **more})

    def walk(self, *moves: int) -> dict[str, Any]:
        """Takes moves, each at once or as early as it can be; the last view."""
        return [self("take", move=move) for move in moves][-1]
