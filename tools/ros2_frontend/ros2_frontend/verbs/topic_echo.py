# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 topic echo`."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Mapping
import re
from typing import Any

from ..cli.commands import (
    argument,
    flag,
    FrontendError,
    GRAPH_ARGUMENTS,
    positive_float,
    UnknownNameError,
    unsigned_int,
    verb,
)
from ..messages.fill import Abbreviation, to_csv, to_document, to_yaml
from ..names import absolute, Handle, Message
from ..ros.graph import open_graph
from ..ros.qos import matching_profile, SUBSCRIPTION_QOS
from .topic import class_of_topic, message_class, TOPICS

_INDEX = re.compile(r'\[(-?\d+)\]')


def compile_filter(expression: str | None) -> Callable[[Message], bool]:
    """Compile a Python expression of `m`, the message, to a filter; None accepts all messages.

    Raises:
        FrontendError: The expression is no Python; the filter raises it if it fails on a message.
    """
    if not expression:
        return lambda _: True
    try:
        code = compile(expression, '--filter', 'eval')
    except SyntaxError as error:
        raise FrontendError(f"Invalid filter '{expression}': {error.msg}") from None

    def accepts(message: Message) -> bool:
        try:
            # the user's own expression, with the user's own rights
            return bool(eval(code, {'m': message}))  # noqa: S307
        except Exception as error:  # noqa: BLE001  # whatever the expression raises
            raise FrontendError(f"Filter '{expression}' failed: {error}") from None

    return accepts


def parse_path(text: str | None) -> list[str]:
    """Split a field path, e.g. `pose.position` or `position.[0]`; None means the message.

    Raises:
        FrontendError: The text is no path.
    """
    if text is None:
        return []
    parts = [part for part in text.replace('[', '.[').split('.') if part]
    if not parts:
        raise FrontendError(f"Invalid field value '{text}'")
    return parts


def select(message: Message, path: list[str]) -> Any:  # noqa: ANN401  # a field of any type
    """Return the field of a message at a path.

    Raises:
        UnknownNameError: The field does not exist; the error names those that do.
    """
    value = message
    for part in path:
        index = _INDEX.fullmatch(part)
        try:
            value = value[int(index[1])] if index else getattr(value, part)
        except (AttributeError, IndexError, TypeError) as error:
            fields = ', '.join(getattr(value, '_fields_and_field_types', ()))
            known = f'\nIt has: {fields}' if fields else ''
            text = f"Invalid field '{'.'.join(path)}': {error}{known}"
            raise UnknownNameError(text) from None
    return value


_TRUNCATE_LENGTH = 128


_SELECTION = (
    argument(
        '--field',
        help="Echo a selected field of a message. Use '.' to select sub-fields. "
        'For example, to echo the position field of a nav_msgs/msg/Odometry message: '
        "'ros2 topic echo /odom --field pose.pose.position'",
    ),
    argument(
        '--filter',
        dest='filter_expr',
        help='Python expression to filter messages that are printed. Expression can use '
        'Python builtins as well as m (the message).',
    ),
    flag('--once', help='Print the first message received and then exit.'),
    argument(
        '--timeout',
        metavar='N',
        type=positive_float,
        help='Set a timeout in seconds for waiting',
    ),
    flag('--no-lost-messages', help="Don't report when a message is lost"),
)
_FORMAT = (
    flag(
        '--csv',
        help='Output all recursive fields separated by commas (e.g. for plotting). If '
        '--include-message-info is also passed, the following fields are prepended: '
        'source_timestamp, received_timestamp, publication_sequence_number, '
        'reception_sequence_number.',
    ),
    flag(
        '--full-length',
        '-f',
        help='Output all elements for arrays, bytes, and string with a length > '
        "'--truncate-length', by default they are truncated after '--truncate-length' "
        "elements with '...''",
    ),
    argument(
        '--truncate-length',
        '-l',
        type=unsigned_int,
        default=_TRUNCATE_LENGTH,
        help=f'The length to truncate arrays, bytes, and string to (default: {_TRUNCATE_LENGTH})',
    ),
    flag('--no-arr', help="Don't print array fields of messages"),
    flag('--no-str', help="Don't print string fields of messages"),
    flag(
        '--flow-style',
        help='Print collections in the block style (not available with csv format)',
    ),
    flag('--raw', help='Echo the raw binary representation'),
    flag('--include-message-info', '-i', help='Shows the associated message info.'),
)


@verb(
    *GRAPH_ARGUMENTS,
    TOPICS.name_argument('listen to', '/chatter'),
    argument(
        'message_type', nargs='?', help="Type of the ROS message (e.g. 'std_msgs/msg/String')"
    ),
    SUBSCRIPTION_QOS,
    *_SELECTION,
    *_FORMAT,
)
def echo(args: Namespace) -> None:
    """Print messages until Ctrl-C, `--once` or `--timeout`."""
    show = printer(args)
    wanted = message_class(args.message_type) if args.message_type else None
    topic = absolute(args.topic_name)
    printed = False

    def take(message: Message, info: Mapping[str, object]) -> None:
        nonlocal printed
        printed = show(message, info) or printed

    with open_graph(args) as graph:
        from rclpy.event_handler import SubscriptionEventCallbacks

        lost = None if args.no_lost_messages else print_lost
        events = SubscriptionEventCallbacks(message_lost=lost)
        to_yaml('')  # loads YAML while DDS discovers
        if wanted is None:
            wanted = class_of_topic(args.topic_name, graph)
        graph.wait_for(lambda: graph.publishers(topic) or None)
        profile = matching_profile(args, graph, topic, print)
        graph.session.node.create_subscription(
            wanted, topic, take, profile, event_callbacks=events, raw=args.raw
        )
        graph.session.spin_until(lambda: args.once and printed, args.timeout)


def printer(args: Namespace) -> Callable[[Message, Mapping[str, object]], bool]:
    """Return a function that prints a message with its metadata, unless the filter rejects it."""
    path = parse_path(args.field)
    accepts = compile_filter(args.filter_expr)
    length = None if args.full_length else args.truncate_length
    cut = Abbreviation(length, args.no_arr, args.no_str)

    def show(message: Message, info: Mapping[str, object]) -> bool:
        value = select(message, path)
        accepted = accepts(value)
        if accepted:
            print(_text(value, cut, args, info if args.include_message_info else None))
        return accepted

    return show


def _text(
    value: Message, cut: Abbreviation, args: Namespace, info: Mapping[str, object] | None
) -> str:
    """Format a message, or its selected field, as the options set."""
    if not hasattr(value, 'SLOT_TYPES'):
        head = '---Got new message, message info:---\n{}\n---Message data:---\n'
        return f'{head.format(info) if info else ""}{value}\n---'
    if args.csv:
        cells = [str(cell) for cell in info.values()] if info else []
        return ','.join([*cells, to_csv(value, cut)])
    head = f'{to_yaml(dict(sorted(info.items())))}---\n' if info else ''
    return f'{head}{to_yaml(to_document(value, cut), args.flow_style)}---'


def print_lost(status: Handle) -> None:
    """Report that messages were lost."""
    print(
        f'A message was lost!!!\n\ttotal count change:{status.total_count_change}'
        f'\n\ttotal count: {status.total_count}',
        end='---\n',
    )
