# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 param dump` and `load`."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from pathlib import Path
import sys

from ..cli.errors import FrontendError
from ..messages.parameter_file import dump, values_for
from ..ros.graph import open_graph
from ..ros.parameters import get_values, list_names, parameter, set_values, value_of
from .node_argument import add_node_argument, find_node


class Dump:
    """Show all of the parameters of a node in a YAML file format."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_node_argument(parser)

    def main(self, args: Namespace) -> None:
        """Print the parameters as a file that `load` and `--params-file` read.

        Raises:
            UnknownNameError: When there is no such node.
        """
        with open_graph(args) as graph:
            node = find_node(args.node_name, graph, args.include_hidden_nodes)
            names = list_names(graph.session, node)
            values = [value_of(value) for value in get_values(graph.session, node, names)]
        print(dump(node.full_name, dict(zip(names, values, strict=True))))


class Load:
    """Load parameter file for a node."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_node_argument(parser)
        parser.add_argument('parameter_file', help='Parameter file')
        parser.add_argument(
            '--no-use-wildcard',
            action='store_true',
            help="Do not load parameters in the '/**' namespace into the node",
        )

    def main(self, args: Namespace) -> None:
        """Set all parameters of a file that are for the node; tell each result.

        Raises:
            UnknownNameError: When there is no such node.
            FrontendError: When the file cannot be read or has nothing for the node.
        """
        text = _read(args.parameter_file)
        with open_graph(args) as graph:
            node = find_node(args.node_name, graph, args.include_hidden_nodes)
            wanted = values_for(node.full_name, text, use_wildcard=not args.no_use_wildcard)
            parameters = [parameter(name, value) for name, value in wanted.items()]
            results = set_values(graph.session, node, parameters)
        for name, result in zip(wanted, results, strict=True):
            outcome = 'successful' if result.successful else 'failed'
            reason = f': {result.reason}' if result.reason else ''
            stream = sys.stdout if result.successful else sys.stderr
            print(f'Set parameter {name} {outcome}{reason}', file=stream)


def _read(path: str) -> str:
    try:
        return Path(path).read_text(encoding='utf-8')
    except OSError as error:
        raise FrontendError(f"{error.strerror}: '{path}'") from None
