"""The typed tree of an environment file: its statements with their places, without their meaning.

Every node has the `Span` from which it was read. Names are not resolved, units are not applied, and
only the syntax has been checked.
"""

from __future__ import annotations

from typing import Literal

from ntagen.nsl.source import Source, Span
from ntagen.scene import RegionKind
from ntagen.values import dataclass

# ------------------------------------------------------------------------------------ expressions


@dataclass(frozen=True, slots=True)
class Identifier:
    """A name where it is written."""

    span: Span
    text: str


@dataclass(frozen=True, slots=True)
class Number:
    """A number without its unit."""

    span: Span
    value: float


@dataclass(frozen=True, slots=True)
class Name:
    """A constant, a loop's variable or a direction that is used."""

    span: Span
    text: str


@dataclass(frozen=True, slots=True)
class Call:
    """A function applied to arguments."""

    span: Span
    function: Identifier
    arguments: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Vector:
    """Two or more components in parentheses; only three make sense."""

    span: Span
    components: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Measured:
    """An expression with a unit after it."""

    span: Span
    operand: Expression
    unit: Identifier


@dataclass(frozen=True, slots=True)
class Signed:
    """An expression with a sign before it; several signs are combined."""

    span: Span
    operand: Expression
    is_negative: bool


@dataclass(frozen=True, slots=True)
class Chain:
    """Operands joined by operators of one rank, from left to right: ``a - b + c``."""

    span: Span
    first: Expression
    rest: tuple[tuple[Literal["+", "-", "*", "/"], Expression], ...]


Expression = Number | Name | Call | Vector | Measured | Signed | Chain

# ------------------------------------------------------------------------------------- statements


@dataclass(frozen=True, slots=True)
class RegionName:
    """A region's name with its indices: ``Ring[i]``."""

    span: Span
    identifier: Identifier
    indices: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Sphere:
    """``sphere (0, -50, 0) mm radius 10 mm``."""

    span: Span
    center: Expression
    radius: Expression


SolidForm = Literal["box", "capsule", "cylinder", "ellipsoid", "halfspace"]


@dataclass(frozen=True, slots=True)
class Solid:
    """Any other shape: ``box (0, -20, 5) mm size (10, 4, 6) mm turned 30 deg about +z``.

    Attributes:
        span: Its words.
        form: Which shape it is.
        measures: Its values in the order written; the first is a place.
        turned: The angle and the axis of its turn, if one is written.
    """

    span: Span
    form: SolidForm
    measures: tuple[Expression, ...]
    turned: tuple[Expression, Expression] | None = None


ImageForm = Literal["mesh", "segmentation", "markups"]


@dataclass(frozen=True, slots=True)
class Clause:
    """A clause of a region from a file: ``in LPS mm``, ``segment "tumor"``, ``grid 1 mm``.

    Attributes:
        span: Its words.
        keyword: What it says.
        words: Its names, or its text without the quotes.
        value: Its value, if it has one.
    """

    span: Span
    keyword: Literal["in", "segment", "point", "label", "radius", "grid"]
    words: tuple[Identifier, ...] = ()
    value: Expression | None = None


@dataclass(frozen=True, slots=True)
class Image:
    """A shape from a file: ``mesh "liver.stl" in LPS mm``; the path is without the quotes."""

    span: Span
    form: ImageForm
    path: Identifier
    clauses: tuple[Clause, ...]


@dataclass(frozen=True, slots=True)
class Around:
    """``around C1 margin 3 mm``."""

    span: Span
    region: RegionName
    margin: Expression


@dataclass(frozen=True, slots=True)
class Moves:
    """How a region moves: ``moves 12 mm along +z every 4 s phase 90 deg``, or through places.

    Attributes:
        span: Its words.
        period: After this time it begins again.
        way: Of a sinusoid, how far it goes, and in which direction.
        phase: Of a sinusoid, by how much it is ahead.
        places: Of a list, each displacement and its time.
        path: Of a file, its path without the quotes.
    """

    span: Span
    period: Expression
    way: tuple[Expression, Expression] | None = None
    phase: Expression | None = None
    places: tuple[tuple[Expression, Expression], ...] = ()
    path: Identifier | None = None


@dataclass(frozen=True, slots=True)
class Region:
    """A region of any kind."""

    span: Span
    keyword: RegionKind
    name: RegionName
    shape: Sphere | Solid | Image | Around
    moves: Moves | None = None


@dataclass(frozen=True, slots=True)
class Let:
    """``let depth = 50 mm``."""

    span: Span
    name: Identifier
    value: Expression
    keyword: Literal["let"] = "let"


@dataclass(frozen=True, slots=True)
class Include:
    """``include "needle.nsl"``; the path is as written, without the quotes."""

    span: Span
    path: Identifier
    keyword: Literal["include"] = "include"


@dataclass(frozen=True, slots=True)
class Query:
    """``query Reach = E<> Checker.Final_TR_Reached``."""

    span: Span
    name: Identifier
    text: str
    keyword: Literal["query"] = "query"


@dataclass(frozen=True, slots=True)
class Setting:
    """A property with one value: ``speed 1 mm/s``."""

    span: Span
    keyword: Literal["tip", "heading", "bevel", "radius", "speed", "length", "step"]
    value: Expression


