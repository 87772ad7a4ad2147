"""The finite games as tables: what may be done in a state, and what it leads to.

Each function is written from the words at the top of its model, `NAME.xta`, in the same order of
actions as the model's controllable edges.
"""

from __future__ import annotations

from fractions import Fraction

from tests.oracles.learning.induction import Action, Game, Leg, State

ONE = Fraction(1)


def part(number: int, of: int) -> Fraction:
    """A chance."""
    return Fraction(number, of)


def sure(edge: int | None, state: State, cost: int = 0, where: str = "") -> Action:
    """An action with one outcome."""
    return Action((Leg(ONE, state, Fraction(cost)),), edge, where)


def either(edge: int | None, chance: Fraction, yes: State, no: State, cost: int = 0) -> Action:
    """An action that comes out one way or the other at the same cost."""
    legs = Leg(chance, yes, Fraction(cost)), Leg(1 - chance, no, Fraction(cost))
    return Action(tuple(leg for leg in legs if leg.chance > 0), edge)


def traffic() -> Game:
    """A state is (0 before the draw, 1 at home or 2 at the end; the traffic)."""

    def actions(state: State) -> list[Action]:
        where, jam = state
        if where == 0:
            return [either(None, part(7, 10), (1, 0), (1, 1))]
        if where == 1:
            return [sure(0, (2, 0), 50 if jam else 10), sure(1, (2, 0), 25)]
        return []

    return Game((0, 0), ("", "traffic == {}"), actions)


def parts() -> Game:
    """A state is (missing parts, tries left)."""

    def actions(state: State) -> list[Action]:
        missing, left = state
        if missing == 0 or left == 0:
            return []
        done, again = (missing - 1, left - 1), (missing, left - 1)
        return [either(0, part(1, 2), done, again, 1), either(1, part(4, 5), done, again, 3)]

    return Game(
        (2, 5), ("parts == {}", "left == {}"), actions, worth=lambda state: Fraction(10 * state[0])
    )


def plant() -> Game:
    """A state is (wear, periods left)."""

    def actions(state: State) -> list[Action]:
        wear, left = state
        if left == 0:
            return []
        run = either(0, part(1, 2), (wear + 1, left - 1), (wear, left - 1), 10 - 3 * wear)
        return [run, sure(1, (0, left - 1), -4)]

    return Game((0, 6), ("wear == {}", "left == {}"), actions)


def pushed(edge: int, offset: int, left: int, cost: int, where: str = "") -> Action:
    """A push of the needle from this offset."""
    chances = {-1: part(1, 5), 0: part(3, 5), 1: part(1, 5)}
    legs = (
        Leg(chance, (offset + aside, left - 1), Fraction(cost)) for aside, chance in chances.items()
    )
    return Action(tuple(legs), edge, where)


def needle() -> Game:
    """A state is (offset, pushes left)."""

    def actions(state: State) -> list[Action]:
        offset, left = state
        if left == 0:
            return []
        rolls = [pushed(1, offset + 2 * s - 1, left, 3, f"side == {s}") for s in (0, 1)]
        return [pushed(0, offset, left, 0), *rolls]

    return Game(
        (0, 3),
        ("offset == {}", "left == {}"),
        actions,
        worth=lambda state: Fraction(10 * abs(state[0])),
    )


def one_choice() -> Game:
    """A state is (0 before the choice, 1 after it)."""

    def actions(state: State) -> list[Action]:
        if state == (1,):
            return []
        legs = Leg(part(3, 5), (1,), Fraction(2)), Leg(part(2, 5), (1,), Fraction(12))
        return [sure(0, (1,), 5), Action(legs, 1)]

    return Game((0,), ("",), actions)


def tries() -> Game:
    """A state is (0 before a try, 1 at the end); the cost is the time."""

    def actions(state: State) -> list[Action]:
        if state == (1,):
            return []
        return [either(0, part(3, 10), (1,), (0,), 2), sure(1, (1,), 7)]

    return Game((0,), ("",), actions)


def tries_in_time() -> Game:
    """A state is (1 after success, else 0; units of time left, of 6)."""

    def actions(state: State) -> list[Action]:
        success, left = state
        if success or left < 2:
            return []
        return [either(0, part(3, 10), (1, left - 2), (0, left - 2)), sure(1, (0, 0))]

    conditions = ("", "time == 6 - {}")
    return Game((0, 6), conditions, actions, worth=lambda state: Fraction(state[0]))


