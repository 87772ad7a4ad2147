"""A play of a game with its user: what is shown, and what the user may type."""

from __future__ import annotations

import shlex
from collections.abc import Callable, Sequence
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Final

from ntagen.checker.play import ENDINGS, delay_from, forecast
from ntagen.cli.terminal import Styled, echo
from ntagen.errors import InputError, NtagenError
from ntagen.files import write_files

if TYPE_CHECKING:
    from ntagen.checker.play import Chance, Play, Reply, Situation
    from ntagen.checker.runs import Edge, State
    from ntagen.checker.strategy import Strategy

VALUES_SHOWN: Final = 24
"""With more variables than this, only those that changed are shown; ``s`` shows all."""

CHOICES_SHOWN: Final = 40
"""At most this many moves are listed; ``m`` lists all."""

SILENT_MOVES: Final = 100
"""After this many moves of the strategy in a row without a choice for the user, play pauses."""

HELP: Final = """\
  2          make move 2, as soon as it is possible
  2 3/2      make move 2 after a delay of 3/2
  Enter, w   only wait, until the strategy acts or something is decided;
             where you have to make a move and there is only one, make it
  w 1/2      only wait for 1/2
  +1, +1 2   let the strategy make its allowed move 1 (after 2)
  u          undo: back to your last choice
  r          restart
  s          show the whole state
  m          show all moves
  log FILE   write the play as a trace that `ntagen verify` checks
  q          quit"""


