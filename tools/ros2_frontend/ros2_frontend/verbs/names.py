# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Shared verbs of topics, services and actions: `list`, `find`, `type`, `info`."""

from __future__ import annotations

from argparse import Namespace, SUPPRESS
from collections.abc import Callable
from dataclasses import dataclass
import sys

from ..cli.commands import Argument, argument, flag, hint, UnknownNameError
from ..names import absolute, is_hidden, NamesAndTypes
from ..ros.graph import Graph


@dataclass(frozen=True, slots=True)
class Names:
    """One kind of names in the ROS graph: topics, services or actions."""

    kind: str  # what they name, in the singular
    # returns names and types; hidden ones, too, when the second argument is true
    read: Callable[[Graph, bool], NamesAndTypes]

    def list_arguments(self, types: bool = True, hidden: bool = True) -> tuple[Argument, ...]:
        """Return the switches of `list` or, with `types` off, of `find`."""
        count = f'Only display the number of {self.kind}s discovered'
        found = [flag('-c', f'--count-{self.kind}s', dest='count', help=count)]
        if types:
            found.insert(0, self.types_flag())
        if hidden:  # the group has the same before its verb
            text = f'Consider hidden {self.kind}s as well'
            option = f'--include-hidden-{self.kind}s'
            found.append(flag(option, default=SUPPRESS, help=text))
        return tuple(found)

    def types_flag(self) -> Argument:
        """Return the switch that also shows types."""
        return flag('-t', '--show-types', help=f'Additionally show the {self.kind} type')

    def name_argument(self, purpose: str, example: str) -> Argument:
        """Return the argument for the name, with an example for the help."""
        text = f"Name of the ROS {self.kind} to {purpose} (e.g. '{example}')"
        return argument(f'{self.kind}_name', help=text)

    def type_argument(self, example: str) -> Argument:
        """Return the argument for the wanted type, with an example for the help."""
        text = f"Name of the ROS {self.kind} type to filter for (e.g. '{example}')"
        return argument(f'{self.kind}_type', help=text)

    def shown(self, graph: Graph, args: Namespace) -> NamesAndTypes:
        """Wait for the whole graph, and return the names that the options select."""
        graph.settle()
        return self.read(graph, self._hidden(args))

    def print_list(self, graph: Graph, args: Namespace) -> None:
        """Execute `list`."""
        pairs = self.shown(graph, args)
        _print(
            [f'{name} [{", ".join(types)}]' if args.show_types else name for name, types in pairs],
            args,
        )

    def print_found(self, graph: Graph, args: Namespace) -> None:
        """Execute `find`."""
        wanted = getattr(args, f'{self.kind}_type')
        _print([name for name, types in self.shown(graph, args) if wanted in types], args)

    def print_type(self, graph: Graph, args: Namespace) -> int:
        """Print the types, one per line. Exit code 1 when there is no such name, as in ros2cli."""
        name = getattr(args, f'{self.kind}_name')
        try:
            types = self._types_of(name, graph, f"Unknown name '{name}'", self._hidden(args))
        except UnknownNameError as error:
            print(error, file=sys.stderr)
            return 1
        print(*types, sep='\n')
        return 0

    def print_info_type(self, graph: Graph, args: Namespace, end: str = '\n') -> str:
        """Print the first line of `info` after discovery; return the absolute name."""
        name = getattr(args, f'{self.kind}_name')
        types = self._types_of(name, graph, f"Unknown {self.kind} '{name}'")
        graph.settle()
        print(f'Type: {types[0] if len(types) == 1 else types}', end=end)
        return absolute(name)

    def _hidden(self, args: Namespace) -> bool:
        return getattr(args, f'include_hidden_{self.kind}s', True)

    def _types_of(
        self, name: str, graph: Graph, unknown: str, hidden: bool | None = None
    ) -> list[str]:
        """Wait for a name; `hidden` as for `read`, None lets its own spelling decide."""
        wanted = absolute(name)
        types = graph.wait_for(lambda: dict(self.read(graph, hidden is not False)).get(wanted))
        if types is None:
            near = is_hidden(wanted) if hidden is None else hidden
            raise UnknownNameError(unknown + hint(wanted, dict(self.read(graph, near))))
        return types


def _print(lines: list[str], args: Namespace) -> None:
    for line in [len(lines)] if args.count else lines:
        print(line)