def stages() -> Game:
    """A state is (stages that are done); the cost is the time."""

    def actions(state: State) -> list[Action]:
        (stage,) = state
        if stage == 3:
            return []
        return [either(0, part(4, 5), (stage + 1,), state, 3), sure(1, (stage + 1,), 4)]

    return Game((0,), ("stage == {}",), actions)


def gambler() -> Game:
    """A state is (coins, rounds left)."""

    def actions(state: State) -> list[Action]:
        coins, rounds = state
        if coins >= 4 or coins == 0 or rounds == 0:
            return []
        legs = {
            bet: (
                Leg(part(2, 5), (coins + bet, rounds - 1)),
                Leg(part(3, 5), (coins - bet, rounds - 1)),
            )
            for bet in range(1, min(2, coins) + 1)
        }
        return [Action(both, 0, f"b == {bet}") for bet, both in legs.items()]

    return Game(
        (2, 3),
        ("coins == {}", "rounds == {}"),
        actions,
        worth=lambda state: Fraction(state[0] >= 4),
    )


def parking() -> Game:
    """A state is (1 at a free place, 2 when parked, else 0; distance)."""

    def actions(state: State) -> list[Action]:
        where, distance = state
        if where == 2:
            return []
        if where == 1:
            return [sure(0, (2, 0), distance), sure(1, (0, distance - 1))]
        if distance < 0:
            return [sure(None, (2, 0), 12)]
        return [either(None, part(3, 10), (1, distance), (0, distance - 1))]

    return Game((0, 7), ("", "distance == {}"), actions)


def routes() -> Game:
    """A state is (0 before the choice, 1 after it); harm costs nothing."""

    def actions(state: State) -> list[Action]:
        return [] if state == (1,) else [sure(0, (1,), 1), sure(1, (1,), 4)]

    return Game((0,), ("",), actions)


def inventory() -> Game:
    """A state is (day, stock)."""

    def sold(day: int, stock: int, order: int) -> Action:
        paid = 2 + order if order else 0
        legs = []
        for wanted, chance in ((0, part(1, 4)), (1, part(1, 2)), (2, part(1, 4))):
            left = stock + order - wanted
            after = left if left >= 0 else -5 * left
            legs.append(Leg(chance, (day + 1, max(0, left)), Fraction(paid + after)))
        return Action(tuple(legs), 0, f"n == {order}")

    def actions(state: State) -> list[Action]:
        day, stock = state
        return [sold(day, stock, order) for order in range(4 - stock)] if day < 4 else []

    return Game((0, 0), ("day == {}", "stock == {}"), actions)


def retries() -> Game:
    """A state is (messages, charge)."""

    def actions(state: State) -> list[Action]:
        messages, charge = state
        if messages == 0 or charge == 0:
            return []
        weak = either(0, part(1, 3), (messages - 1, charge - 1), (messages, charge - 1))
        if charge < 3:
            return [weak]
        return [weak, either(1, part(4, 5), (messages - 1, charge - 3), (messages, charge - 3))]

    return Game(
        (2, 7),
        ("messages == {}", "charge == {}"),
        actions,
        worth=lambda state: Fraction(state[0] == 0),
    )


def scheduling() -> Game:
    """A state is (three bits, whether each job is done; the time)."""
    lengths = (
        ((1, part(1, 2)), (3, part(1, 2))),
        ((2, part(3, 4)), (6, part(1, 4))),
        ((1, ONE),),
    )
    weights = (1, 3, 4)

    def ended(state: State, job: int) -> Action:
        legs = []
        for length, chance in lengths[job]:
            end = state[3] + length
            bits = tuple(1 if k == job else state[k] for k in range(3))
            late = 10 if job == 2 and end > 6 else 0
            legs.append(Leg(chance, (*bits, end), Fraction(weights[job] * end + late)))
        return Action(tuple(legs), 0, f"j == {job}")

    def actions(state: State) -> list[Action]:
        open_jobs = [job for job in range(3) if not state[job] and (job != 2 or state[0])]
        return [ended(state, job) for job in open_jobs]

    conditions = ("done[0] == {}", "done[1] == {}", "done[2] == {}", "now == {}")
    return Game((0, 0, 0, 0), conditions, actions)


def steering() -> Game:
    """A state is (position, steps left)."""

    def actions(state: State) -> list[Action]:
        at, left = state
        if at <= 0 or at == 6 or left == 0:
            return []
        firm = (
            Leg(part(3, 5), (at + 1, left - 1)),
            Leg(part(1, 5), (at, left - 1)),
            Leg(part(1, 5), (at - 2, left - 1)),
        )
        return [either(0, part(1, 2), (at + 1, left - 1), (at - 1, left - 1)), Action(firm, 1)]

    return Game(
        (3, 8), ("at == {}", "left == {}"), actions, worth=lambda state: Fraction(state[0] == 6)
    )


