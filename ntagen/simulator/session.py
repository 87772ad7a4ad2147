"""A simulation: what its page may ask for, and what the page shows then.

A request is an object with ``do``; `Session.answer` says what comes back. Most answers are views:
the state that is shown, its moves, and the steps that the page does not have yet. ``keep`` in a
view is what must be kept to take the simulation up again in another process, by ``restore``.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Mapping
from typing import Any, Final

from ntagen.checker import Model
from ntagen.checker.queries import form_of
from ntagen.checker.strategy import Strategy
from ntagen.errors import InputError, NtagenError
from ntagen.simulator import drawings, random_runs, traces
from ntagen.simulator.courses import Course, ExactCourse, SymbolicCourse, zone_of
from ntagen.simulator.following import Timed, followed, merged, timed
from ntagen.simulator.games import Adviser, GameCourse
from ntagen.simulator.history import History
from ntagen.simulator.network import Network
from ntagen.simulator.views import view

Request = Mapping[str, Any]
Answer = dict[str, Any]

_SILENT: Final = 100
"""So many moves of a strategy in a row are made without a choice for the user."""

_NO_TIMES: Final = (
    "no exact times were found for these moves\n"
    "hint: begin again in the concrete mode, and choose delays by hand"
)


class Session:
    """The simulation of a model."""

    def __init__(self, model: Model, *, timeout_s: float | None, memory_bytes: int | None) -> None:
        """Begins in the initial state, with symbolic states.

        Raises:
            InputError: The model can only make random runs.
            ModelError: The initial state cannot be computed.
        """
        self._model = model
        self._timeout_s, self._memory_bytes = timeout_s, memory_bytes
        self._network = Network(model)
        self._strategies: dict[str, Strategy] = {}
        self._adviser: Adviser | None = None
        self._game = ""
        self._note = ""
        self._history = History(self._begin("symbolic"))
        self._asked: dict[str, Callable[[Request], Answer]] = {
            "open": lambda _: self._opened(),
            "restore": self._restored,
            "go": self._go,
            "take": self._take,
            "random": self._random,
            "mode": self._change_mode,
            "restart": lambda _: self._restart(),
            "load": self._load,
            "save": lambda _: self._saved(),
            "play": self._play,
            "advise": self._advise,
            "zone": self._zone,
            "chart": self._chart,
            "series": self._series,
            "runs": self._runs,
        }

    def answer(self, request: Request) -> Answer:
        """Does what is asked for.

        Raises:
            InputError: The request is wrong, or is not possible in the state.
            LimitError: A limit was reached.
            ModelError: The model fails in the step.
        """
        wanted = request.get("do")
        if not isinstance(wanted, str) or wanted not in self._asked:
            raise InputError("a simulation does no such thing")
        return self._asked[wanted](request)

    def _begin(self, mode: str) -> Callable[[], Course]:
        """What makes a course of a mode in the initial state."""
        if mode == "game":
            strategy = self._strategy(self._game)
            return lambda: GameCourse(strategy, self._network)
        if mode not in ("symbolic", "exact"):
            raise InputError("there is no such mode")
        kind = SymbolicCourse if mode == "symbolic" else ExactCourse
        return lambda: kind(self._model, self._network)

    def _view(self, known: int | None = None) -> Answer:
        """What the page shows; it has `known` steps of the way, by default all but the last."""
        history = self._history
        known = len(history.entries) - 2 if known is None else known
        found = view(history, max(0, min(known, len(history.entries) - 1)), self._adviser)
        is_last = history.position == len(history.entries) - 1
        found["note"] = self._note if is_last else ""
        found["keep"] |= {
            "game": self._game,
            "advised": "" if self._adviser is None else self._adviser.query,
            "note": self._note,
        }
        return found

    def _opened(self) -> Answer:
        """All that the page needs to begin."""
        model = self._model
        queries = []
        for query in model.queries:
            form = form_of(query.text)
            if form is not None and (form.is_game or form.kind == "simulate"):
                queries.append({"text": query.text.strip(), "is_game": form.is_game})
        network = self._network.described()
        return {"model": network | {"queries": queries}, "view": self._view(0)}

    def _go(self, request: Request) -> Answer:
        position = request.get("position")
        if not isinstance(position, int):
            raise InputError("there is no such step")
        self._history.go(position)
        return self._view(len(self._history.entries) - 1)

    def _take(self, request: Request) -> Answer:
        return self._stepped({name: request.get(name) for name in ("move", "delay", "wait")})

    def _stepped(self, choice: dict[str, Any]) -> Answer:
        before = self._history.position
        self._history.do(choice)
        self._note = ""
        self._let_strategy_act()
        return self._view(before)

    def _let_strategy_act(self) -> None:
        """Makes the strategy's moves as long as it acts at once and the user has no choice."""
        for _ in range(_SILENT):
            course = self._history.course()
            if not isinstance(course, GameCourse) or not course.must_follow():
                break
            self._history.do({"wait": True})

    def _random(self, request: Request) -> Answer:
        """A random step; the same seed makes the same one in the same place."""
        chance = random.Random(f"{request.get('seed')}:{self._history.position}")
        course = self._history.course()
        if isinstance(course, GameCourse):
            choice = course.at_random(chance.getrandbits(32))
            return self._stepped(choice) if choice is not None else self._view()
        moves = self._history.offer().moves
        if not moves:
            return self._view(len(self._history.entries) - 1)
        index = chance.randrange(len(moves))
        windows = moves[index].windows
        delay = None if windows is None else str(chance.choice(windows).chosen(chance))
        return self._stepped({"move": index, "delay": delay})

    def _replaced(self, history: History, note: str = "") -> Answer:
        self._history, self._note = history, note
        return self._view(0)

    def _restart(self) -> Answer:
        return self._replaced(History(self._begin(self._history.mode)))

    def _change_mode(self, request: Request) -> Answer:
        """Symbolic states or exact times; the moves on the way stay the same."""
        mode, old = request.get("mode"), self._history
        if mode not in ("symbolic", "exact"):
            raise InputError("there is no such mode")
        found = followed(self._begin(mode), self._network, self._steps(mode == "exact"))
        found.go(old.position)
        return self._replaced(found, self._note)

    def _load(self, request: Request) -> Answer:
        trace = traces.read(str(request.get("text", "")), self._network)
        begin = self._begin("exact" if trace.is_exact else "symbolic")
        history = followed(begin, self._network, trace.steps)
        history.go(0)
        return self._replaced(history, trace.note)

    def _saved(self) -> Answer:
        history = self._history
        course = history.course()
        if isinstance(course, GameCourse):
            at = history.position
            history.go(len(history.entries) - 1)
            last = history.course()
            history.go(at)
            text = last.trace_json() if isinstance(last, GameCourse) else None
            if text is None:
                raise InputError("a trace cannot express the times of this play: too fine")
            return {"text": text}
        if history.mode == "symbolic":
            history = followed(self._begin("exact"), self._network, self._steps(True))
        return {"text": traces.written(history.entries, self._network)}

    def _steps(self, is_exact: bool) -> list[Timed]:
        """The moves of the history, without times or with them.

        Raises:
            InputError: No times were found.
        """
        steps = merged(self._history)
        if not is_exact:
            return [(parts, None) for parts, _ in steps]
        if self._history.mode != "symbolic":
            return steps
        moves = [parts for parts, _ in steps]
        delays = timed(self._begin("exact"), self._network, moves)
        if delays is None:
            raise InputError(_NO_TIMES)
        return list(zip(moves, delays, strict=True))

    def _strategy(self, query: str) -> Strategy:
        """The winner's strategy of a game."""
        if query not in self._strategies:
            form = form_of(query)
            if form is None and query.strip():
                # It is no query at all; the engine says where it goes wrong.
                self._model.check(query, timeout_s=self._timeout_s)
            if form is None or not form.is_game:
                raise InputError(
                    f"{query.strip() or 'this'} is no game\n"
                    "hint: give a query such as control: A<> Gate.Open"
                )
            self._strategies[query] = self._model.synthesize(
                query, timeout_s=self._timeout_s, memory_bytes=self._memory_bytes
            )
        return self._strategies[query]

    def _play(self, request: Request) -> Answer:
        """Begins a play against the winner's strategy."""
        game, self._game = self._game, str(request.get("query", ""))
        try:
            history = History(self._begin("game"))
        except NtagenError:
            self._game = game
            raise
        self._history, self._note, self._adviser = history, "", None
        self._let_strategy_act()
        return self._view(0)

    def _advise(self, request: Request) -> Answer:
        """Says from now on what a strategy allows; without a query, it does not any more."""
        query = str(request.get("query") or "")
        adviser = Adviser(self._strategy(query), self._network) if query else None
        if adviser is not None and self._history.mode != "exact":
            self._change_mode({"mode": "exact"})
        self._adviser = adviser
        return self._view(0)

    def _zone(self, request: Request) -> Answer:
        zone = zone_of(self._history.here.state)
        if zone is None:
            raise InputError("a state with exact clock values has no zone")
        x, y = str(request.get("x")), str(request.get("y"))
        return drawings.zone(zone, self._network.clocks, x, y)

    def _chart(self, request: Request) -> Answer:
        kind = "gantt" if request.get("kind") == "gantt" else "sequence"
        return {"svg": drawings.chart(kind, self._history.entries, self._network)}

    def _series(self, request: Request) -> Answer:
        names = request.get("names")
        if not isinstance(names, list) or not all(isinstance(one, str) for one in names):
            raise InputError("no variables are chosen")
        runs_on = "stopwatches" not in self._model.features
        return drawings.series(names, self._history.entries, runs_on=runs_on)

    def _runs(self, request: Request) -> Answer:
        query, seed, count = (request.get(name) for name in ("query", "seed", "count"))
        if not isinstance(query, str) or not isinstance(seed, int) or not isinstance(count, int):
            raise InputError("the query, the seed or the number of runs is missing")
        return random_runs.block(self._model, query, seed, count, self._timeout_s)

    def _restored(self, request: Request) -> Answer:
        """Takes up what ``keep`` says of a simulation."""
        self._game = str(request.get("game", ""))
        history = History(self._begin(str(request.get("mode"))))
        for choice in request.get("choices", ()):
            history.do(choice)
        history.go(int(request.get("position", 0)))
        if advised := str(request.get("advised", "")):
            self._adviser = Adviser(self._strategy(advised), self._network)
        return self._replaced(history, str(request.get("note", "")))