class Session:
    """A play with its user."""

    def __init__(self, strategy: Strategy) -> None:
        self._strategy = strategy
        self._play: Play = strategy.play()
        self._rival = "environment" if strategy.winning else "controller"
        self._time = Fraction(0)
        self._shown: State | None = None
        # The lengths and times of the play to which the user can go back.
        self._marks: list[tuple[int, Fraction]] = []
        self._ending: str | None = None
        self._silent = 0
        self.is_defeated = False
        echo(strategy.query)
        echo(
            f"The strategy is the {strategy.owner}'s; you are the {self._rival}."
            + ("" if strategy.winning else " The controller cannot win: see why.")
        )

    def converse(self, read: Callable[[], str | None]) -> None:
        """Plays with the user until they quit or the input ends."""
        echo("Type ? for help.")
        while True:
            situation = self._play.situation()
            if self._is_over(situation):
                echo(f"{self._ending} (u undo, r restart, q quit)")
            elif self._goes_on_silently(situation):
                self._follow(situation)
                continue
            else:
                self._show(situation)
            if not self._obey(read, situation):
                return

    def play_at_random(self, steps: int, chance: Chance) -> None:
        """Plays with random moves for the side of the user."""
        for _ in range(steps):
            situation = self._play.situation()
            if self._is_over(situation):
                break
            self._show_state()
            chosen = chance.choose(situation)
            if chosen is None:
                self._wait(situation)
            else:
                self._make(situation, *chosen)
            if self._ending is not None:
                break
        self._is_over(self._play.situation())
        self._show_state()
        echo(self._ending or f"{steps} steps are played; nobody has won yet.")

    def write(self, path: Path) -> None:
        """Writes the play as a trace."""
        text = self._play.trace_json()
        if text is None:
            raise InputError("a trace cannot express the times of this play: they are too fine")
        write_files({path: f"{text}\n"})
        echo(f"play written to {path}")

    def _is_over(self, situation: Situation) -> bool:
        """Whether play has ended; if so, remembers how."""
        if self._ending is None:
            then = situation.next
            if situation.winner is not None:
                self._end(then.why, situation.winner)
            elif then.kind == "fails" and then.delay == 0 and not situation.replies:
                self._fail(then.why)
        return self._ending is not None

    def _end(self, why: str, winner: str) -> None:
        self.is_defeated = winner != self._strategy.owner
        whose = "you have won against the strategy" if self.is_defeated else "the strategy has won"
        reason = ENDINGS[why]
        self._ending = (
            f"{reason[0].upper()}{reason[1:]}: the {winner} has won after {self._time}; {whose}."
        )

    def _fail(self, why: str) -> None:
        self.is_defeated = True
        self._ending = f"The strategy has no next move: {why}."

    def _goes_on_silently(self, situation: Situation) -> bool:
        """Whether the strategy acts at once and the user has no choice."""
        then = situation.next
        is_silent = then.kind == "acts" and then.delay == 0 and not situation.replies
        return is_silent and self._silent < SILENT_MOVES

    def _show(self, situation: Situation) -> None:
        self._silent = 0
        self._show_state()
        if situation.goal:
            echo("  the goal holds now")
        echo(f"  {self._forecast(situation)}")
        self._show_moves(situation, CHOICES_SHOWN)

    def _show_state(self, whole: bool = False) -> None:
        state, before = self._play.state, None if whole else self._shown
        places = {f"{name}.{place}" for name, place in before.locations.items()} if before else ()
        locations = [f"{name}.{place}" for name, place in state.locations.items()]
        if len(locations) > VALUES_SHOWN:
            locations = _changed(locations, [one for one in locations if one not in places], before)
        variables = [f"{name}={value}" for name, value in state.variables.items()]
        if len(variables) > VALUES_SHOWN:
            changed = [
                f"{name}={value}"
                for name, value in state.variables.items()
                if before and before.variables[name] != value
            ]
            variables = variables if whole else _changed(variables, changed, before)
        clocks = [f"{name}={value}" for name, value in state.clocks.items()]
        echo(Styled(f"[{len(self._play)}] time {self._time}", bold=True))
        for line in (locations, variables, clocks):
            if line:
                echo(f"  {' '.join(line)}")
        self._shown = state

    def _forecast(self, situation: Situation) -> str:
        """Says what happens if the user only waits."""
        return forecast(situation.next, self._strategy.owner, _move)

    def _show_moves(self, situation: Situation, most: int | None) -> None:
        self._list(situation.replies, "", most)
        if not situation.replies:
            echo("  you have no move; press Enter to go on")
        if situation.allowed:
            echo(f"  the {self._strategy.owner} may also")
            self._list(situation.allowed, "+", most)

    def _list(self, moves: Sequence[Reply], sign: str, most: int | None) -> None:
        names = [_move(one.edges) for one in moves]
        for index, one in enumerate(moves[:most]):
            name = names[index]
            if names.count(name) > 1:
                name += _labels(one.edges)
            number = Styled(f"{sign}{index + 1}".rjust(3), bold=True)
            echo("  ", number, f"  {name}   {', or '.join(map(str, one.windows))}")
        if most is not None and len(moves) > most:
            echo(f"  … {len(moves) - most} more: m shows all")

    def _obey(self, read: Callable[[], str | None], situation: Situation) -> bool:
        """Reads commands until one changes the play; false if the user quits."""
        while True:
            line = read()
            if line is None:
                return False
            try:
                if (is_played := self._obeyed(_words(line), situation)) is not None:
                    return is_played
            except NtagenError as error:
                echo(str(error))

    def _obeyed(self, words: Sequence[str], situation: Situation) -> bool | None:
        """Obeys a command; whether the play goes on, or ``None`` if it has not changed."""
        name = words[0] if words else "w"
        match name:
            case "q" | "quit" | "exit":
                return False
            case "?" | "h" | "help":
                echo(HELP)
            case "s":
                self._show_state(whole=True)
            case "m":
                self._show_moves(situation, None)
            case "log":
                self.write(Path(" ".join(words[1:]) or "play.json"))
            case "u" | "r":
                self._back(everything=name == "r")
                return True
            case _ if self._ending is not None:
                echo("the play is over: u undo, r restart, q quit")
            case _:
                self._step(situation, words)
                return True
        return None

    def _step(self, situation: Situation, words: Sequence[str]) -> None:
        """Makes the move, or waits, as the user typed."""
        if len(words) > 2:
            raise InputError(f"{' '.join(words)} is not a command; type ? for help")
        delay = delay_from(words[1]) if len(words) == 2 else None
        mark = (len(self._play), self._time)
        if not words or words[0] == "w":
            if delay is None:
                self._wait(situation)
            elif delay not in situation.waits:
                raise InputError(f"you cannot wait so long: {self._forecast(situation)}")
            else:
                self._pass(delay)
        else:
            move = _meant(situation, words[0])
            if delay is None:
                delay = move.windows[0].soon()
            elif not any(delay in window for window in move.windows):
                windows = ", or ".join(map(str, move.windows))
                raise InputError(f"this move is possible {windows}")
            self._make(situation, move, delay)
        self._marks.append(mark)

    def _make(self, situation: Situation, move: Reply, delay: Fraction) -> None:
        if move in situation.replies:
            self._play.reply(situation.replies.index(move), delay)
            who = "you take"
        else:
            self._play.allow(situation.allowed.index(move), delay)
            who = f"the {self._strategy.owner} takes"
        self._time += delay
        echo(f"  · {_after(delay)}{who} {_move(move.edges)}")

    def _pass(self, delay: Fraction) -> None:
        self._play.wait(delay)
        self._time += delay
        if delay:
            echo(f"  · {delay} passes")

    def _wait(self, situation: Situation) -> None:
        """Waits until something happens."""
        then = situation.next
        if then.kind == "acts":
            self._follow(situation)
        elif then.kind == "must" and len(situation.replies) == 1:
            only = situation.replies[0]
            self._make(situation, only, only.windows[-1].soon())
        elif then.kind == "must":
            raise InputError("you must move before time stops: choose one of your moves")
        else:
            self._pass(then.delay or Fraction(0))
            if then.kind == "fails":
                self._fail(then.why)
            elif then.winner is not None:
                self._end(then.why, then.winner)

    def _follow(self, situation: Situation) -> None:
        """Lets the strategy act."""
        then = situation.next
        self._play.follow()
        delay = then.delay or Fraction(0)
        self._time += delay
        self._silent += 1
        echo(f"  · {_after(delay)}the {self._strategy.owner} takes {_move(then.edges)}")

    def _back(self, everything: bool) -> None:
        if everything:
            self._marks.clear()
        length, self._time = self._marks.pop() if self._marks else (0, Fraction(0))
        self._play.undo(length)
        self._ending, self._shown, self.is_defeated = None, None, False
        self._silent = 0


