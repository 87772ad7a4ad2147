"""How long the best strategy of a large finite game takes, beside Storm on the same game.

    python tests/benchmarks/best_strategy.py [--only gambler] [--sizes 1e4 1e5] [--peer-only]

Three games that are made in any size, as a UPPAAL model and in the language of PRISM: a gambler who
wants all coins in so many rounds (no state comes again), a walk through wind to a corner (states
come again), and the orders of a store. For each: the value and the seconds of `ntagen check`, to
load the model and to answer, those of Storm (`pip install stormpy`), to build the states and to
compute, and how many times faster ntagen was. Storm bounds its error by 1e-6, relatively, so the
last column is the difference of both values, relatively. Processes start outside the measurement.
"""

from __future__ import annotations

import argparse
import importlib.util
import json
import math
import subprocess
import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.oracles.learning.storm import StormAnswer, value_of


@dataclass(frozen=True)
class Instance:
    """A game for both tools."""

    model: str
    query: str
    prism: str
    question: str


@dataclass(frozen=True)
class OurAnswer:
    """What `ntagen check` says."""

    value: float
    load_s: float
    answer_s: float


def gambler(size: int) -> Instance:
    """Wants n coins in n rounds, from n/2, and bets 1 to 5; of few coins fewer."""
    n = math.isqrt(size)
    bets = range(1, 6)
    model = f"""
const int N = {n};
int[0,N] coins = N / 2;
int[0,N] rounds = N;
int[0,5] bet;
process Gambler() {{
  state Choose, Rich, Over;
  branchpoint Round;
  urgent Choose;
  init Choose;
  trans Choose -> Round {{ select b : int[1,5];
          guard rounds > 0 && b <= coins && coins + b <= N; assign rounds--, bet = b; }},
        Round -> Choose {{ assign coins += bet; probability 99; }},
        Round -> Choose {{ assign coins -= bet; probability 101; }},
        Choose -u-> Rich {{ guard coins == N; }},
        Choose -u-> Over {{ guard coins < N && (rounds == 0 || coins == 0); }};
}}
system Gambler;
"""
    lines = "\n".join(
        f"  [] rounds>0 & {bet}<=coins & coins+{bet}<={n} -> 99/200:(coins'=coins+{bet})"
        f"&(rounds'=rounds-1) + 101/200:(coins'=coins-{bet})&(rounds'=rounds-1);"
        for bet in bets
    )
    prism = f"""mdp
module gambler
  coins : [0..{n}] init {n // 2};
  rounds : [0..{n}] init {n};
{lines}
  [] rounds=0 | coins=0 | coins={n} -> true;
endmodule
label "rich" = coins={n};
"""
    return Instance(model, "maxPr[<=1]: <> Gambler.Rich", prism, 'Pmax=? [F "rich"]')


def grid(size: int) -> Instance:
    """From a corner of an n by n grid to the other; a step that fails with 1/5 goes east.

    A cell of which 3 x + 5 y can be divided by 7 costs 5, any other one 1.
    """
    n = math.isqrt(size)
    ways = (("x < N - 1", 1, 0), ("x > 0", -1, 0), ("y < N - 1", 0, 1), ("y > 0", 0, -1))
    edges = ",\n".join(
        f"        At -> Wind {{ guard {guard} && !(x == N - 1 && y == N - 1);\n"
        f"          assign cost += toll(), dx = {dx}, dy = {dy}; }}"
        for guard, dx, dy in ways
    )
    model = f"""
const int N = {n};
int[0,N-1] x, y;
meta int[-1,1] dx, dy;
int cost;
int toll() {{ return (3 * x + 5 * y) % 7 == 0 ? 5 : 1; }}
process Walk() {{
  state At, Home;
  branchpoint Wind;
  urgent At;
  init At;
  trans
{edges},
        Wind -> At {{ assign x += dx, y += dy; probability 4; }},
        Wind -> At {{ assign x = x < N - 1 ? x + 1 : x; probability 1; }},
        At -u-> Home {{ guard x == N - 1 && y == N - 1; }};
}}
system Walk;
"""
    home = f"x={n - 1} & y={n - 1}"
    wind = f"1/5:(x'=min({n - 1},x+1))"
    prism = f"""mdp
module walk
  x : [0..{n - 1}] init 0;
  y : [0..{n - 1}] init 0;
  [go] x<{n - 1} & !({home}) -> 4/5:(x'=x+1) + {wind};
  [go] x>0 & !({home}) -> 4/5:(x'=x-1) + {wind};
  [go] y<{n - 1} & !({home}) -> 4/5:(y'=y+1) + {wind};
  [go] y>0 & !({home}) -> 4/5:(y'=y-1) + {wind};
  [] {home} -> true;
endmodule
rewards "cost"
  [go] true : mod(3*x+5*y,7)=0 ? 5 : 1;
endrewards
label "home" = {home};
"""
    return Instance(
        model, "minE(cost)[<=1]{x, y}->{}: <> Walk.Home", prism, 'R{"cost"}min=? [F "home"]'
    )


