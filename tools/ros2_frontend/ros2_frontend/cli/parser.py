# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""From the tree of commands to an argparse parser that knows only what the arguments name."""

from __future__ import annotations

from argparse import ArgumentParser, RawDescriptionHelpFormatter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from .commands import Command, Group
from .verb import Verb

PROGRAM = 'ros2'


@dataclass(frozen=True, slots=True)
class CommandLine:
    """A parser together with what it leads to.

    Attributes:
        parser: The root parser.
        help_of: The parser whose help is wanted when no verb is named.
        verb: The verb that the arguments name, None for `ros2` or `ros2 topic` alone.
    """

    parser: ArgumentParser
    help_of: ArgumentParser
    verb: Verb | None


def build(commands: Mapping[str, Command | Group], argv: Sequence[str]) -> CommandLine:
    """Make the parser for one command line.

    Args:
        commands: The tree of commands.
        argv: The arguments, without the program's name.

    Returns:
        A parser in which only the named command has its arguments.
    """
    words = [word for word in argv if not word.startswith('-')][:2]
    root = ArgumentParser(
        prog=PROGRAM,
        description=f'{PROGRAM} is an extensible command-line tool for ROS 2.',
        formatter_class=RawDescriptionHelpFormatter,
    )
    root.add_argument(
        '--use-python-default-buffering',
        action='store_true',
        help='Do not force line buffering in stdout and instead use the python default '
        'buffering, which might be affected by PYTHONUNBUFFERED/-u and depends on whatever '
        'stdout is interactive or not',
    )
    summaries = {name: command.summary for name, command in commands.items()}
    parsers = _add_commands(root, PROGRAM, summaries)
    chosen = commands.get(words[0]) if words else None
    if chosen is None:
        return CommandLine(root, root, None)
    parser = parsers[words[0]]
    if isinstance(chosen, Command):
        return CommandLine(root, parser, _attach(chosen, parser))
    return _build_group(root, parser, chosen, words)


def _build_group(
    root: ArgumentParser, parser: ArgumentParser, group: Group, words: Sequence[str]
) -> CommandLine:
    for option, help_ in group.flags.items():
        parser.add_argument(option, action='store_true', help=help_)
    summaries = {name: verb.summary for name, verb in group.verbs.items()}
    parsers = _add_commands(parser, f'{PROGRAM} {words[0]}', summaries)
    verb = group.verbs.get(words[1]) if len(words) > 1 else None
    if verb is None:
        return CommandLine(root, parser, None)
    return CommandLine(root, parser, _attach(verb, parsers[words[1]]))


def _attach(command: Command, parser: ArgumentParser) -> Verb:
    verb = command.load()
    verb.add_arguments(parser)
    return verb


def _add_commands(
    parser: ArgumentParser, cli_name: str, summaries: Mapping[str, str]
) -> dict[str, ArgumentParser]:
    """Add sub-parsers and the list of them that the help page shows."""
    width = max(map(len, summaries))
    listing = '\n'.join(f'{name.ljust(width)}  {text}' for name, text in summaries.items())
    # not required: without a verb the group's help is shown, with exit code 0
    subparsers = parser.add_subparsers(
        title='Commands',
        description=listing,
        metavar=f'Call `{cli_name} <command> -h` for more detailed usage.',
        required=False,
    )
    return {
        name: subparsers.add_parser(
            name, description=text, formatter_class=RawDescriptionHelpFormatter
        )
        for name, text in summaries.items()
    }
