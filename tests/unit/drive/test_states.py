"""The state machine, exhaustively: nothing undefined or unreachable, no way without an end."""

from __future__ import annotations

import itertools

import pytest

from ntagen.drive.states import ABORTS, ENDS, EVENTS, TRANSITIONS, Event, State, next_state

RUNNING = [state for state in State if state not in ENDS]


def reachable_from(start: State) -> set[State]:
    seen, waiting = {start}, [start]
    while waiting:
        state = waiting.pop()
        for event in EVENTS[state]:
            following = next_state(state, event)
            if following not in seen:
                seen.add(following)
                waiting.append(following)
    return seen


@pytest.mark.parametrize(("state", "event"), list(itertools.product(State, Event)))
def test_the_table_has_exactly_the_pairs_that_can_happen(state: State, event: Event) -> None:
    assert ((state, event) in TRANSITIONS) == (event in EVENTS[state])
    if event not in EVENTS[state]:
        with pytest.raises(KeyError):
            next_state(state, event)


@pytest.mark.parametrize("state", RUNNING)
def test_every_task_can_be_aborted_and_every_abort_is_an_end(state: State) -> None:
    for event, end in ABORTS.items():
        assert next_state(state, event) is end
        assert end in ENDS


def test_every_state_can_be_reached() -> None:
    from_log = {State.RESUME, State.RETREAT, State.PULLED_OUT}
    assert reachable_from(State.ARM) == set(State) - from_log
    assert reachable_from(State.ARM) | from_log == reachable_from(State.RESUME) | {State.ARM}


@pytest.mark.parametrize("state", [state for state in RUNNING if state is not State.RETREAT])
def test_the_target_can_be_reached_from_every_state(state: State) -> None:
    assert State.TARGET_REACHED in reachable_from(state)


@pytest.mark.parametrize("end", sorted(ENDS, key=str))
def test_ends_are_final(end: State) -> None:
    assert EVENTS[end] == frozenset()


def test_after_an_alarm_the_needle_stops_before_it_is_pulled() -> None:
    alarms = {Event.FORCE, Event.DEVIATION}
    for (_, event), following in TRANSITIONS.items():
        if event in alarms:
            assert following is State.STOP
    assert next_state(State.STOP, Event.STOPPED) is State.PULL_BACK
