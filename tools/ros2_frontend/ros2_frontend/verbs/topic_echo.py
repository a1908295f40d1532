# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 topic echo`."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Mapping

from ..aliases import Handle, Message
from ..cli.arguments import GRAPH_ARGUMENTS, positive_float, unsigned_int
from ..cli.verb import argument, flag, verb
from ..messages.csv_text import to_csv
from ..messages.document import Abbreviation, to_document
from ..messages.yaml_text import to_yaml
from ..ros.graph import open_graph
from ..ros.names import absolute
from ..ros.qos import matching_profile, SUBSCRIPTION_QOS
from .expression import compile_filter, parse_path, select
from .topic import TOPICS
from .topic_types import class_of_topic, message_class

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
    """Print messages until Ctrl-C, `--once` or `--timeout`.

    Raises:
        FrontendError: When the topic's type is unknown or cannot be imported.
    """
    from rclpy.event_handler import SubscriptionEventCallbacks

    printer = Printer(args)
    wanted = message_class(args.message_type) if args.message_type else None
    topic = absolute(args.topic_name)
    events = SubscriptionEventCallbacks(message_lost=None if args.no_lost_messages else print_lost)
    with open_graph(args) as graph:
        if wanted is None:
            wanted = class_of_topic(args.topic_name, graph)
        graph.wait_for(lambda: graph.publishers(topic) or None)
        graph.session.node.create_subscription(
            wanted,
            topic,
            printer.take,
            matching_profile(args, graph, topic, print),
            event_callbacks=events,
            raw=args.raw,
        )
        graph.session.spin_until(lambda: args.once and printer.count > 0, args.timeout)


class Printer:
    """Prints messages as the options set.

    Attributes:
        count: How many were printed.
    """

    def __init__(self, args: Namespace) -> None:
        """Look at the options once.

        Args:
            args: The parsed arguments of `topic echo`.

        Raises:
            FrontendError: When `--field` or `--filter` cannot be understood.
        """
        self.count = 0
        self._args = args
        self._path = parse_path(args.field)
        self._accepts = compile_filter(args.filter_expr)
        length = None if args.full_length else args.truncate_length
        self._cut = Abbreviation(length, args.no_arr, args.no_str)

    def take(self, message: Message, info: Mapping[str, object]) -> None:
        """Print one message, unless the filter refuses it.

        Args:
            message: The message, or its bytes with `--raw`.
            info: Time stamps and sequence numbers.

        Raises:
            UnknownNameError: When it has no such field.
        """
        value = select(message, self._path)
        if not self._accepts(value):
            return
        self.count += 1
        if not hasattr(value, 'SLOT_TYPES'):
            self._print_plain(value, info)
        elif self._args.csv:
            head = [str(cell) for cell in info.values()] if self._args.include_message_info else []
            print(','.join([*head, to_csv(value, self._cut)]))
        else:
            self._print_yaml(value, info)

    def _print_plain(self, value: object, info: Mapping[str, object]) -> None:
        if self._args.include_message_info:
            print('---Got new message, message info:---')
            print(info)
            print('---Message data:---')
        print(value, end='\n---\n')

    def _print_yaml(self, message: Message, info: Mapping[str, object]) -> None:
        if self._args.include_message_info:
            print(to_yaml(dict(sorted(info.items()))), end='---\n')
        print(to_yaml(to_document(message, self._cut), self._args.flow_style), end='---\n')


def print_lost(status: Handle) -> None:
    """Report that messages were lost.

    Args:
        status: The event, with `total_count_change` and `total_count`.
    """
    print(
        f'A message was lost!!!\n\ttotal count change:{status.total_count_change}'
        f'\n\ttotal count: {status.total_count}',
        end='---\n',
    )