@dataclass(frozen=True, slots=True)
class Roll:
    """``roll by 90, 180 deg at most 2 times``; the limits as often as they are written."""

    span: Span
    angles: tuple[Expression, ...]
    at_most: tuple[Expression, ...]
    at_least: tuple[Expression, ...]
    keyword: Literal["roll"] = "roll"


@dataclass(frozen=True, slots=True)
class Spin:
    """``spin 20 %, 40 %``."""

    span: Span
    fractions: tuple[Expression, ...]
    keyword: Literal["spin"] = "spin"


@dataclass(frozen=True, slots=True)
class Wait:
    """``wait 0.5 s at most 2 times``."""

    span: Span
    length: Expression
    at_most: Expression | None = None
    keyword: Literal["wait"] = "wait"


@dataclass(frozen=True, slots=True)
class Gate:
    """``push only while phase between 200 deg and 340 deg``."""

    span: Span
    first: Expression
    last: Expression
    keyword: Literal["push"] = "push"


@dataclass(frozen=True, slots=True)
class Choice:
    """A property whose value is one of a few words: ``safety swept``."""

    span: Span
    keyword: Literal["safety"]
    word: Identifier


@dataclass(frozen=True, slots=True)
class TissueBound:
    """A bound of an adversarial tissue, a spread of a stochastic one: ``curvature 10 %``."""

    word: Identifier
    value: Expression


@dataclass(frozen=True, slots=True)
class Tissue:
    """``tissue adversarial curvature 10 % roll 5 deg tip 0.5 mm``."""

    span: Span
    word: Identifier
    bounds: tuple[TissueBound, ...]
    keyword: Literal["tissue"] = "tissue"


@dataclass(frozen=True, slots=True)
class Resolution:
    """``resolution 1000 per mm``."""

    span: Span
    count: Expression
    unit: Identifier
    keyword: Literal["resolution"] = "resolution"


@dataclass(frozen=True, slots=True)
class Transform:
    """``transform from LPS "ct.tfm"``, or with the rows of a matrix in place of the file.

    Attributes:
        span: Its words.
        direction: ``from`` or ``to``.
        space: ``LPS`` or ``RAS``.
        file: The path of a file, without the quotes.
        rows: The rows of the matrix, if there is no file.
    """

    span: Span
    direction: Identifier
    space: Identifier
    file: Identifier | None
    rows: tuple[Expression, ...]
    keyword: Literal["transform"] = "transform"


@dataclass(frozen=True, slots=True)
class Parameter:
    """A setting of the driver: ``pull 4 mm``; the keyword is its words."""

    span: Span
    keyword: str
    values: tuple[Expression, ...]


@dataclass(frozen=True, slots=True)
class Axis:
    """An axis of a device: ``insert X 80 steps/mm``."""

    span: Span
    keyword: Literal["insert", "roll"]
    letter: Identifier
    steps: Expression


@dataclass(frozen=True, slots=True)
class Device:
    """``device grbl "/dev/ttyACM0" { … }``; the texts are without the quotes."""

    span: Span
    kind: Identifier
    port: Identifier
    body: tuple[Statement, ...] = ()
    keyword: Literal["device"] = "device"


@dataclass(frozen=True, slots=True)
class Tracker:
    """``tracker openigtlink "localhost:18944" "Needle"``; the texts are without the quotes."""

    span: Span
    kind: Identifier
    address: Identifier
    name: Identifier | None = None
    keyword: Literal["tracker"] = "tracker"


@dataclass(frozen=True, slots=True)
class Section:
    """``needle { … }``, ``motion { … }`` or ``drive { … }``; the span is that of the word."""

    span: Span
    keyword: Literal["needle", "motion", "drive"]
    body: tuple[Statement, ...] = ()


@dataclass(frozen=True, slots=True)
class Loop:
    """``for i in 0..7 { … }``; the span is that of the line before the brace."""

    span: Span
    variable: Identifier
    first: Expression
    last: Expression
    body: tuple[Statement, ...] = ()
    keyword: Literal["for"] = "for"


@dataclass(frozen=True, slots=True)
class Environment:
    """``environment paper { … }``; the span is that of the line before the brace."""

    span: Span
    name: Identifier
    body: tuple[Statement, ...] = ()
    keyword: Literal["environment"] = "environment"


@dataclass(frozen=True, slots=True)
class Broken:
    """A statement with a syntax error, which is reported already.

    Attributes:
        span: Its words.
        keyword: Its first word, so that the statement is not reported as missing.
        name: The name that it would have declared, if it could be read.
        body: The statements in its braces, which are still checked.
    """

    span: Span
    keyword: str
    name: str | None = None
    body: tuple[Statement, ...] = ()


Statement = (
    Region
    | Let
    | Include
    | Query
    | Setting
    | Roll
    | Spin
    | Wait
    | Gate
    | Choice
    | Tissue
    | Resolution
    | Transform
    | Section
    | Parameter
    | Device
    | Axis
    | Tracker
    | Loop
    | Environment
    | Broken
)


@dataclass(frozen=True, slots=True)
class File:
    """All statements of one file, in the order written."""

    source: Source
    statements: tuple[Statement, ...]
