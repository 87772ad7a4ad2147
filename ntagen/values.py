"""`dataclass`, as in the standard library, at a fifth of the time that it takes there.

The program has a hundred small frozen classes. Up to Python 3.12 the standard library compiles
eight functions for each of them, one after the other, whenever the program starts: nearly a
millisecond a class, a quarter of the time until the first plan. Here the constructor alone is
compiled, when the first value is made; the other functions are closures. The classes are
dataclasses: `fields`, `replace`, `asdict`, subclasses, pickles and copies work as usual.
"""

from __future__ import annotations

import dataclasses
import operator
import reprlib
from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:

    def dataclass(cls=None, /, **options):  # noqa: ANN001, ANN003, ANN201
        """The decorator of `dataclasses`; only frozen classes with slots are made faster."""
        if cls is None:
            return lambda cls: dataclass(cls, **options)
        if options == {"frozen": True, "slots": True} and _is_plain(cls):
            return _frozen(cls)
        return dataclasses.dataclass(**options)(cls)


_OWN: Final = frozenset(
    {"__init__", "__repr__", "__eq__", "__hash__", "__setattr__", "__delattr__"}
    | {"__getstate__", "__setstate__", "__slots__"}
)
"""A class that defines one of these has wishes of its own."""


class _Made(type):
    """What is shown in signatures for a default that is made for each value."""

    def __repr__(cls) -> str:
        return "<factory>"


class _Factory(metaclass=_Made):
    """Stands for a value that was not given."""


def _is_plain(cls: type) -> bool:
    """Whether a class has nothing that changes what the standard library makes of it."""
    if cls.__bases__ != (object,) or cls.__doc__ is None or not _OWN.isdisjoint(vars(cls)):
        return False
    given = [vars(cls).get(name) for name in vars(cls).get("__annotations__", ())]
    return all(
        one.init and one.repr and one.compare and one.hash is None and one.kw_only is not True
        for one in given
        if isinstance(one, dataclasses.Field)
    )


def _frozen(cls: type) -> type:
    """The class as a frozen dataclass with slots."""
    made: Any = dataclasses.dataclass(init=False, repr=False, eq=False, slots=True)(cls)
    parameters = made.__dataclass_params__
    parameters.init = parameters.repr = parameters.eq = parameters.frozen = True
    fields = dataclasses.fields(made)
    made.__init__ = _first_constructor(made, fields)
    made.__signature__ = _Signature()
    made.__repr__ = _shown
    made.__getstate__, made.__setstate__ = _state, _set_state
    names = tuple(field.name for field in fields)
    _add_comparisons(made, names)
    _add_refusals(made, names)
    return made  # type: ignore[no-any-return]


def _first_constructor(
    cls: Any,  # noqa: ANN401  a class
    fields: tuple[dataclasses.Field[Any], ...],
) -> Callable[..., None]:
    """A function that makes the constructor, and puts it in its own place."""

    def construct(self: object, *values: object, **named: object) -> None:
        _complete(cls)
        cls.__init__(self, *values, **named)

    construct.__qualname__, construct.__module__ = f"{cls.__qualname__}.__init__", cls.__module__
    construct.fields_ = fields  # type: ignore[attr-defined]
    return construct


def _complete(cls: Any) -> None:  # noqa: ANN401  a class
    """Gives a class, and those above it, their constructors."""
    for one in cls.__mro__:
        fields = getattr(vars(one).get("__init__"), "fields_", None)
        if fields is not None:
            one.__init__ = _constructor(one, fields)


class _Signature:
    """The signature of a class, which asks for the constructor."""

    def __get__(self, _value: object, cls: type) -> object:
        import inspect

        _complete(cls)
        signature = inspect.signature(cls.__init__)  # type: ignore[misc]
        return signature.replace(parameters=list(signature.parameters.values())[1:])


def _constructor(cls: type, fields: tuple[dataclasses.Field[Any], ...]) -> Callable[..., None]:
    """The function that gives all fields their values."""
    scope: dict[str, Any] = {"set_": object.__setattr__, "missing_": _Factory}
    parameters, lines = ["self"], [" pass"]
    for field in fields:
        name, value = field.name, field.name
        if field.default_factory is not dataclasses.MISSING:
            scope[f"make_{name}_"] = field.default_factory
            parameters.append(f"{name}=missing_")
            value = f"make_{name}_() if {name} is missing_ else {name}"
        elif field.default is not dataclasses.MISSING:
            scope[f"default_{name}_"] = field.default
            parameters.append(f"{name}=default_{name}_")
        else:
            parameters.append(name)
        lines.append(f" set_(self, {name!r}, {value})")
    if hasattr(cls, "__post_init__"):
        lines.append(" self.__post_init__()")
    exec("\n".join([f"def __init__({', '.join(parameters)}):", *lines]), scope)
    made: Callable[..., None] = scope["__init__"]
    made.__qualname__, made.__module__ = f"{cls.__qualname__}.__init__", cls.__module__
    made.__annotations__ = {field.name: field.type for field in fields} | {"return": None}
    return made


def _add_comparisons(cls: type, names: tuple[str, ...]) -> None:
    """Adds `__eq__` and `__hash__` by the values of the fields."""
    values: Callable[[object], object] = operator.attrgetter(*names) if names else lambda _: ()

    def equal(self: object, other: object) -> bool:
        return values(self) == values(other) if type(other) is type(self) else NotImplemented

    def hashed(self: object) -> int:
        return hash(values(self))

    vars_ = {"__eq__": equal, "__hash__": hashed}
    for name, function in vars_.items():
        setattr(cls, name, function)


def _add_refusals(cls: Any, names: tuple[str, ...]) -> None:  # noqa: ANN401  a class
    """Adds what refuses to change a field."""

    def set_attribute(self: object, name: str, value: object) -> None:
        if type(self) is cls or name in names:
            raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")
        object.__setattr__(self, name, value)

    def delete_attribute(self: object, name: str) -> None:
        if type(self) is cls or name in names:
            raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")
        object.__delattr__(self, name)

    cls.__setattr__ = set_attribute
    cls.__delattr__ = delete_attribute


@reprlib.recursive_repr()
def _shown(self: object) -> str:
    values = (f"{one.name}={getattr(self, one.name)!r}" for one in _fields(self))
    return f"{type(self).__qualname__}({', '.join(values)})"


def _state(self: object) -> list[object]:
    return [getattr(self, field.name) for field in _fields(self)]


def _set_state(self: object, state: list[object]) -> None:
    for field, value in zip(_fields(self), state, strict=True):
        object.__setattr__(self, field.name, value)


def _fields(value: Any) -> tuple[dataclasses.Field[Any], ...]:  # noqa: ANN401  any dataclass
    return dataclasses.fields(value)
