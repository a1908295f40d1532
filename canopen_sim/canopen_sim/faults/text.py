# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Faults as people write them: a name, and settings as text."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
import difflib
import re

from arm_canopen.standard import AbortCode

from ..fault import Fault, FaultInjection, FAULTS

OBJECT = re.compile(r'(?:0x)?([0-9a-f]{4})(?:[:/]([0-9a-f]{1,2}))?', re.IGNORECASE)
KEPT_WORDS = {'true': True, 'yes': True, 'kept': True, 'false': False, 'no': False, 'lost': False}


def suggestion(name: str, known: Iterable[str]) -> str:
    """Return the known name that is nearest to a wrong one, or all when none is near."""
    names = list(known)
    close = difflib.get_close_matches(name, names, n=1)
    return f'did you mean {close[0]!r}?' if close else f'choose one of {", ".join(names)}'


def unknown(what: str, name: str, known: Iterable[str]) -> str:
    """Return that a name is unknown, with a suggestion."""
    return f'unknown {what} {name!r}; {suggestion(name, known)}'


def fault_named(name: str) -> Fault:
    """Return the fault with a name.

    Raises:
        ValueError: There is none; the message lists all.
    """
    fault = FAULTS.get(name)
    if fault is None:
        raise ValueError(unknown('fault', name, FAULTS))
    return fault


def parse_fault(name: str, settings: Mapping[str, str], **values: float) -> FaultInjection:
    """Read a fault.

    Args:
        name: Its name.
        settings: Text of each setting by its name.
        **values: Settings that are known as values.

    Raises:
        ValueError: A name is unknown, or a value has no meaning.
    """
    fault = fault_named(name)
    known = ('duration', *fault.value.settings)
    fields: dict[str, object] = dict(values)
    for setting, text in settings.items():
        if setting not in known:
            raise ValueError(unknown(f'setting of {name}', setting, known))
        fields[setting] = _read(setting, text.strip())
    return FaultInjection(fault, **fields)  # type: ignore[arg-type]  # checked by its class


def split_settings(lines: Iterable[str]) -> dict[str, str]:
    """Read ``name=value`` texts.

    Raises:
        ValueError: A text has no ``=``, or a name stands twice.
    """
    settings: dict[str, str] = {}
    for line in lines:
        name, equals, value = line.partition('=')
        name = name.strip()
        if not equals or not name:
            raise ValueError(f"{line!r} is not a setting; write 'name=value'")
        if name in settings:
            raise ValueError(f'{name!r} stands twice')
        settings[name] = value
    return settings


def _read(setting: str, text: str) -> object:
    reader, wanted = READERS.get(setting, (_whole, 'a whole number, such as 10 or 0x0A'))
    try:
        return reader(text)
    except ValueError:
        raise ValueError(f'{setting} is {text!r}; expected {wanted}') from None


def _whole(text: str) -> int:
    value = int(text, 0)
    if not 0 <= value < 1 << 32:
        raise ValueError(text)
    return value


def _signed(text: str) -> int:
    return int(text, 0)


def _object(text: str) -> tuple[int, int]:
    match = OBJECT.fullmatch(text)
    if match is None:
        raise ValueError(text)
    return int(match[1], 16), int(match[2] or '0', 16)


def _abort(text: str) -> int:
    name = text.upper()
    return AbortCode[name] if name in AbortCode.__members__ else _whole(text)


def _kept(text: str) -> bool:
    word = KEPT_WORDS.get(text.lower())
    if word is None:
        raise ValueError(text)
    return word


READERS: dict[str, tuple[Callable[[str], object], str]] = {
    'duration': (float, 'a time in [s]'),
    'delay': (float, 'a time in [s]'),
    'probability': (float, 'a number of 0 to 1'),
    'velocity': (float, 'a number of [inc/s]'),
    'acceleration': (float, 'a number of [inc/s^2]'),
    'position': (_signed, 'a whole number of [inc]'),
    'value': (_signed, 'a whole number, such as -1000 or 0x0A'),
    'object': (_object, "an object, such as 0x6064 or '0x607D:02'"),
    'abort': (_abort, 'an SDO abort code, such as 0x08000000 or general'),
    'position_kept': (_kept, 'true or false'),
}
"""How the text of a setting is read, and what it should be; all others are whole numbers."""