def _meant(situation: Situation, word: str) -> Reply:
    """The move with the number that the user typed."""
    moves = situation.allowed if word.startswith("+") else situation.replies
    number = word.removeprefix("+")
    if not number.isdecimal():
        raise InputError(f"{word} is not a command; type ? for help")
    if not 1 <= int(number) <= len(moves):
        raise InputError(f"there is no move {word}")
    return moves[int(number) - 1]


def _words(line: str) -> list[str]:
    try:
        return shlex.split(line)
    except ValueError:
        return line.split()


def _changed(every: list[str], changed: list[str], before: State | None) -> list[str]:
    """The entries of a long list that are shown."""
    if before is None:
        return [f"{len(every)} values (s shows them)"]
    rest = len(changed) - VALUES_SHOWN
    more = [f"… and {rest} more changes (s shows all)"] if rest > 0 else []
    return changed[:VALUES_SHOWN] + more


def _after(delay: Fraction) -> str:
    return f"after {delay} " if delay else ""


def _move(edges: Sequence[Edge]) -> str:
    """A move on one line: the edges that are taken together."""
    return " | ".join(map(_edge, edges))


def _edge(edge: Edge) -> str:
    select = "".join(f" {name}={value}" for name, value in edge.select.items())
    sync = f" {edge.sync}" if edge.sync else ""
    return f"{edge.process}.{edge.source} -> {edge.target}{sync}{select}"


def _labels(edges: Sequence[Edge]) -> str:
    """Guards and updates, to tell moves apart that look the same otherwise."""
    labels = "; ".join(label for edge in edges for label in (edge.guard, edge.update) if label)
    return f" {{ {labels} }}" if labels else ""
