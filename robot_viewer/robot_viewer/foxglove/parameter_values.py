# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of all nodes by one name each, `/node.parameter`, and values that keep their type."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
import threading

Value = bool | int | float | str | bytes | list[bool] | list[int] | list[float] | list[str]


class ParameterValueError(ValueError):
    """A value that a parameter cannot have."""


def full_name(node: str, parameter: str) -> str:
    """Return the name of a parameter among those of all nodes.

    Args:
        node: Full name of the node.
        parameter: Name of the parameter.
    """
    return f'{node}.{parameter}'


def split_name(name: str) -> tuple[str, str]:
    """Return node and parameter; names of nodes have no dot.

    Raises:
        ParameterValueError: There is no dot.
    """
    node, dot, parameter = name.partition('.')
    if not dot or not node or not parameter:
        raise ParameterValueError(f'{name!r} names no parameter; write /node.parameter')
    return node, parameter


def fitted(name: str, value: object, present: Value | None) -> Value:
    """Return a value with the type that the parameter has: JSON does not distinguish 2 from 2.0.

    Args:
        name: Of the parameter, for messages.
        value: What a client sends.
        present: The parameter's value now; None where it is not known.

    Raises:
        ParameterValueError: No parameter can have it.
    """
    if isinstance(value, list):
        kinds = {type(each) for each in value}
        if kinds <= {int, float} and (float in kinds or _is_list_of_floats(present)):
            return [float(each) for each in value]
        if len(kinds) <= 1 and kinds <= {bool, int, str}:
            return value
    elif isinstance(value, int) and not isinstance(value, bool) and isinstance(present, float):
        return float(value)
    elif isinstance(value, (bool, int, float, str, bytes)):
        return value
    raise ParameterValueError(f'{name} cannot be {value!r}')


def _is_list_of_floats(value: Value | None) -> bool:
    return isinstance(value, list) and bool(value) and isinstance(value[0], float)


class ParameterTable:
    """Values of the parameters of all nodes, as they were last reported; any thread may ask."""

    def __init__(self, shown: Callable[[str], bool]) -> None:
        """Know nothing.

        Args:
            shown: Whether a full name is to be kept at all.
        """
        self._shown = shown
        self._values: dict[str, Value] = {}
        self._lock = threading.Lock()

    def update(self, values: Mapping[str, Value | None]) -> dict[str, Value | None]:
        """Take values; return those that are shown.

        Args:
            values: By full name; None for a parameter that is no longer there.
        """
        taken = {name: value for name, value in values.items() if self._shown(name)}
        with self._lock:
            for name, value in taken.items():
                if value is None:
                    self._values.pop(name, None)
                else:
                    self._values[name] = value
        return taken

    def forget(self, node: str) -> None:
        """Drop what a node had."""
        with self._lock:
            for name in [name for name in self._values if name.startswith(f'{node}.')]:
                del self._values[name]

    def get(self, names: Sequence[str] = ()) -> dict[str, Value]:
        """Return values by full name, of all when no name is given; unknown names are left out."""
        with self._lock:
            wanted = names or sorted(self._values)
            return {name: self._values[name] for name in wanted if name in self._values}
