# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 topic echo`."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Mapping

from ..aliases import Handle, Message
from ..cli.arguments import add_graph_arguments, positive_float, unsigned_int
from ..messages.csv_text import to_csv
from ..messages.document import Abbreviation, to_document
from ..messages.yaml_text import to_yaml
from ..ros.graph import open_graph
from ..ros.names import absolute
from ..ros.qos import add_qos_arguments, matching_profile
from .expression import compile_filter, parse_path, select
from .topic_types import class_of_topic, message_class

_TRUNCATE_LENGTH = 128


class Echo:
    """Output messages from a topic."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_graph_arguments(parser)
        parser.add_argument(
            'topic_name', help="Name of the ROS topic to listen to (e.g. '/chatter')"
        )
        parser.add_argument(
            'message_type', nargs='?', help="Type of the ROS message (e.g. 'std_msgs/msg/String')"
        )
        add_qos_arguments(parser, 'subscribe', 'sensor_data')
        _add_selection(parser)
        _add_format(parser)

    def main(self, args: Namespace) -> None:
        """Print messages until Ctrl-C, `--once` or `--timeout`.

        Raises:
            FrontendError: When the topic's type cannot be told or imported.
        """
        from rclpy.event_handler import SubscriptionEventCallbacks

        printer = Printer(args)
        wanted = message_class(args.message_type) if args.message_type else None
        topic = absolute(args.topic_name)
        events = SubscriptionEventCallbacks(
            message_lost=None if args.no_lost_messages else print_lost
        )
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


def _add_selection(parser: ArgumentParser) -> None:
    parser.add_argument(
        '--field',
        help="Echo a selected field of a message. Use '.' to select sub-fields. "
        'For example, to echo the position field of a nav_msgs/msg/Odometry message: '
        "'ros2 topic echo /odom --field pose.pose.position'",
    )
    parser.add_argument(
        '--filter',
        dest='filter_expr',
        help='Python expression to filter messages that are printed. Expression can use '
        'Python builtins as well as m (the message).',
    )
    parser.add_argument(
        '--once', action='store_true', help='Print the first message received and then exit.'
    )
    parser.add_argument(
        '--timeout',
        metavar='N',
        type=positive_float,
        help='Set a timeout in seconds for waiting',
    )
    parser.add_argument(
        '--no-lost-messages', action='store_true', help="Don't report when a message is lost"
    )


def _add_format(parser: ArgumentParser) -> None:
    parser.add_argument(
        '--csv',
        action='store_true',
        help='Output all recursive fields separated by commas (e.g. for plotting). If '
        '--include-message-info is also passed, the following fields are prepended: '
        'source_timestamp, received_timestamp, publication_sequence_number, '
        'reception_sequence_number.',
    )
    parser.add_argument(
        '--full-length',
        '-f',
        action='store_true',
        help='Output all elements for arrays, bytes, and string with a length > '
        "'--truncate-length', by default they are truncated after '--truncate-length' "
        "elements with '...''",
    )
    parser.add_argument(
        '--truncate-length',
        '-l',
        type=unsigned_int,
        default=_TRUNCATE_LENGTH,
        help=f'The length to truncate arrays, bytes, and string to (default: {_TRUNCATE_LENGTH})',
    )
    parser.add_argument(
        '--no-arr', action='store_true', help="Don't print array fields of messages"
    )
    parser.add_argument(
        '--no-str', action='store_true', help="Don't print string fields of messages"
    )
    parser.add_argument(
        '--flow-style',
        action='store_true',
        help='Print collections in the block style (not available with csv format)',
    )
    parser.add_argument('--raw', action='store_true', help='Echo the raw binary representation')
    parser.add_argument(
        '--include-message-info',
        '-i',
        action='store_true',
        help='Shows the associated message info.',
    )


class Printer:
    """Prints messages as the options say.

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
