# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 interface list`, `package`, `packages`, `proto` and `show`."""

from __future__ import annotations

from argparse import Namespace
import sys

from ..cli.commands import Argument, argument, exclusive, flag, FrontendError, verb
from ..index import (
    all_interfaces,
    class_of,
    definition_path,
    expand,
    interfaces_of,
    Kind,
)

_TITLES = {Kind.MESSAGE: 'Messages', Kind.SERVICE: 'Services', Kind.ACTION: 'Actions'}
_FLAGS = {
    Kind.MESSAGE: ('-m', 'msgs'),
    Kind.SERVICE: ('-s', 'srvs'),
    Kind.ACTION: ('-a', 'actions'),
}


def _kind_flags(help_: str) -> tuple[Argument, ...]:
    return tuple(
        argument(
            short,
            f'--only-{noun}',
            dest='kinds',
            action='append_const',
            const=kind,
            help=help_.format(kind.name.lower()),
        )
        for kind, (short, noun) in _FLAGS.items()
    )


@verb(*_kind_flags('Print out only the {} types'))
def list_all(args: Namespace) -> None:
    """Print the types, grouped by kind."""
    for kind, title in _TITLES.items():
        if args.kinds and kind not in args.kinds:
            continue
        print(f'{title}:')
        for names in all_interfaces([kind]).values():
            for name in names:
                print(f'    {name}')


@verb(*_kind_flags('Only list packages that generate {}s'))
def packages(args: Namespace) -> None:
    """Print the packages that define types."""
    for name in all_interfaces(args.kinds or Kind):
        print(name)


@verb(argument('package_name', help="Name of the ROS package (e.g. 'example_interfaces')"))
def package(args: Namespace) -> None:
    """Print the types of one package."""
    for name in interfaces_of(args.package_name):
        print(name)


@verb(
    argument('type', help="Show an interface definition (e.g. 'example_interfaces/msg/String')"),
    flag('--no-quotes', help='if true output has no outer quotes.'),
)
def proto(args: Namespace) -> None:
    """Print the defaults of a message, request or goal as YAML."""
    from ..messages.fill import to_document, to_yaml

    kind = Kind(definition_path(args.type).parent.name)
    found = class_of(args.type, kind, 'The passed interface type is invalid')
    part = {Kind.SERVICE: 'Request', Kind.ACTION: 'Goal'}.get(kind)
    message = getattr(found, part)() if part else found()
    text = to_yaml(to_document(message))
    print(text if args.no_quotes else f'"{text}"')


@verb(
    exclusive(
        flag(
            '--all-comments',
            help='Show all comments, including for nested interface definitions',
        ),
        flag('--no-comments', help='Show no comments or whitespace'),
    ),
    argument(
        'type',
        help="Show an interface definition (e.g. 'example_interfaces/msg/String'). "
        "Passing '-' reads the argument from stdin (e.g. "
        "'ros2 topic type /chatter | ros2 interface show -').",
    ),
)
def show(args: Namespace) -> None:
    """Print the definition with those of its fields' types."""
    name = sys.stdin.readline().strip() if args.type == '-' else args.type
    if not name:
        raise FrontendError('the passed value is empty')

    def read(type_: str) -> str:
        return definition_path(type_).read_text(encoding='utf-8')

    for line in expand(name, read, not args.no_comments, args.all_comments):
        print(line)
