# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How a key of bus.yml is described; the keys stand in ``master_keys`` and ``device_keys``."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from enum import auto, Enum
from typing import Any

from ..findings import RefusedError
from . import scalars
from .document import Item


class Kind(Enum):
    """What stands behind a key."""

    INTEGER = auto()
    NUMBER = auto()
    BOOLEAN = auto()
    TEXT = auto()
    BLOCK = auto()  # a list or a mapping with a reader of its own


class Use(Enum):
    """What is made of a key."""

    READ = auto()  # fills a field of the model
    IGNORED = auto()  # accepted: what it requests is so anyway
    UNUSED = auto()  # warned of: known, not used yet; a field is for other tools' files
    REFUSED = auto()  # ignoring it would change motion or safety, so only its default is accepted


CONVERTERS: dict[Kind, Callable[[Item], Any]] = {
    Kind.INTEGER: scalars.integer,
    Kind.NUMBER: scalars.number,
    Kind.BOOLEAN: scalars.boolean,
    Kind.TEXT: scalars.text,
}


@dataclass(frozen=True, slots=True)
class Key:
    """A key of bus.yml."""

    name: str
    kind: Kind  # what stands behind it
    field: str = ''  # attribute of the model that it fills
    # units of the file per unit of the model, 1000 for [ms]; None for no conversion
    per_unit: float | None = None
    low: float | None = None  # smallest value, in units of the file
    high: float | None = None  # largest value, in units of the file
    zero: bool | None = None  # True allows 0 beside the range, False refuses it within the range
    choices: Mapping[int, str] | None = None  # the only values allowed, with their meaning
    # value of an absent key in units of the file, where no record of settings has it
    default: Any = None
    neutral: Any = None  # value with which a key that is not used, or refused, requests nothing
    use: Use = Use.READ  # what is made of it
    why: str = ''  # reason for the default, the range or the use, as the user reads it

    def convert(self, item: Item) -> Any:  # noqa: ANN401 (the kind decides)
        """Return a value in units of the file.

        Raises:
            RefusedError: It is of another kind or out of range.
        """
        value = CONVERTERS[self.kind](item)
        if self.choices is not None and value not in self.choices:
            known = ', '.join(f'{number} {title}' for number, title in self.choices.items())
            raise RefusedError(f'{value} is not allowed here', f'take one of: {known}{self._why}')
        if not self._in_range(value):
            raise RefusedError(
                f'{scalars.describe(item)} is out of range', f'take {self._range}{self._why}'
            )
        return value

    def _in_range(self, value: float | str) -> bool:
        if isinstance(value, str):
            return True
        if value == 0 and self.zero is not None:
            return self.zero
        return (self.low is None or value >= self.low) and (
            self.high is None or value <= self.high
        )

    def to_model(self, value: Any) -> Any:  # noqa: ANN401 (the kind decides)
        """Convert from units of the file to those of the model."""
        return value if self.per_unit is None else value / self.per_unit

    @property
    def _range(self) -> str:
        if self.low is None or self.high is None:
            return 'a value other than 0'
        return f'{"0 or " if self.zero else ""}{self.low:g} to {self.high:g}'

    @property
    def _why(self) -> str:
        return f'; {self.why}' if self.why else ''
