# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How a key of bus.yml is declared: once, as the field of the record that it fills."""

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
    """What stands behind a key."""

    INTEGER = auto()
    NUMBER = auto()
    BOOLEAN = auto()
    TEXT = auto()
    BLOCK = auto()  # a list or a mapping with a reader of its own


class Use(Enum):
    """What is made of a key."""

    READ = auto()  # fills its field
    IGNORED = auto()  # accepted: what it requests is so anyway
    UNUSED = auto()  # warned of: known, not used yet; its field is for other tools' files
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
    text: str  # its meaning, for docs/bus_yml.md
    span: tuple[float, float] | None = None  # smallest and largest value, in units of the file
    # units of the file per unit of the model, 1000 for [ms]; None for no conversion
    unit: float | None = None
    zero: bool | None = None  # True allows 0 beside the span, False refuses it
    choices: Mapping[Any, str] | None = None  # the only values allowed, with their meaning
    form: re.Pattern[str] | None = None  # that a text must have; ``why`` says it
    use: Use = Use.READ
    why: str = ''  # reason for the default, the range or the use, as the user reads it
    name: str = ''
    kind: Kind | None = None
    field: str = ''  # field of the record that it fills

    @property
    def is_kept(self) -> bool:
        """Whether its value fills its field."""
        return self.kind is not Kind.BLOCK and self.use in {Use.READ, Use.UNUSED}


def key(default: Any, text: str, span: tuple[float, float] | None = None, **more: Any) -> Any:  # noqa: ANN401
    """Declare a field that a key fills; the key has the field's name and type unless given."""
    return field(default=default, metadata={'key': Key(default, text, span, **more)})


def keys_of(record: type) -> tuple[Key, ...]:
    """Return the keys of a record, in their order."""
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
