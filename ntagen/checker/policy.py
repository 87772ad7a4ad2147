"""Policies of others, which decide for the controller in random runs."""

from __future__ import annotations

import inspect
import math
import operator
from collections.abc import Callable, Sequence
from typing import Any, Protocol, TypedDict

import numpy as np
from numpy.typing import NDArray

from ntagen.errors import InputError

__all__ = [
    "Follower",
    "Policy",
    "Predicting",
    "Training",
    "action_number",
    "checked_wait",
    "trained_in",
]

Observation = NDArray[np.float64]
Mask = NDArray[np.int8]


class Predicting(Protocol):
    """A policy as stable-baselines3 has it."""

    def predict(
        self,
        observation: Any,  # noqa: ANN401  the packages differ in its type
        state: Any = None,  # noqa: ANN401
        episode_start: Any = None,  # noqa: ANN401
        deterministic: bool = False,
    ) -> tuple[Any, Any]:
        """The action for an observation, and the state of the policy."""


class Training(TypedDict):
    """The environment in which a policy was trained.

    It is an attribute of the observation space, ``ntagen``, since agents are saved with that. It
    has plain values only, so agents can be loaded where ntagen is not installed.
    """

    features: str
    wait: float | None
    actions: list[str]


Policy = Predicting | Callable[[Observation, Mask], Any]
"""A policy: an object with `predict`, or a function of the observation and the mask of actions."""


def action_number(action: object, count: int) -> int:
    """The number of an action.

    Args:
        action: An integer, as Python or numpy has it.
        count: How many actions there are.

    Raises:
        InputError: It is no integer, or there is no such action.
    """
    try:
        number = operator.index(action)  # type: ignore[arg-type]  # what is no integer raises
    except TypeError:
        number = -1
    if not 0 <= number < count:
        raise InputError(
            f"{action!r} is no action\nhint: an action is an integer from 0 to {count - 1}"
        )
    return number


def checked_wait(wait: float | None) -> None:
    """Sees that a time to wait is positive.

    Raises:
        InputError: It is not.
    """
    if wait is not None and (math.isnan(wait) or wait <= 0):
        raise InputError(f"wait={wait}: it must be a positive number of units of time")


def trained_in(policy: object) -> Training | None:
    """The environment of ntagen in which a policy was trained; ``None`` if it does not say so."""
    training = getattr(getattr(policy, "observation_space", None), "ntagen", None)
    return training if isinstance(training, dict) else None  # type: ignore[return-value]


class Follower:
    """Asks a policy, in the form in which the engine asks.

    Attributes:
        is_asked: Whether the policy is deciding.
    """

    def __init__(self, policy: Policy) -> None:
        predict = getattr(policy, "predict", None)
        if predict is None and not callable(policy):
            raise InputError(
                f"{policy!r} is no policy\n"
                "hint: give an object with predict(observation, deterministic=True), or a "
                "function of the observation and the mask of actions"
            )
        self._policy: Any = policy
        self._predict: Any = predict
        # Policies of sb3-contrib take a mask.
        self._is_masked = predict is not None and (
            "action_masks" in inspect.signature(predict).parameters
        )
        self._raised: BaseException | None = None
        self.is_asked = False

    def taken(self) -> BaseException | None:
        """What the policy raised since this was last asked."""
        raised, self._raised = self._raised, None
        return raised

    def __call__(self, values: Sequence[float], possible: Sequence[bool]) -> int:
        """The number of an action, for what is seen and what is possible."""
        self.is_asked = True
        try:
            return action_number(self._action(values, possible), len(possible))
        except BaseException as error:
            self._raised = error
            raise
        finally:
            self.is_asked = False

    def _action(self, values: Sequence[float], possible: Sequence[bool]) -> object:
        observation = np.array(values, dtype=np.float64)
        if self._predict is None:
            return self._policy(observation, np.array(possible, dtype=np.int8))
        masks = {"action_masks": np.array(possible)} if self._is_masked else {}
        action, _ = self._predict(observation, deterministic=True, **masks)
        return action