def inventory(size: int) -> Instance:
    """For n days, of a store with n places, orders of up to 8 are paid 4 and 1 a piece.

    Of 0 to 3 pieces wanted (1/8, 3/8, 3/8, 1/8) one that is missing costs 6; eight that are left
    cost 1.
    """
    n = math.isqrt(size)
    model = f"""
const int N = {n};
int[0,N] stock, day;
int cost;
void sell(int wanted) {{
  if (wanted > stock) {{ cost += 6 * (wanted - stock); stock = 0; }}
  else {{ stock -= wanted; }}
  cost += stock / 8;
}}
process Store() {{
  state Order, Open, Done;
  branchpoint Demand;
  urgent Order, Open;
  init Order;
  trans Order -> Open {{ select n : int[0,8]; guard day < N && stock + n <= N;
          assign stock += n, cost += n > 0 ? 4 + n : 0; }},
        Open -u-> Demand {{ assign day++; }},
        Demand -> Order {{ assign sell(0); probability 1; }},
        Demand -> Order {{ assign sell(1); probability 3; }},
        Demand -> Order {{ assign sell(2); probability 3; }},
        Demand -> Order {{ assign sell(3); probability 1; }},
        Order -u-> Done {{ guard day == N; }};
}}
system Store;
"""
    chances = ("1/8", "3/8", "3/8", "1/8")
    orders = "\n".join(
        f"  [order{k}] !open & day<{n} & stock+{k}<={n} -> (open'=true)&(stock'=stock+{k});"
        for k in range(9)
    )
    sold = "\n    + ".join(
        f"{chance}:(open'=false)&(day'=day+1)&(stock'=max(0,stock-{k}))"
        for k, chance in enumerate(chances)
    )
    paid = " + ".join(
        f"{chance}*(stock>={k} ? floor((stock-{k})/8) : 6*({k}-stock))"
        for k, chance in enumerate(chances)
    )
    costs = "\n".join(f"  [order{k}] true : {4 + k};" for k in range(1, 9))
    prism = f"""mdp
module store
  open : bool init false;
  day : [0..{n}] init 0;
  stock : [0..{n}] init 0;
{orders}
  [sell] open -> {sold};
  [] !open & day={n} -> true;
endmodule
rewards "cost"
{costs}
  [sell] true : {paid};
endrewards
label "done" = !open & day={n};
"""
    return Instance(
        model, "minE(cost)[<=1]{day, stock}->{}: <> Store.Done", prism, 'R{"cost"}min=? [F "done"]'
    )


GAMES: dict[str, Callable[[int], Instance]] = {
    "gambler": gambler,
    "grid": grid,
    "inventory": inventory,
}


def ours(instance: Instance, folder: Path) -> OurAnswer | str:
    """The engine's answer, or what it says instead."""
    path = folder / "game.xta"
    path.write_text(instance.model, encoding="utf-8")
    query = f"strategy Best = {instance.query}"
    command = [sys.executable, "-m", "ntagen", "check", str(path), "--query", query, "--json"]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    try:
        answer = json.loads(run.stdout.splitlines()[0])
        return OurAnswer(float(answer["value"]), answer["load_seconds"], answer["seconds"])
    except (IndexError, ValueError, TypeError, KeyError):
        return (run.stderr.splitlines() or [run.stdout])[0]


def theirs(instance: Instance, folder: Path) -> StormAnswer | None:
    """Storm's answer, where Storm is installed."""
    if importlib.util.find_spec("stormpy") is None:
        return None
    path = folder / "game.prism"
    path.write_text(instance.prism, encoding="utf-8")
    return value_of(path, instance.question, is_exact=False)


def compare(instance: Instance, *, is_peer_only: bool) -> None:
    """Prints both answers."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        peer = theirs(instance, folder)
        if peer is None:
            print("  Storm   is not installed")
        else:
            print(
                f"  Storm   {peer.value:.9g}, {peer.states:,} states: "
                f"{peer.build_s:.3f} s to build, {peer.solve_s:.3f} s to compute"
            )
        if is_peer_only:
            return
        answer = ours(instance, folder)
        if isinstance(answer, str):
            print(f"  ntagen  {answer}")
            return
        times = f"{answer.load_s:.3f} s to load, {answer.answer_s:.3f} s to answer"
        print(f"  ntagen  {answer.value:.9g}: {times}{ratio(answer, peer)}")


def ratio(answer: OurAnswer, peer: StormAnswer | None) -> str:
    """How both answers compare."""
    if peer is None:
        return ""
    faster = (peer.build_s + peer.solve_s) / (answer.load_s + answer.answer_s)
    away = abs(answer.value / float(peer.value) - 1)
    return f"; {faster:.1f} times as fast as Storm, values differ by {away:.1e}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--only", choices=sorted(GAMES), help="one of the games")
    parser.add_argument("--sizes", nargs="+", type=float, default=[1e4, 1e5, 1e6], help="in states")
    parser.add_argument("--peer-only", action="store_true", help="ask Storm only")
    given = parser.parse_args()
    for name in [given.only] if given.only else GAMES:
        for size in given.sizes:
            print(f"{name}, about {size:,.0f} states", flush=True)
            compare(GAMES[name](int(size)), is_peer_only=given.peer_only)


if __name__ == "__main__":
    main()
