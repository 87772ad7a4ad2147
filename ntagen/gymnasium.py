"""A model as a Gymnasium environment: random runs in which an agent decides for the controller.

It needs the package gymnasium: ``pip install 'ntagen[gymnasium]'``. An example::

    import ntagen

    env = ntagen.gymnasium.Environment("leave.xta", "minE(cost)[<=6] {} -> {x}: <> Guest.Done")
    observation, info = env.reset(seed=1)
    observation, reward, terminated, truncated, info = env.step(0)
"""

from __future__ import annotations

import itertools
import math
import os
from collections.abc import Sequence
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

import ntagen
from ntagen.checker.policy import Training, action_number
from ntagen.checker.stepwise import Moment
from ntagen.errors import InputError
from ntagen.loading import load

try:
    import gymnasium
except ImportError as error:
    raise InputError(
        "environments need the package gymnasium, which is not installed\n"
        "hint: pip install 'ntagen[gymnasium]'"
    ) from error

__all__ = ["Environment"]

_SEEDS: Final = 2**64

_NO_RUN: Final = "there is no run\nhint: call reset() first, and after each end of a run"


class Environment(gymnasium.Env[NDArray[np.float64], np.int64]):
    """Random runs of a model, in which an agent decides for the controller.

    Between two decisions the model runs as in every random run, with its delays, branches and
    random numbers. When one of the controller's moves can be taken, the agent is asked:

    * The *action* is the number of a move, as in `LearnedStrategy.actions`, or the last one:
      ``WAIT``. An action that is not possible is replaced by one that is, drawn with equal chances.
    * The *observation* has the features of the query: the exact ones, then those in intervals.
      Without features it is the whole state, as learning sees it.
    * The *reward* is what was added to the value of the run, less what it was worth before; for
      ``minE`` and ``minPr`` its negative. The first reward also has the value at the beginning, so
      the rewards of a run add up to its value at the end, or to the negative of it.
    * A run is *terminated* where the goal holds, and *truncated* at the bound.

    After ``WAIT``, if a clock is among the features, the agent is asked again when something has
    happened, or after `wait`. Else a delay is drawn for the controller's moves as for all others,
    the agent is asked when it is over, and ``WAIT`` lets the moment pass.

    The ``info`` of `reset` and `step` has ``action_mask`` (which actions are possible), ``actions``
    (their texts), ``time`` (how long the run has lasted), and ``replaced`` (whether the last action
    was not possible). If a run ends before anything is decided, only ``WAIT`` is possible at its
    end, and the first step ends it.

    Runs depend on the seed and the actions only. Run k after ``reset(seed=s)`` has the random
    numbers that run k of every query with ``seed=s`` has. An interruption (Ctrl-C) closes the
    environment.

    Attributes:
        actions: The texts of all actions; the last one is ``WAIT``.
        discrete: The texts of what is seen exactly.
        continuous: The texts of what is seen in intervals.
    """

    metadata: dict[str, Any] = {"render_modes": []}  # noqa: RUF012  Gymnasium's form

    def __init__(
        self,
        model: ntagen.Model | str | os.PathLike[str],
        query: str,
        *,
        wait: float | None = None,
        strategies: Sequence[str] = (),
    ) -> None:
        """Loads the model, and reads the query.

        Args:
            model: The model, or what `ntagen.load` takes. Later changes of it do not matter here.
            query: The query for the best strategy, without a name: ``minE(price)[<=bound]
                {exact} -> {intervals}: <> goal``, or ``maxE``, ``minPr``, ``maxPr``. If it ends in
                ``under S``, only what S allows is possible.
            wait: After how many units of time the agent is asked again at the latest, if a clock
                is among the features: else a hundredth of the bound.
            strategies: The queries that define S, such as ``strategy S = control: A[] p``, or a
                shield: ``strategy S = acontrol: A[] p { x[0,9]:9 }``.

        Raises:
            RejectedError: The model or a query is wrong, or nothing is there to be decided.
            InputError: The file cannot be read, or `wait` is no positive number.
        """
        loaded = model if isinstance(model, ntagen.Model) else load(os.fspath(model))
        self._runs = loaded.stepwise(query, strategies=strategies, wait=wait)
        self._sign = 1.0 if self._runs.maximises else -1.0
        self.actions = self._runs.actions
        self.discrete, self.continuous = self._runs.discrete, self._runs.continuous
        self.action_space = gymnasium.spaces.Discrete(len(self.actions))
        count = len(self.discrete) + len(self.continuous)
        self.observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (count,), np.float64)
        # Agents are saved with the space of what they see, so their files know where they belong.
        vars(self.observation_space)["ntagen"] = Training(
            features=f"{{{', '.join(self.discrete)}}} -> {{{', '.join(self.continuous)}}}",
            wait=self._runs.wait if math.isfinite(self._runs.wait) else None,
            actions=list(self.actions),
        )
        self._moment: Moment | None = None
        self._worth = 0.0
        self._seed: int | None = None
        self._run = 0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float64], dict[str, Any]]:
        """Begins a run, and goes on until the agent is asked.

        Args:
            seed: The seed of this run and of those that follow; without it the next run begins.
            options: They mean nothing here.

        Raises:
            RejectedError: The run fails.
            InputError: The environment is closed.
        """
        super().reset(seed=seed)
        if seed is not None or self._seed is None:
            drawn = int(self.np_random.integers(_SEEDS // 2)) if seed is None else seed
            self._seed, self._run = drawn % _SEEDS, 0
        else:
            self._run += 1
        self._worth = 0.0
        self._moment = None
        self._moment = self._runs.begin(self._seed, self._run)
        return self._seen(self._moment, is_replaced=False)

    def step(
        self,
        action: Any,  # noqa: ANN401  packages give numbers of several types
    ) -> tuple[NDArray[np.float64], float, bool, bool, dict[str, Any]]:
        """Decides, and goes on until the agent is asked again, or the run ends.

        Raises:
            InputError: This is no action, or there is no run.
            RejectedError: The run fails.
        """
        before = self._moment
        if before is None:
            raise InputError(_NO_RUN)
        number = action_number(action, len(self.actions))
        self._moment = None
        moment = before
        if before.end is None:
            moment = self._runs.act(number)
        reward = self._sign * (moment.worth - self._worth) + 0.0  # no zero has a sign
        self._worth = moment.worth
        self._moment = moment if moment.end is None else None
        observation, info = self._seen(moment, is_replaced=not before.possible[number])
        return observation, reward, moment.end == "goal", moment.end == "bound", info

    def action_masks(self) -> NDArray[np.bool_]:
        """Which actions are possible now, as sb3-contrib asks for it.

        Raises:
            InputError: There is no run.
        """
        if self._moment is None:
            raise InputError(_NO_RUN)
        return np.array(self._moment.possible)

    def close(self) -> None:
        """Gives back what the environment takes; it can make no more runs."""
        self._runs.close()
        self._moment = None

    def _seen(
        self, moment: Moment, *, is_replaced: bool
    ) -> tuple[NDArray[np.float64], dict[str, Any]]:
        possible = moment.possible
        info = {
            "action_mask": np.array(possible, dtype=np.int8),
            "actions": tuple(itertools.compress(self.actions, possible)),
            "time": moment.time,
            "replaced": is_replaced,
        }
        return np.array(moment.values, dtype=np.float64), info
