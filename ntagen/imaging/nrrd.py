"""Reads NRRD files, with their voxels in the file or beside it (.nhdr).

The format is that of teem, "Definition of NRRD File Format". The header has lines of three kinds:
``# comment``, ``field: value`` and ``key:=value``; Slicer writes its segments in keys. A blank line
ends it. What a field says is believed or refused by its name; none is passed over that says where
voxels are, so nothing ends up on the other side.
"""

from __future__ import annotations

import io
import math
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final, TypeVar

from ntagen.imaging.mistakes import ImageError, malformed
from ntagen.imaging.reading import bytes_of
from ntagen.imaging.space import Space
from ntagen.imaging.volumes import Encoding, Packed, Segment, Volume, refuse_many

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

MOST_BYTES: Final = 512 * 2**20
_HEADER_BYTES: Final = 2**20

_SPACES: Final[dict[str, tuple[Space, tuple[int, int, int]]]] = {
    "left-posterior-superior": ("LPS", (1, 1, 1)),
    "right-anterior-superior": ("RAS", (1, 1, 1)),
    "left-anterior-superior": ("LPS", (1, -1, 1)),
}
"""By space: the space that it is brought to, and the signs of its axes there."""

_SHORT: Final = {
    "lps": "left-posterior-superior",
    "ras": "right-anterior-superior",
    "las": "left-anterior-superior",
    "lpst": "left-posterior-superior-time",
    "rast": "right-anterior-superior-time",
    "last": "left-anterior-superior-time",
}
_RIGHT_HANDED: Final = "3d-right-handed"
_WITHOUT_SIDES: Final = {
    "scanner-xyz": "which says nothing of the patient's sides",
    "3d-left-handed": "which is a mirror image of LPS and of RAS",
}
_TYPES: Final = {
    **dict.fromkeys(("signed char", "int8", "int8_t"), "i1"),
    **dict.fromkeys(("uchar", "unsigned char", "uint8", "uint8_t"), "u1"),
    **dict.fromkeys(("short", "signed short", "int16", "int16_t"), "i2"),
    **dict.fromkeys(("ushort", "unsigned short", "uint16", "uint16_t"), "u2"),
    **dict.fromkeys(("int", "signed int", "int32", "int32_t"), "i4"),
    **dict.fromkeys(("uint", "unsigned int", "uint32", "uint32_t"), "u4"),
    **dict.fromkeys(("longlong", "long long", "signed long long", "int64", "int64_t"), "i8"),
    **dict.fromkeys(("ulonglong", "unsigned long long", "uint64", "uint64_t"), "u8"),
    **{"float": "f4", "double": "f8"},
}
_ENCODINGS: Final[dict[str, Encoding]] = {
    **{"raw": "raw", "gzip": "gzip", "gz": "gzip", "bzip2": "bzip2", "bz2": "bzip2"},
    **{"text": "text", "txt": "text", "ascii": "text"},
}
_UNITS_MM: Final = {
    **{"mm": 1.0, "millimeter": 1.0, "millimeters": 1.0, "cm": 10.0, "centimeter": 10.0},
    **{"m": 1000.0, "meter": 1000.0, "um": 0.001, "micron": 0.001, "µm": 0.001, "μm": 0.001},
}
_LAYER_KINDS: Final = re.compile(
    r"list|vector|\d-vector|point|scalar|stub|none|\?\?\?|domain|space"
)
_BOTH_WAYS: Final = {"datafile": "data file", "lineskip": "line skip", "byteskip": "byte skip"}
_FIELDS: Final = frozenset(
    {
        *("dimension", "type", "block size", "blocksize", "encoding", "endian", "content", "min"),
        *("max", "old min", "oldmin", "old max", "oldmax", "data file", "line skip", "byte skip"),
        *("number", "sample units", "sampleunits", "sizes", "spacings", "thicknesses", "axis mins"),
        *("axismins", "axis maxs", "axismaxs", "centers", "centerings", "labels", "units", "kinds"),
        *("space", "space dimension", "space units", "space origin", "space directions"),
        "measurement frame",
    }
)
_VECTOR: Final = r"\([^()]*\)|\S+"
"""Some writers put spaces behind the commas of a vector."""

_Value = TypeVar("_Value")


