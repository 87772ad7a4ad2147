"""The driver's state machine: the paper's workflow (section 3.1) as a table.

::

                       initial push
                        │        ▲ first time
                        ▼        │
    arm ───────────▶ estimate ─▶ synthesise ─▶ execute ⇄ monitor
                        ▲            │             │  deviation, force
                        │            │ from farther back             ▼
                        └── push ◀── pull back ◀─────────────────── stop

From `monitor` the way leads back to `estimate` too, when the rest of the plan no longer holds for
the newest estimate, or has little reserve: then a new plan is made where the needle is.

The initial push belongs to a plan: the first synthesis is made before anything moves. Only if it
finds no plan, and the push is proven to be free of known regions, it is made without one: what it
tells about the needle may give a plan.

In a tissue that answers, a strategy may be followed instead of plans: then `synthesise` leads to
`execute` at once, and the end of a branch to the target. Where no branch fits any more, the way
leads to `estimate`, and plans follow, or the run ends. Where a strategy wins against all that the
estimate leaves open, `execute` follows it instead of the plan, and its end leads to `estimate`.

A run that goes on from a log begins with `resume` instead of `arm`: the needle is found in its
channel, and the operator is asked. Then the way leads to `estimate`, or to `retreat`: the needle is
pulled back to the entry, and the run is over.

Each state is a task that ends with one of its events; the table gives the next state. `EVENTS`
lists the events of each state, and `TRANSITIONS` has exactly one entry for each pair of state and
event: nothing is undefined. Time-out, device fault and interruption can end every task; each has
its own final state, with the needle stopped. That there is no plan has three final states: the
model has none, none holds in exact kinematics, or none can end in time.
"""

from __future__ import annotations

from enum import Enum, unique
from typing import Final


@unique
class State(Enum):
    """The current task of the driver, or the end of the run."""

    ARM = "arm"
    RESUME = "resume"
    INITIAL_PUSH = "initial push"
    ESTIMATE = "estimate"
    SYNTHESISE = "synthesise"
    EXECUTE = "execute"
    MONITOR = "monitor"
    STOP = "stop"
    PULL_BACK = "pull back"
    PUSH = "push"
    RETREAT = "retreat"

    TARGET_REACHED = "target reached"
    NO_STRATEGY = "no strategy"
    NONE_HOLDS = "no strategy that holds"
    NO_TIME_LEFT = "no strategy in the time left"
    NOT_GUARANTEED = "no longer guaranteed"
    TIMED_OUT = "time-out"
    FAULTED = "device fault"
    INTERRUPTED = "interrupted"
    PULLED_OUT = "pulled back"


@unique
class Event(Enum):
    """The end of a task."""

    ARMED = "armed"
    PUSHED = "pushed"
    ESTIMATED = "estimated"
    IN_TARGET = "in the last target"
    FIRST_STRATEGY = "strategy from the entry"
    PUSH_IS_FREE = "no strategy from the entry, and the first push is free of known regions"
    STRATEGY_FOUND = "strategy found"
    STRATEGY_BEHIND = "strategy from farther back"
    NO_STRATEGY = "no strategy, even from the entry"
    NONE_HOLDS = "no strategy that holds, even from the entry"
    NO_TIME_LEFT = "no strategy that ends in time"
    TREE_FOUND = "strategy against the tissue"
    NOT_GUARANTEED = "the guarantee has ended"
    OFF_TREE = "on no branch of the strategy"
    TREE_DONE = "the branch ends in the target"
    ACTED = "acted"
    PLAN_DONE = "plan done"
    OUT_OF_STEP = "out of step with the breath"
    AS_PREDICTED = "as predicted"
    DEVIATION = "deviation"
    PLAN_FAILS = "the plan no longer holds"
    PLAN_IS_THIN = "the plan has little reserve"
    FORCE = "force"
    STOPPED = "stopped"
    PULLED = "pulled"
    GOES_ON = "goes on"
    ONLY_BACK = "only back"
    IS_OUT = "at the entry"

    TIMED_OUT = "time-out"
    FAULT = "device fault"
    INTERRUPT = "interrupt"


