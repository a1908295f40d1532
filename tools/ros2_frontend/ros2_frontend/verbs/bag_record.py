# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 bag record`."""

from __future__ import annotations

from argparse import Namespace
import contextlib
from pathlib import Path
import sys
import time

from rosbag_files import BagWriter, Preset, WriterOptions

from ..bag import bag_errors, CHOICE, load_overrides, STORAGE, topic_filter
from ..cli.commands import argument, flag, FrontendError, unsigned_int, verb
from ..cli.interrupts import deferred_interrupts, keys
from ..ros.graph import Graph, open_session
from ..ros.recorder import Recorder

_NANO = 1_000_000_000


_OUTPUT = argument(
    '-o',
    '--output',
    help='Destination of the bagfile to create, defaults to a timestamped folder in the '
    'current directory.',
)
_TOPICS = (
    argument('topic_names', nargs='*', metavar='Topic', help='Topics to record'),
    argument(
        '--topic-types', default=[], metavar='TopicType', nargs='+', help='Topic types to record.'
    ),
    flag('-a', '--all', help='Record all topics (hidden ones excluded).'),
    flag('--all-topics', help='Record all topics (hidden ones excluded).'),
    *CHOICE,
    argument(
        '--exclude-topic-types',
        default=[],
        metavar='TopicType',
        nargs='+',
        help='Topic types to leave out.',
    ),
    flag('--include-unpublished-topics', help='Record topics which have no publisher, too.'),
    flag('--include-hidden-topics', help='Record hidden topics, too.'),
    flag('--no-discovery', help='Record only topics that are there at the start.'),
    argument(
        '-p',
        '--polling-interval',
        type=unsigned_int,
        default=100,
        metavar='MS',
        help='Time [ms] between two looks for new topics (default: 100)',
    ),
)
_FILES = (
    argument(
        '-b',
        '--max-bag-size',
        type=unsigned_int,
        default=0,
        metavar='BYTES',
        help='Size from which the bagfile is split (default: 0, never)',
    ),
    argument(
        '-d',
        '--max-bag-duration',
        type=unsigned_int,
        default=0,
        metavar='S',
        help='Duration [s] from which the bagfile is split (default: 0, never)',
    ),
    argument(
        '--max-cache-size',
        type=unsigned_int,
        default=100 * 1024 * 1024,
        metavar='BYTES',
        help='Messages that may wait for the disk; more are dropped and counted. 0 for no limit '
        '(default: 104857600)',
    ),
    argument(
        '--storage-preset-profile',
        default=Preset.NONE.value,
        choices=[each.value for each in Preset],
        help='How MCAP is written; zstd_fast and zstd_small compress chunks, which every reader '
        'of MCAP understands',
    ),
)
_BEHAVIOUR = (
    flag('--start-paused', help='Start the recorder in a paused state; SPACE resumes.'),
    flag('--disable-keyboard-controls', help='Leave the keyboard alone.'),
    argument('--node-name', default='rosbag2_recorder', help='Name of the recorder node.'),
    flag(
        '--use-sim-time',
        dest='sim_time',
        help='Stamp messages with /clock; nothing is recorded before its first message.',
    ),
)


@verb(_OUTPUT, STORAGE, *_TOPICS, *_FILES, *_BEHAVIOUR)
def record(args: Namespace) -> None:
    """Record until Ctrl-C or SIGTERM."""
    if args.topic_names:
        print("Positional argument 'topics' is deprecated. Use --topics instead.", file=sys.stderr)
    args.topics = [*args.topic_names, *args.topics]
    everything = args.all or args.all_topics
    if not (everything or args.topics or args.topic_types or args.regex):
        raise FrontendError(
            'Need to specify at least one option out of --all, --all-topics, --topics, '
            '--topic-types or --regex'
        )
    wanted = topic_filter(args, everything, args.include_hidden_topics)
    overrides = load_overrides(args.qos_profile_overrides_path)
    folder = Path(args.output or time.strftime('rosbag2_%Y_%m_%d-%H_%M_%S'))
    with open_session(args, args.node_name) as session:
        with bag_errors():
            duration, preset = args.max_bag_duration * _NANO, Preset(args.storage_preset_profile)
            writer = BagWriter(folder, WriterOptions(args.max_bag_size, duration, preset))
        recorder = Recorder(Graph(session), writer, wanted, overrides, args)
        recorder.paused = args.start_paused
        log = session.node.get_logger()
        with keys(not args.disable_keyboard_controls) as typed:

            def poll() -> None:
                if typed().count(' ') % 2:
                    recorder.paused = not recorder.paused
                    log.info('Pausing recording.' if recorder.paused else 'Resuming recording.')

            try:
                log.info('Press SPACE for pausing/resuming')
                with contextlib.suppress(KeyboardInterrupt):  # the one way to end a recording
                    recorder.run(poll)
            finally:
                # once more, while the files are being finished, ends nothing
                with contextlib.suppress(KeyboardInterrupt), deferred_interrupts():
                    recorder.stop()
                    total = sum(recorder.counts.values())
                    done = f"Recording stopped: {total} messages in '{folder}'"
                    log.info(done)