@dataclass(frozen=True, slots=True)
class Header:
    """What stands before the voxels.

    Attributes:
        path: The file.
        fields: The fields, by their names in lower case.
        keys: The keys and their values.
        end: Where the voxels begin, if they are in the file.
    """

    path: str
    fields: Mapping[str, str]
    keys: Mapping[str, str]
    end: int

    def wrong(self, field: str, why: str, hint: str = "save it once more") -> ImageError:
        """The error of a field."""
        shown = f"{field}: {self.fields[field]}" if field in self.fields else field
        return malformed(f"`{shown[:80]}` in `{self.path}`: {why}", hint)

    def values(self, field: str, read: Callable[[str], _Value], word: str = r"\S+") -> list[_Value]:
        """The values of a field that has one for each axis, say; none if there is no such field.

        Args:
            field: Its name.
            read: Reads a value.
            word: The pattern of a value.

        Raises:
            ImageError: They cannot be read.
        """
        text = self.fields.get(field, "")
        try:
            if "_" in text:  # Python takes it for a part of a number.
                raise ValueError(text)
            return [read(found) for found in re.findall(word, text)]
        except (ValueError, OverflowError):
            raise self.wrong(field, "this is no list of such values") from None

    def whole(self, field: str) -> int:
        """A whole number; 0 if there is no such field."""
        numbers = self.values(field, int) or [0]
        if len(numbers) != 1:
            raise self.wrong(field, "this is no number")
        return numbers[0]


def read_nrrd(path: str) -> Volume:
    """The voxels of a NRRD file.

    Raises:
        ImageError: It cannot be read, or does not say where its voxels are.
    """
    import numpy as np

    data = bytes_of(path, MOST_BYTES)
    header = _header(path, data)
    sizes = tuple(header.values("sizes", int))
    if "sizes" not in header.fields or len(sizes) != header.whole("dimension"):
        raise header.wrong("sizes", f"`dimension` is {header.fields.get('dimension', 'missing')}")
    refuse_many(path, sizes)
    space, said, signs, has_time = _space(header)
    directions, origin = _directions(header, len(sizes), 4 if has_time else 3)
    in_space, layers = _axes(header, sizes, directions, has_time)
    rows = np.array([directions[axis] for axis in in_space])[:, :3] * signs
    _refuse_spacings(header, rows, in_space)
    separate = _data_file(header)
    kept = [axis for axis in range(len(sizes)) if axis in in_space or axis == layers]
    return Volume(
        path=path,
        sizes=tuple(sizes[axis] for axis in kept),
        layers=None if layers is None else kept.index(layers),
        dtype=_dtype(header),
        packed=_packed(header, data if separate is None else bytes_of(separate, MOST_BYTES)),
        rows=rows,
        origin=np.array(origin[:3]) * signs,
        space=space,
        said=said,
        unit_mm=_unit_mm(header),
        segments=_segments(header, layers is not None),
    )


def data_file_of(path: str) -> str | None:
    """The other file that has the voxels of this one, if there is one.

    Raises:
        ImageError: The file cannot be read, or the other one is not beside it.
    """
    return _data_file(_header(path, bytes_of(path, MOST_BYTES)))


def _header(path: str, data: bytes) -> Header:
    """The lines of a header.

    Raises:
        ImageError: This is none.
    """
    magic = re.match(rb"NRRD000[1-5]\r?\n", data)
    if magic is None:
        raise malformed(
            f"`{path}` is no NRRD file: it does not begin with `NRRD0001` to `NRRD0005`"
        )
    fields: dict[str, str] = {}
    keys: dict[str, str] = {}
    file = io.BytesIO(data)
    file.seek(magic.end())
    while text := file.readline(_HEADER_BYTES):
        if file.tell() > _HEADER_BYTES:
            raise malformed(f"the header of `{path}` has no end")
        line = text.decode("utf-8", "replace").rstrip()
        if not line:
            break
        if line.startswith("#"):
            continue
        name, colon, value = line.partition(":")
        if not colon:
            raise malformed(f"`{line[:60]}` in the header of `{path}` is neither a field nor a key")
        is_key = value.startswith("=")
        found, name = (keys, name.strip()) if is_key else (fields, name.strip().lower())
        name = name if is_key else _BOTH_WAYS.get(name, name)
        if not is_key and name not in _FIELDS:
            raise malformed(
                f"`{line[:60]}` in the header of `{path}` is no field of NRRD",
                "remove this line, or write `:=` if it is a key",
            )
        if name in found:
            raise malformed(f"`{name[:60]}` stands twice in `{path}`", "remove one of them")
        found[name] = _unescaped(value[1:].strip()) if is_key else value.strip()
    return Header(path, fields, keys, file.tell())


def _unescaped(text: str) -> str:
    return re.sub(r"\\([\\n])", lambda found: "\n" if found[1] == "n" else "\\", text)


# --------------------------------------------------------------------------------------- geometry


