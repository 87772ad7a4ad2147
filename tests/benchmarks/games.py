"""How far the solver of timed games gets: time and memory against the size of seven families.

    python tests/benchmarks/games.py [--seconds 60] [--gibibytes 4] [--family NAME]

*cell* is a production cell: plates come on a belt, an arm takes each to a press that is ready when
it likes, and a plate that waits too long falls. *trains* is a gate in front of a bridge: trains
that come can be stopped for a while. *jobs* is a workshop: each job goes through three machines,
from another one on, and all are to be done in the least time. *queue* is the gate again, which lets
stopped trains go in the order in which they came. *standoff* has as many foes, each of whom draws
once and fires a while later, as friends, who are faster and fire only at who has drawn. *circuit*
has trains that come to the bridge again and again and must not meet, and the first one is to get
over it each time; *patrol* is a guard who goes round, past doors that somebody shuts.

In the *uncontrollable* variants the environment says when plates and trains come, when foes draw
and how long a machine takes, in the *controllable* ones the controller does. As a yardstick, six
jobs should take a few seconds, and so should five trains on a circuit; a hundred doors should take
less than one. Each game grows, by a quarter once it is large, until the time or the memory is not
enough. There is a line for each size.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass

from ntagen import checker

CELL = """
const int N = {size};
typedef int[0, N - 1] id_t;
const int GAP = 12;
bool arm;
bool press;
process Plate(const id_t id) {{
  clock x;
  state Far {{ x <= GAP * id + 4 }}, Belt, Fallen, Arm, Press {{ x <= 8 }}, Ready, Done;
  init Far;
  trans Far {arrow} Belt {{ guard x >= GAP * id; assign x = 0; }},
        Belt -u-> Fallen {{ guard x >= 12; }},
        Belt -> Arm {{ guard x >= 2 && !arm; assign arm = true, x = 0; }},
        Arm -> Press {{ guard x >= 2 && !press; assign arm = false, press = true, x = 0; }},
        Press -u-> Ready {{ guard x >= 5; assign x = 0; }},
        Ready -> Done {{ guard x >= 1; assign press = false; }};
}}
system Plate;
"""

TRAINS = """
const int N = {size};
typedef int[0, N - 1] id_t;
chan come[N], stop[N], go[N], leave[N];
process Train(const id_t id) {{
  clock x;
  state Away, Near {{ x <= 20 }}, Stopped, Starting {{ x <= 15 }}, Bridge {{ x <= 5 }};
  init Away;
  trans Away {arrow} Near {{ sync come[id]!; assign x = 0; }},
        Near -u-> Bridge {{ guard x >= 10; assign x = 0; }},
        Near -> Stopped {{ guard x <= 10; sync stop[id]?; }},
        Stopped -> Starting {{ sync go[id]?; assign x = 0; }},
        Starting -u-> Bridge {{ guard x >= 7; assign x = 0; }},
        Bridge -u-> Away {{ guard x >= 3; sync leave[id]!; }};
}}
process Gate() {{
  state Any;
  init Any;
  trans Any -> Any {{ select e : id_t; sync come[e]?; }},
        Any -> Any {{ select e : id_t; sync leave[e]?; }},
        Any -> Any {{ select e : id_t; sync stop[e]!; }},
        Any -> Any {{ select e : id_t; sync go[e]!; }};
}}
system Train, Gate;
"""

JOBS = """
const int N = {size};
const int MACHINES = 3;
typedef int[0, N - 1] id_t;
bool busy[MACHINES];
process Job(const id_t id) {{
  clock x;
  int[0, MACHINES - 1] step;
  int[0, MACHINES - 1] machine() {{ return (id + step) % MACHINES; }}
  int shortest() {{ return 1 + (2 * id + step) % 4; }}
  state Waiting, Working {{ x <= 2 * shortest() }}, Done;
  init Waiting;
  trans Waiting -> Working {{ guard !busy[machine()]; assign busy[machine()] = true, x = 0; }},
        Working {arrow} Waiting {{ guard step < MACHINES - 1 && x >= shortest();
                                   assign busy[machine()] = false, step++; }},
        Working {arrow} Done {{ guard step == MACHINES - 1 && x >= shortest();
                                assign busy[machine()] = false; }};
}}
system Job;
"""

QUEUE = """
const int N = {size};
typedef int[0, N - 1] id_t;
chan come[N], stop[N], go[N], leave[N];
int[0, N] length;
int[0, N - 1] queue[N];
void put(id_t id) {{ queue[length] = id; length++; }}
void take() {{
  int i;
  for (i = 0; i < N - 1; i++) queue[i] = queue[i + 1];
  queue[N - 1] = 0;
  length--;
}}
process Train(const id_t id) {{
  clock x;
  state Away, Near {{ x <= 20 }}, Stopped, Starting {{ x <= 15 }}, Bridge {{ x <= 5 }};
  init Away;
  trans Away {arrow} Near {{ sync come[id]!; assign x = 0; }},
        Near -u-> Bridge {{ guard x >= 10; assign x = 0; }},
        Near -> Stopped {{ guard x <= 10; sync stop[id]?; }},
        Stopped -> Starting {{ sync go[id]?; assign x = 0; }},
        Starting -u-> Bridge {{ guard x >= 7; assign x = 0; }},
        Bridge -u-> Away {{ guard x >= 3; sync leave[id]!; assign x = 0; }};
}}
process Gate() {{
  state Any;
  init Any;
  trans Any -> Any {{ select e : id_t; sync come[e]?; }},
        Any -> Any {{ select e : id_t; sync leave[e]?; }},
        Any -> Any {{ select e : id_t; sync stop[e]!; assign put(e); }},
        Any -> Any {{ guard length > 0; sync go[queue[0]]!; assign take(); }};
}}
system Train, Gate;
"""

STANDOFF = """
const int N = {size};
typedef int[0, N - 1] id_t;
bool friend_fell[N], foe_fell[N], has_drawn[N];
process Friend(const id_t id) {{
  clock x;
  id_t aim;
  state Calm, Drawing {{ x <= 3 }};
  init Calm;
  trans Calm -> Drawing {{ select e : id_t;
                           guard !friend_fell[id] && has_drawn[e] && !foe_fell[e];
                           assign aim = e, x = 0; }},
        Drawing -u-> Calm {{ guard x >= 1 && !friend_fell[id]; assign foe_fell[aim] = true; }},
        Drawing -u-> Calm {{ guard friend_fell[id]; }};
}}
process Foe(const id_t id) {{
  clock x;
  id_t aim;
  state Calm, Drawing {{ x <= 6 }}, Spent;
  init Calm;
  trans Calm {arrow} Drawing {{ select e : id_t; guard !friend_fell[e];
                                assign aim = e, x = 0, has_drawn[id] = true; }},
        Drawing -u-> Spent {{ guard x >= 4 && !foe_fell[id];
                              assign friend_fell[aim] = true, has_drawn[id] = false; }},
        Drawing -u-> Spent {{ guard foe_fell[id]; assign has_drawn[id] = false; }};
}}
system Friend, Foe;
"""

CIRCUIT = """
const int N = {size};
typedef int[0, N - 1] id_t;
bool bridge;
process Train(const id_t id) {{
  clock x;
  state Away {{ x <= 12 + 4 * id }}, Near {{ x <= 20 }}, Stopped, Starting {{ x <= 6 }},
        Bridge {{ x <= 5 }}, Crashed;
  init Away;
  trans Away {arrow} Near {{ guard x >= 6; assign x = 0; }},
        Near -u-> Bridge {{ guard x >= 10 && !bridge; assign x = 0, bridge = true; }},
        Near -u-> Crashed {{ guard x >= 10 && bridge; }},
        Near -> Stopped {{ guard x <= 10; }},
        Stopped -> Starting {{ guard !bridge; assign x = 0; }},
        Starting -u-> Bridge {{ guard x >= 4 && !bridge; assign x = 0, bridge = true; }},
        Starting -u-> Crashed {{ guard x >= 4 && bridge; }},
        Bridge -u-> Away {{ guard x >= 3; assign x = 0, bridge = false; }};
}}
system Train;
"""

PATROL = """
const int N = {size};
typedef int[0, N - 1] id_t;
id_t at;
int[0, N] seen;
bool shut[N];
process Guard() {{
  clock x;
  state Standing, Walking {{ x <= 4 }}, Home;
  init Standing;
  trans Standing -> Walking {{ guard x >= 1 && seen < N; assign x = 0; }},
        Walking -u-> Standing {{ guard x >= 2 && !shut[at];
                                 assign at = (at + 1) % N, seen++, x = 0; }},
        Walking -u-> Standing {{ guard x >= 2 && shut[at]; assign x = 0; }},
        Standing -> Home {{ guard seen == N; assign seen = 0, x = 0; }},
        Home -> Standing {{ assign x = 0; }};
}}
process Somebody() {{
  clock y;
  id_t door;
  state Idle, Holding {{ y <= 7 }};
  init Idle;
  trans Idle {arrow} Holding {{ select d : id_t; guard y >= 15;
                                assign door = d, shut[d] = true, y = 0; }},
        Holding -u-> Idle {{ guard y >= 3; assign shut[door] = false, y = 0; }};
}}
system Guard, Somebody;
"""

ONE_ON_THE_BRIDGE = (
    "control: A[] forall (i : id_t) forall (j : id_t) "
    "(Train(i).Bridge && Train(j).Bridge imply i == j)"
)

NONE_FELL = "control: A[] forall (i : id_t) not friend_fell[i]"


FIRST_AGAIN_AND_AGAIN = (
    "control: A[] ((forall (i : id_t) not Train(i).Crashed) && A<> Train(0).Bridge)"
)


@dataclass(frozen=True)
class Game:
    """A family of games with one query."""

    family: str
    variant: str
    text: str
    query: str

    def at(self, size: int) -> str:
        """The model of this size."""
        arrow = "->" if self.variant == "controllable" else "-u->"
        return self.text.format(size=size, arrow=arrow)


GAMES = [
    Game("cell", "uncontrollable", CELL, "control: A<> forall (i : id_t) Plate(i).Done"),
    Game("cell", "controllable", CELL, "control: A<> forall (i : id_t) Plate(i).Done"),
    Game("cell", "uncontrollable", CELL, "control: A[] forall (i : id_t) not Plate(i).Fallen"),
    Game("cell", "controllable", CELL, "control: A[] forall (i : id_t) not Plate(i).Fallen"),
    Game("trains", "uncontrollable", TRAINS, ONE_ON_THE_BRIDGE),
    Game("trains", "controllable", TRAINS, ONE_ON_THE_BRIDGE),
    Game("trains", "uncontrollable", TRAINS, "control: A<> Train(0).Bridge"),
    Game("trains", "controllable", TRAINS, "control: A<> Train(0).Bridge"),
    Game("jobs", "uncontrollable", JOBS, "control_t*: A<> forall (i : id_t) Job(i).Done"),
    Game("jobs", "controllable", JOBS, "control_t*: A<> forall (i : id_t) Job(i).Done"),
    Game("queue", "uncontrollable", QUEUE, ONE_ON_THE_BRIDGE),
    Game("standoff", "uncontrollable", STANDOFF, "control: A[] not friend_fell[0]"),
    Game("standoff", "uncontrollable", STANDOFF, NONE_FELL),
    Game("circuit", "uncontrollable", CIRCUIT, FIRST_AGAIN_AND_AGAIN),
    Game("patrol", "uncontrollable", PATROL, "control: A[] (true && A<> Guard.Home)"),
]


MOST_CLOCKS = 255
"""More than so many the engine does not take; each plate, train, job, friend and foe has one."""


def rows(game: Game, timeout_s: float, memory_bytes: int) -> Iterator[tuple[int, checker.Answer]]:
    """The answers by size, the last one stopped by a limit, or as large as the engine takes."""
    size = 0
    while size < MOST_CLOCKS:
        size = min(max(size + 1, size * 5 // 4), MOST_CLOCKS)
        model = checker.load(game.at(size))
        answer = model.check(game.query, timeout_s=timeout_s, memory_bytes=memory_bytes)
        yield size, answer
        if answer.verdict == "unknown":
            return


def main() -> None:
    """Prints a table for each game."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--gibibytes", type=float, default=4.0)
    parser.add_argument("--family", choices=sorted({game.family for game in GAMES}))
    arguments = parser.parse_args()
    memory_bytes = int(arguments.gibibytes * 2**30)
    for game in GAMES:
        if arguments.family not in (None, game.family):
            continue
        print(f"{game.family}, {game.variant}: {game.query}")
        print("  size  verdict          explored      stored     seconds        MiB")
        for size, answer in rows(game, arguments.seconds, memory_bytes):
            print(
                f"  {size:4}  {answer.stop or answer.verdict:<13}{answer.explored:12,}"
                f"{answer.stored:12,}{answer.seconds:12.3f}{answer.peak_bytes / 2**20:11.1f}",
                flush=True,
            )


if __name__ == "__main__":
    main()
