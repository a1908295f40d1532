# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Values of parameters as they were written: taken for what they have to be, or refused."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
import math
from typing import TypeVar

from .exceptions import ParameterError
from .misspelt import closest

Choice = TypeVar('Choice')

ALIKE = 0.6  # what is chosen from is known, so the suggestion may be a bold one


def text(name: str, value: object) -> str:
    """Return a text.

    Raises:
        ParameterError: It is something else.
    """
    if not isinstance(value, str):
        raise ParameterError(f'{name} is {value!r}: it must be a text')
    return value


def flag(name: str, value: object) -> bool:
    """Return a switch.

    Raises:
        ParameterError: It is neither true nor false.
    """
    if not isinstance(value, bool):
        raise ParameterError(f'{name} is {value!r}: it must be true or false')
    return value


def whole(name: str, value: object, span: tuple[int, int]) -> int:
    """Return a whole number within a range.

    Raises:
        ParameterError: It is something else, or out of the range.
    """
    if isinstance(value, bool) or not isinstance(value, int):
        raise ParameterError(f'{name} is {value!r}: it must be a whole number')
    _check_span(name, value, span)
    return value


def number(name: str, value: object, span: tuple[float, float] | None) -> float:
    """Return a number, which may be written without a decimal point.

    Raises:
        ParameterError: It is something else, or out of the range.
    """
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise ParameterError(f'{name} is {value!r}: it must be a number')
    if math.isnan(value):
        raise ParameterError(f'{name} is nan: it must be a number')
    if span is not None:
        _check_span(name, value, span)
    return float(value)


def numbers(name: str, value: object) -> tuple[float, ...]:
    """Return a list of numbers.

    Raises:
        ParameterError: It is something else, or one of them is not finite.
    """
    read = tuple(number(name, each, None) for each in _items(name, value, 'numbers'))
    if not all(map(math.isfinite, read)):
        raise ParameterError(f'{name} is {list(read)}: all of them must be finite')
    return read


def texts(name: str, value: object) -> list[str]:
    """Return a list of texts.

    Raises:
        ParameterError: It is something else.
    """
    return [text(name, each) for each in _items(name, value, 'texts')]


def choice(name: str, value: object, values: Mapping[str, Choice]) -> Choice:
    """Return what one of several names stands for.

    Raises:
        ParameterError: It is none of them; the message names the likely one.
    """
    chosen = text(name, value)
    if chosen not in values:
        meant = closest(chosen, values, ALIKE)
        question = f'; did you mean {meant!r}?' if meant else ''
        raise ParameterError(f'{name} is {chosen!r}: it must be {_or(list(values))}{question}')
    return values[chosen]


def _check_span(name: str, value: float, span: tuple[float, float]) -> None:
    low, high = span
    if not low <= value <= high:  # which no nan is
        raise ParameterError(f'{name} is {value}: it must be {low} to {high}')


def _items(name: str, value: object, what: str) -> list[object]:
    if isinstance(value, str | bytes) or not isinstance(value, Iterable):
        raise ParameterError(f'{name} is {value!r}: it must be a list of {what}')
    return list(value)


def _or(words: list[str]) -> str:
    return ' or '.join(filter(None, [', '.join(words[:-1]), words[-1]]))