def _space(header: Header) -> tuple[Space | None, str | None, tuple[int, int, int], bool]:
    """The space of a file.

    Returns:
        The space; what the file says, if it has no such name; the signs that bring coordinates
        there; whether time is the last of its axes.

    Raises:
        ImageError: Nothing could be told of the patient's sides.
    """
    text = header.fields.get("space")
    if text is None:
        if header.whole("space dimension") not in (0, 3):
            raise header.wrong("space dimension", "without a `space` it must be 3")
        return None, None, (1, 1, 1), False
    if "space dimension" in header.fields:
        raise header.wrong("space dimension", "there is a `space` as well", "remove one of them")
    word = _SHORT.get(text.lower(), text.lower())
    plain = word.removesuffix("-time")
    has_time = plain != word
    if plain == _RIGHT_HANDED:
        return None, text, (1, 1, 1), has_time
    if plain not in _SPACES:
        why = _WITHOUT_SIDES.get(plain, "which is no space of NRRD")
        raise ImageError(
            "space-unknown",
            f"`space: {text[:60]}` in `{header.path}`, {why}",
            "save it in left-posterior-superior or right-anterior-superior",
        )
    space, signs = _SPACES[plain]
    return space, None if signs == (1, 1, 1) else text, signs, has_time


def _directions(
    header: Header, axes: int, dimension: int
) -> tuple[list[list[float] | None], list[float]]:
    """The step from voxel to voxel along each axis, if it is one in space, and the origin.

    Raises:
        ImageError: They are missing, or of another dimension.
    """
    directions = header.values("space directions", _vector, _VECTOR)
    origins = header.values("space origin", _vector, _VECTOR)
    if not directions or not origins:
        raise ImageError(
            "matrix-degenerate",
            f"`{header.path}` does not say where its voxels are: it needs three space directions"
            " and a space origin",
            "save it with the geometry of its image, as Slicer does",
        )
    if len(directions) != axes or any(d is not None and len(d) != dimension for d in directions):
        why = f"each of the {axes} axes needs {dimension} numbers, or `none`"
        raise header.wrong("space directions", why)
    origin = origins[0]
    if len(origins) != 1 or origin is None or len(origin) != dimension:
        raise header.wrong("space origin", f"it needs {dimension} numbers")
    return directions, origin


def _vector(word: str) -> list[float] | None:
    """A vector ``(1,2,3)``; None for ``none``."""
    if word.lower() == "none":
        return None
    if word[:1] != "(" or word[-1:] != ")":
        raise ValueError(word)
    numbers = [float(number) for number in word[1:-1].split(",")]
    if any(map(math.isnan, numbers)):
        raise ValueError(word)
    return numbers


def _axes(
    header: Header,
    sizes: Sequence[int],
    directions: Sequence[Sequence[float] | None],
    has_time: bool,
) -> tuple[list[int], int | None]:
    """The axes in space, and the axis that counts layers: the one that has no direction.

    Raises:
        ImageError: There are not three axes in space, or another one has no voxels of a part.
    """
    kinds = [kind.lower() for kind in header.values("kinds", str)] or ["???"] * len(sizes)
    if len(kinds) != len(sizes):
        raise header.wrong("kinds", f"there are {len(sizes)} axes")
    in_space: list[int] = []
    layers: int | None = None
    for axis, (kind, direction) in enumerate(zip(kinds, directions, strict=True)):
        if direction is not None and has_time and any(direction[:3]) and direction[3]:
            raise header.wrong("space directions", "a direction is in space and in time")
        if direction is not None and not (has_time and not any(direction[:3]) and direction[3]):
            if kind not in ("domain", "space", "???", "none"):
                why = f"axis {axis + 1} is a `{kind}`, and has a direction in space"
                raise header.wrong("kinds", why)
            in_space.append(axis)
        elif sizes[axis] > 1:
            if direction is not None or kind == "time":
                why = f"axis {axis + 1} counts {sizes[axis]} moments of time"
                raise header.wrong("sizes", why, "save one moment")
            if not _LAYER_KINDS.fullmatch(kind):
                raise header.wrong("kinds", f"a `{kind}` has no parts", "save a segmentation")
            if layers is not None:
                raise header.wrong("space directions", "two axes are not in space")
            layers = axis
    if len(in_space) != 3:
        why = f"{len(in_space)} axes are in space, not 3"
        raise header.wrong("space directions", why, "save one volume")
    return in_space, layers


