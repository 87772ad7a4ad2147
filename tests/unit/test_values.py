"""`ntagen.values.dataclass` makes the same classes as the standard library."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle
from collections.abc import Callable
from typing import Any, ClassVar, get_type_hints

import pytest

from ntagen import values

MAKERS = [dataclasses.dataclass, values.dataclass]


@values.dataclass(frozen=True, slots=True)
class Place:
    """A class that pickles can find."""

    x: float
    y: float = 0.5
    names: tuple[str, ...] = ()
    more: list[int] = dataclasses.field(default_factory=list)


@values.dataclass(frozen=True, slots=True)
class Named(Place):
    """A subclass."""

    name: str = "none"


def classes(maker: Callable[..., Any]) -> list[type]:
    """The same classes by one of the decorators."""

    @maker(frozen=True, slots=True)
    class Plain:
        """Of all kinds of fields."""

        first: int
        second: str = "two"
        third: list[int] = dataclasses.field(default_factory=list)
        shared: ClassVar[int] = 7

        @property
        def twice(self) -> int:
            return 2 * self.first

    @maker(frozen=True, slots=True)
    class Checked:
        """One with a rule."""

        first: int

        def __post_init__(self) -> None:
            if self.first < 0:
                raise ValueError("negative")

    @maker(frozen=True, slots=True)
    class Own:
        """One with an equality of its own."""

        first: int

        def __eq__(self, other: object) -> bool:
            return True

        def __hash__(self) -> int:
            return 1

    @maker(frozen=True, slots=True)
    class Partly:
        """One with a field that does not count."""

        first: int
        second: int = dataclasses.field(default=3, compare=False, repr=False)

    @maker(frozen=True, slots=True)
    class Derived(Checked):  # type: ignore[misc,valid-type]
        """A subclass."""

        second: int = 4

    @maker(slots=True)
    class Changing:
        """One that is not frozen."""

        first: int

    return [Plain, Checked, Own, Partly, Derived, Changing]


def outcome(act: Callable[[Any], object], cls: type) -> str:
    """What comes out of an action on a class, or its error, as text."""
    try:
        return repr(act(cls))
    except Exception as error:
        return f"{type(error).__name__}: {error}"


@pytest.mark.parametrize("number", range(6))
def test_the_classes_behave_alike(number: int) -> None:
    usual, ours = (classes(maker)[number] for maker in MAKERS)
    actions: list[Callable[[Any], object]] = [
        lambda cls: cls(1),
        lambda cls: cls(),
        lambda cls: cls(-1),
        lambda cls: cls(first=1),
        lambda cls: cls(1, unknown=2),
        lambda cls: cls(1, 2, 3, 4, 5),
        lambda cls: cls(1) == cls(1),
        lambda cls: cls(1) == cls(2),
        lambda cls: cls(1) == (1,),
        lambda cls: len({hash(cls(1)), hash(cls(1))}),
        lambda cls: setattr(cls(1), "first", 2),
        lambda cls: delattr(cls(1), "first"),
        lambda cls: dataclasses.replace(cls(1), first=5),
        lambda cls: dataclasses.asdict(cls(1)),
        lambda cls: [(one.name, one.type) for one in dataclasses.fields(cls)],
        lambda cls: cls.__match_args__,
        lambda cls: cls.__slots__,
        lambda cls: cls.__doc__,
        lambda cls: cls.__dataclass_params__,
        lambda cls: str(inspect.signature(cls)),
        lambda cls: copy.copy(cls(1)),
        lambda cls: copy.deepcopy(cls(1)),
        lambda cls: hasattr(cls(1), "__dict__"),
        lambda cls: cls(1).twice,
        lambda cls: cls.shared,
    ]
    for action in actions:
        assert outcome(action, ours) == outcome(action, usual)


def test_values_that_hold_themselves_are_shown() -> None:
    place = Place(1.0)
    place.more.append(place)  # type: ignore[arg-type]
    assert repr(place) == "Place(x=1.0, y=0.5, names=(), more=[...])"


def test_defaults_that_are_made_are_not_shared() -> None:
    assert Place(1.0).more is not Place(1.0).more


@pytest.mark.parametrize("value", [Place(1.0, names=("a",)), Named(2.0, name="b")])
def test_values_are_pickled(value: Place) -> None:
    assert pickle.loads(pickle.dumps(value)) == value


def test_subclasses_are_frozen_and_distinct() -> None:
    assert Named(1.0) != Place(1.0)
    for value in (Place(1.0), Named(1.0)):
        with pytest.raises(dataclasses.FrozenInstanceError):
            value.x = 2.0  # type: ignore[misc]
    with pytest.raises(AttributeError):
        Place(1.0).strange = 2.0  # type: ignore[attr-defined]
    assert get_type_hints(Named)["name"] is str