ABORTS: Final = {
    Event.TIMED_OUT: State.TIMED_OUT,
    Event.FAULT: State.FAULTED,
    Event.INTERRUPT: State.INTERRUPTED,
}
"""The events that can end every task, and the states to which they lead."""

_WORKFLOW: Final = {
    (State.ARM, Event.ARMED): State.ESTIMATE,
    (State.SYNTHESISE, Event.FIRST_STRATEGY): State.INITIAL_PUSH,
    (State.SYNTHESISE, Event.PUSH_IS_FREE): State.INITIAL_PUSH,
    (State.INITIAL_PUSH, Event.PUSHED): State.ESTIMATE,
    (State.INITIAL_PUSH, Event.FORCE): State.STOP,
    (State.ESTIMATE, Event.ESTIMATED): State.SYNTHESISE,
    (State.ESTIMATE, Event.IN_TARGET): State.TARGET_REACHED,
    (State.SYNTHESISE, Event.STRATEGY_FOUND): State.EXECUTE,
    (State.SYNTHESISE, Event.STRATEGY_BEHIND): State.PULL_BACK,
    (State.SYNTHESISE, Event.NO_STRATEGY): State.NO_STRATEGY,
    (State.SYNTHESISE, Event.NONE_HOLDS): State.NONE_HOLDS,
    (State.SYNTHESISE, Event.NO_TIME_LEFT): State.NO_TIME_LEFT,
    (State.SYNTHESISE, Event.TREE_FOUND): State.EXECUTE,
    (State.SYNTHESISE, Event.NOT_GUARANTEED): State.NOT_GUARANTEED,
    (State.EXECUTE, Event.TREE_DONE): State.TARGET_REACHED,
    (State.MONITOR, Event.OFF_TREE): State.ESTIMATE,
    (State.MONITOR, Event.NOT_GUARANTEED): State.NOT_GUARANTEED,
    (State.EXECUTE, Event.ACTED): State.MONITOR,
    (State.EXECUTE, Event.PLAN_DONE): State.ESTIMATE,
    (State.EXECUTE, Event.OUT_OF_STEP): State.ESTIMATE,
    (State.MONITOR, Event.AS_PREDICTED): State.EXECUTE,
    (State.MONITOR, Event.DEVIATION): State.STOP,
    (State.MONITOR, Event.FORCE): State.STOP,
    (State.MONITOR, Event.PLAN_FAILS): State.ESTIMATE,
    (State.MONITOR, Event.PLAN_IS_THIN): State.ESTIMATE,
    (State.MONITOR, Event.IN_TARGET): State.ESTIMATE,
    (State.STOP, Event.STOPPED): State.PULL_BACK,
    (State.PULL_BACK, Event.PULLED): State.PUSH,
    (State.PUSH, Event.PUSHED): State.ESTIMATE,
    (State.PUSH, Event.FORCE): State.STOP,
    (State.RESUME, Event.GOES_ON): State.ESTIMATE,
    (State.RESUME, Event.ONLY_BACK): State.RETREAT,
    (State.RETREAT, Event.IS_OUT): State.PULLED_OUT,
}

ENDS: Final = frozenset(State) - {state for state, _ in _WORKFLOW}
"""The states in which the run is over."""

TRANSITIONS: Final = _WORKFLOW | {
    (state, event): end for state in State if state not in ENDS for event, end in ABORTS.items()
}
"""The next state, for each pair of a state and an event that it can report."""

EVENTS: Final = {
    state: frozenset(event for source, event in TRANSITIONS if source is state) for state in State
}
"""The events that each state can report; final states have none."""


def next_state(state: State, event: Event) -> State:
    """The next state.

    Raises:
        KeyError: The state cannot report this event: a bug in the driver.
    """
    return TRANSITIONS[state, event]
