# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Declaration of bus.yml keys: each one once, as the dataclass field that it fills."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from enum import auto, Enum
import re
from typing import Any

MILLISECONDS = 1e3  # per second
MICROSECONDS = 1e6
HUNDRED_MICROSECONDS = 1e4
KILOBIT = 1e-3  # kbit/s per bit/s


class Kind(Enum):
    """Type of the value of a key."""

    INTEGER = auto()
    NUMBER = auto()
    BOOLEAN = auto()
    TEXT = auto()
    BLOCK = auto()  # a list or a mapping with a reader of its own


class Use(Enum):
    """How the master treats a key."""

    READ = auto()  # fills its field
    IGNORED = auto()  # accepted without effect: what it requests is always the case
    UNUSED = auto()  # accepted with a warning; its field is for other tools' files
    REFUSED = auto()  # ignoring it would change motion or safety, so only its default is accepted


KINDS = {
    'int': Kind.INTEGER,
    'float': Kind.NUMBER,
    'bool': Kind.BOOLEAN,
    'str': Kind.TEXT,
    'None': Kind.BLOCK,  # the field stays empty
}
"""Kind of a key by the type of its field."""


@dataclass(frozen=True, slots=True)
class Key:
    """A key of bus.yml."""

    default: Any  # in units of the model
    text: str  # description for docs/bus_yml.md
    span: tuple[float, float] | None = None  # smallest and largest value, in units of the file
    # units of the file per unit of the model, 1000 for [ms]; None for no conversion
    unit: float | None = None
    zero: bool | None = None  # True also allows 0 outside the span, False refuses 0
    choices: Mapping[Any, str] | None = None  # the only values allowed, with their meaning
    form: re.Pattern[str] | None = None  # pattern that a text must match, explained by ``why``
    use: Use = Use.READ
    why: str = ''  # reason for the default, the range or the use, as the user reads it
    name: str = ''
    kind: Kind | None = None
    field: str = ''  # field of the record that it fills

    @property
    def is_kept(self) -> bool:
        """Whether the value of the key is stored in its field."""
        return self.kind is not Kind.BLOCK and self.use in {Use.READ, Use.UNUSED}


def key(default: Any, text: str, span: tuple[float, float] | None = None, **more: Any) -> Any:  # noqa: ANN401
    """Declare a field filled by a key, which has its name and type unless ``more`` overrides."""
    return field(default=default, metadata={'key': Key(default, text, span, **more)})


def keys_of(record: type) -> tuple[Key, ...]:
    """Return the keys that a dataclass declares, in field order."""
    return tuple(
        replace(
            declared,
            name=declared.name or each.name,
            field=each.name,
            kind=declared.kind or KINDS[str(each.type).removesuffix(' | None')],
        )
        for each in fields(record)
        if isinstance(declared := each.metadata.get('key'), Key)
    )