def _refuse_spacings(header: Header, rows: NDArray[np.float64], in_space: Sequence[int]) -> None:
    """Spacings are said by the lengths of the directions; if they are said again, they agree.

    Raises:
        ImageError: They do not.
    """
    spacings = header.values("spacings", float)
    if not spacings:
        return
    for axis, row in zip(in_space, rows, strict=True):
        spacing = spacings[axis] if axis < len(spacings) else math.nan
        length = math.hypot(*map(float, row))
        if not math.isnan(spacing) and abs(spacing - length) > 1e-4 * length:
            why = f"the direction of axis {axis + 1} has the length {length:g}"
            raise header.wrong("spacings", why, "remove the field that is wrong")


def _unit_mm(header: Header) -> float | None:
    """The unit of all axes in mm: that of Slicer if the file says none.

    Raises:
        ImageError: The axes have different ones, or one that is not known.
    """
    text = header.fields.get("space units")
    if text is None:
        return 1.0
    units = re.findall(r'"([^"]*)"', text)
    known = {_UNITS_MM.get(unit.strip().lower()) for unit in units[:3]}
    if len(known) != 1 or None in known:
        raise ImageError(
            "unit-unknown",
            f"`space units: {text[:60]}` in `{header.path}` is no unit of length",
            'save it in mm, with `space units: "mm" "mm" "mm"`, or without this field',
        )
    return known.pop()


# ----------------------------------------------------------------------------------------- voxels


def _dtype(header: Header) -> np.dtype[np.generic]:
    import numpy as np

    word = header.fields.get("type", "").lower()
    word = word.removesuffix(" int") if word.endswith(("short int", "long long int")) else word
    if word not in _TYPES:
        raise header.wrong("type", "this is no type of numbers")
    dtype = np.dtype(_TYPES[word])
    if dtype.itemsize == 1 or header.fields.get("encoding", "").lower() in ("text", "txt", "ascii"):
        return dtype
    endian = header.fields.get("endian", "").lower()
    if endian not in ("little", "big"):
        raise header.wrong("endian", "it must be `little` or `big` for such a `type`")
    return dtype.newbyteorder("<" if endian == "little" else ">")


def _packed(header: Header, data: bytes) -> Packed:
    """Where the voxels are in the bytes of their file."""
    word = header.fields.get("encoding", "").lower()
    if word not in _ENCODINGS:
        raise header.wrong("encoding", "it must be raw, gzip, bzip2 or text")
    encoding = _ENCODINGS[word]
    start = 0 if "data file" in header.fields else header.end
    for _ in range(min(header.whole("line skip"), len(data))):
        start = data.find(b"\n", start) + 1
        if not start:
            raise header.wrong("line skip", "the file has fewer lines")
    skipped = header.whole("byte skip")
    if skipped == -1 and encoding == "raw":
        count = math.prod(header.values("sizes", int))
        return Packed(data, max(start, len(data) - count * _dtype(header).itemsize), encoding)
    if skipped < 0 or header.whole("line skip") < 0:
        raise header.wrong("byte skip", "it cannot be negative here")
    return Packed(data, start, encoding, skipped)


def _data_file(header: Header) -> str | None:
    """The file that has the voxels, if it is another one; it must lie beside the header.

    Raises:
        ImageError: It lies elsewhere, or there are several.
    """
    name = header.fields.get("data file")
    if name is None:
        return None
    folder = os.path.dirname(header.path)
    path = os.path.join(folder, name)
    is_plain = name not in ("", ".", "..") and not re.search(r"[/\\:%\0]|\s\d", name)
    if name.split()[:1] == ["LIST"] or not is_plain:
        raise header.wrong(
            "data file",
            "only one file that lies beside this one can be read",
            "save it as one file (.nrrd with the data attached)",
        )
    if os.path.dirname(os.path.realpath(path)) != os.path.realpath(folder):
        raise header.wrong("data file", "this file is a link to another folder", "copy it here")
    return path


def _segments(header: Header, has_layers: bool) -> tuple[Segment, ...]:
    """The segments as Slicer writes them: ``Segment0_Name``, ``Segment0_LabelValue`` and so on."""
    numbers = {
        int(found[1])
        for key in header.keys
        if (found := re.fullmatch(r"Segment(\d{1,6})_(?:Name|ID|LabelValue)", key))
    }
    segments = []
    for number in sorted(numbers):
        key = f"Segment{number}"
        name = header.keys.get(f"{key}_Name", header.keys.get(f"{key}_ID", ""))
        value = _number(header.keys.get(f"{key}_LabelValue", ""))
        layer = _number(header.keys.get(f"{key}_Layer", "" if has_layers else "0"))
        segments.append(Segment(name, key, value, layer))
    return tuple(segments)


def _number(text: str) -> int | None:
    return int(text) if re.fullmatch(r"-?[0-9]{1,18}", text) else None
