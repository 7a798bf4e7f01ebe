"""A CBOR map of plain values and typed arrays, and nothing else of CBOR.

cbor2 writes our payloads and could read them, but it also builds dates, decimals, regular expressions, bignums and
shared references on a stranger's demand. This reader knows RFC 8949 heads, text keys, integers, floats, null, texts
and the RFC 8746 tags it is told of; lengths are compared with what is there before anything is made.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from plant.errors import PayloadError

MAX_ENTRIES = 32
MAX_TEXT = 256  # bytes
_HALF, _SINGLE, _DOUBLE = 25, 26, 27


@dataclass(frozen=True, slots=True)
class TypedArray:
    """An RFC 8746 array as it stands in the payload: its tag and the bytes, not yet numbers."""

    tag: int
    data: memoryview


Value = int | float | str | bool | TypedArray | None


def read_map(payload: bytes, tags: frozenset[int]) -> dict[str, Value]:
    """Read a payload that is one CBOR map with text keys; typed arrays only with a tag of `tags`.

    Raises:
        PayloadError: `bad_cbor` (truncated, trailing bytes, another item than the above), `bad_tag`, `duplicate_key`.
    """
    view = memoryview(payload)
    major, count, at = _head(view, 0)
    if major != 5:
        raise PayloadError("bad_cbor", "the payload is not a CBOR map")
    if count > MAX_ENTRIES:
        raise PayloadError("bad_cbor", f"the map has {count} entries, at most {MAX_ENTRIES} make sense")
    content: dict[str, Value] = {}
    for _ in range(count):
        key, at = _item(view, at, frozenset())
        if not isinstance(key, str):
            raise PayloadError("bad_cbor", "a key of the map is not text")
        if key in content:
            raise PayloadError("duplicate_key", f"key {key[:40]!r} stands twice")
        content[key], at = _item(view, at, tags)
    if at != len(view):
        raise PayloadError("bad_cbor", f"{len(view) - at} bytes after the end of the map")
    return content


def _head(view: memoryview, at: int) -> tuple[int, int, int]:
    """Read an item's head: major type, argument, where its content starts. Floats keep their width as argument."""
    if at >= len(view):
        raise PayloadError("bad_cbor", "the payload ends in the middle of an item")
    major, info = view[at] >> 5, view[at] & 31
    if info < 24 or major == 7:
        return major, info, at + 1
    if info > 27:
        raise PayloadError("bad_cbor", "indefinite lengths and reserved heads are not read")
    width = 1 << (info - 24)
    return major, int.from_bytes(_take(view, at + 1, width), "big"), at + 1 + width


def _take(view: memoryview, at: int, count: int) -> memoryview:
    if count > len(view) - at:
        raise PayloadError("bad_cbor", f"an item claims {count} bytes, {len(view) - at} are left")
    return view[at : at + count]


def _item(view: memoryview, at: int, tags: frozenset[int]) -> tuple[Value, int]:
    major, argument, at = _head(view, at)
    match major:
        case 0:
            return argument, at
        case 1:
            return -1 - argument, at
        case 3:
            return _text(_take(view, at, min(argument, MAX_TEXT + 1))), at + argument
        case 6:
            return _typed_array(view, at, argument, tags)
        case 7:
            return _simple(view, at, argument)
    raise PayloadError("bad_cbor", "byte strings, arrays and maps stand nowhere but in typed arrays")


def _text(data: memoryview) -> str:
    if len(data) > MAX_TEXT:
        raise PayloadError("bad_cbor", f"a text is longer than {MAX_TEXT} bytes")
    try:
        return bytes(data).decode()
    except UnicodeDecodeError:
        raise PayloadError("bad_cbor", "a text is not UTF-8") from None


def _typed_array(view: memoryview, at: int, tag: int, tags: frozenset[int]) -> tuple[TypedArray, int]:
    if tag not in tags:
        allowed = ", ".join(map(str, sorted(tags))) or "none here"
        raise PayloadError("bad_tag", f"tag {tag} is not one of the typed arrays we read ({allowed})")
    major, count, at = _head(view, at)
    if major != 2:
        raise PayloadError("bad_tag", f"tag {tag} must stand before a byte string")
    return TypedArray(tag, _take(view, at, count)), at + count


def _simple(view: memoryview, at: int, info: int) -> tuple[Value, int]:
    if info in (20, 21, 22):
        return {20: False, 21: True, 22: None}[info], at
    if info not in (_HALF, _SINGLE, _DOUBLE):
        raise PayloadError("bad_cbor", f"simple value {info} is not read")
    form = {_HALF: ">e", _SINGLE: ">f", _DOUBLE: ">d"}[info]
    width = struct.calcsize(form)
    return float(struct.unpack(form, _take(view, at, width))[0]), at + width