def secretary() -> Game:
    """A state is (1 at a candidate who is the best so far, 2 when won, 3 when lost, else 0; k)."""

    def actions(state: State) -> list[Action]:
        where, k = state
        if where >= 2:
            return []
        if where == 1:
            return [either(0, part(k, 6), (2, 0), (3, 0)), sure(1, (0, k + 1))]
        if k == 7:
            return [sure(None, (3, 0))]
        return [either(None, part(1, k), (1, k), (0, k + 1))]

    conditions = ("", "k == {}")
    return Game((0, 1), conditions, actions, worth=lambda state: Fraction(state[0] == 2))


def dice() -> Game:
    """A state is (points, or 0 before a throw; throws so far); the end is (7, 0)."""

    def actions(state: State) -> list[Action]:
        points, throws = state
        if points == 7:
            return []
        if points == 0:
            faces = range(1, 7)
            return [Action(tuple(Leg(part(1, 6), (face, throws + 1)) for face in faces))]
        keep = sure(0, (7, 0), 2 * points - (throws - 1))
        return [keep, sure(1, (0, throws))] if throws < 4 else [keep]

    return Game((0, 0), ("points == {}", "throws == {}"), actions)


def replacement() -> Game:
    """A state is (age, periods left)."""

    def run(edge: int, age: int, left: int, paid: int) -> Action:
        legs = [Leg(part(5 - age, 5), (min(4, age + 1), left - 1), Fraction(paid + age))]
        if age > 0:
            legs.append(Leg(part(age, 5), (0, left - 1), Fraction(paid + age + 9)))
        return Action(tuple(legs), edge)

    def actions(state: State) -> list[Action]:
        age, left = state
        return [run(0, age, left, 0), run(1, 0, left, 6)] if left else []

    return Game((0, 6), ("age == {}", "left == {}"), actions)


def routing(moves: int) -> Game:
    """A state is (node, hops so far)."""

    def actions(state: State) -> list[Action]:
        node, hops = state
        if node == 4 or hops == moves:
            return []
        after = hops + 1
        links = {
            0: [either(0, part(1, 2), (2, after), (0, after)), sure(1, (1, after))],
            1: [sure(2, (2, after)), either(3, part(3, 4), (3, after), (0, after))],
            2: [either(4, part(1, 2), (4, after), (0, after)), sure(5, (3, after))],
            3: [either(6, part(2, 3), (4, after), (3, after))],
        }
        return links[node]

    return Game(
        (0, 0), ("node == {}", "hops == {}"), actions, worth=lambda state: Fraction(state[0] == 4)
    )


def deadline(units: int) -> Game:
    """A state is (stages that are done; units of time so far)."""

    def actions(state: State) -> list[Action]:
        stage, now = state
        if stage == 3 or now >= units:
            return []
        quick = either(0, part(7, 10), (stage + 1, now + 2), (stage, now + 2))
        return [quick, either(1, part(19, 20), (stage + 1, now + 3), (stage, now + 3))]

    def worth(state: State) -> Fraction:
        return Fraction(state[0] == 3 and state[1] <= units)

    return Game((0, 0), ("stage == {}", "time == {}"), actions, worth)


def relay() -> Game:
    """A state is (whose turn it is, 2 at the end; rounds left, load, boxes)."""

    def loads(rounds: int, boxes: int) -> list[Action]:
        if rounds == 0:
            return [sure(None, (2, 0, 0, 0), 3 * boxes + (5 if boxes >= 4 else 0))]
        two, none = (1, rounds, 2, boxes), (1, rounds, 0, boxes)
        return [sure(0, (1, rounds, 1, boxes)), either(1, part(3, 5), two, none)]

    def actions(state: State) -> list[Action]:
        turn, rounds, load, boxes = state
        if turn == 2:
            return []
        if turn == 0:
            return loads(rounds, boxes)
        full = (0, rounds - 1, 0, boxes + load)
        less = (0, rounds - 1, 0, boxes + max(0, load - 1))
        fast = Leg(part(3, 4), full, -ONE), Leg(part(1, 4), less, -ONE)
        return [sure(2, full, -2), Action(fast, 3)]

    conditions = ("turn == {}", "rounds == {}", "load == {}", "boxes == {}")
    return Game((0, 3, 0, 0), conditions, actions)
