# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 bag` with real processes over DDS, read by implementations that are not ours."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
import contextlib
from pathlib import Path
import signal
import subprocess
import sys
import time

from frontend_cli import PROGRAM, Ros2, with_frontend
from isolation import reserve
from processes import RunningProcess
import pytest
from rosbags.highlevel import AnyReader
from rosbags.typesys import get_typestore, Stores

from rosbag_files import BagReader
from rosbag_files.reader import recording_files, scan

pytestmark = pytest.mark.scenario

SOURCE = Path(__file__).with_name('frontend_source.py')
TIMEOUT = 30.0  # [s]


@pytest.fixture
def env(monkeypatch: pytest.MonkeyPatch) -> Iterator[Mapping[str, str]]:
    """Return an environment with a ROS domain of its own; this process is in it, too."""
    with reserve() as isolation:
        monkeypatch.setenv('ROS_DOMAIN_ID', str(isolation.domain_id))
        yield with_frontend(isolation.env)


@contextlib.contextmanager
def record(env: Mapping[str, str], folder: Path, *words: str) -> Iterator[RunningProcess]:
    """Run `ros2 bag record`, which has begun."""
    command = [*PROGRAM, 'bag', 'record', '-o', str(folder), *words]
    with RunningProcess(command, env) as recorder:
        recorder.wait_for('Recording...')
        yield recorder


def source(env: Mapping[str, str], count: int, period: float = 0.001) -> RunningProcess:
    """Start the publisher."""
    return RunningProcess([sys.executable, str(SOURCE), str(count), str(period)], env)


def until(condition: Callable[[], bool], process: RunningProcess) -> None:
    """Wait for what a process that runs brings about."""
    deadline = time.monotonic() + TIMEOUT
    while not condition():
        assert process.is_running(), process.output
        assert time.monotonic() < deadline, process.output
        time.sleep(0.05)


def arrived(folder: Path, topic: str) -> int:
    """Count what is in the file of a recording that goes on."""
    topics = scan(folder, recording_files(folder)).topics
    return sum(each.count for each in topics if each.topic.name == topic)


def read(folder: Path) -> dict[str, list[object]]:
    """Return the values of each topic, read by rosbags from metadata.yaml on."""
    found: dict[str, list[object]] = {}
    with AnyReader([folder], default_typestore=get_typestore(Stores.EMPTY)) as reader:
        for connection, _, data in reader.messages():
            message = reader.deserialize(data, connection.msgtype)
            field = 'clock' if hasattr(message, 'clock') else 'data'
            found.setdefault(connection.topic, []).append(getattr(message, field, None))
        assert reader.message_count == sum(map(len, found.values()))
    return found


def test_every_message_is_recorded(env: Mapping[str, str], tmp_path: Path) -> None:
    """Of topics that appear later, and what a latched one kept; in several compressed files."""
    folder = tmp_path / 'bag'
    words = ['-a', '--max-bag-size', '20000', '--storage-preset-profile', 'zstd_fast']
    with record(env, folder, *words) as recorder, source(env, 3000) as publisher:
        publisher.wait_for('published')
        assert recorder.stop() == 0
    found = read(folder)
    assert found['/numbers'] == list(range(3000))
    assert found['/loose'] == list(range(3000))
    assert found['/latched'] == ['kept']
    assert 'lost' not in recorder.output
    assert f'Recording stopped: {sum(map(len, found.values()))} messages' in recorder.output
    assert len(list(folder.glob('*.mcap'))) > 2


def test_a_signal_ends_it_with_a_whole_recording(env: Mapping[str, str], tmp_path: Path) -> None:
    """While messages arrive: SIGTERM as Ctrl-C, and twice at once, as `timeout` sends it."""
    topics = ['--topics', '/numbers', '/loose']
    with record(env, tmp_path / 'bag', *topics) as recorder, source(env, 100_000) as publisher:
        publisher.wait_for('connected')
        for _ in range(2):
            recorder.signal(signal.SIGTERM)
        assert recorder.wait() == 0
    assert 'Recording stopped' in recorder.output
    numbers = read(tmp_path / 'bag').get('/numbers', [])
    assert numbers == list(range(len(numbers)))


def test_after_a_kill_all_but_the_last_second_is_there(
    env: Mapping[str, str], tmp_path: Path, ros2: Ros2
) -> None:
    """`info` and `play` read it as it is, `reindex` finishes it for others."""
    folder = tmp_path / 'bag'
    with record(env, folder, '-a') as recorder, source(env, 1000) as publisher:
        publisher.wait_for('published')
        file = folder / 'bag_0.mcap'
        until(lambda: b'/numbers' in file.read_bytes(), recorder)
        recorder.signal(signal.SIGKILL)
        recorder.wait()
    outcome = ros2('bag', 'info', str(folder))
    assert outcome.code == 0
    assert 'Topic: /numbers | Type: std_msgs/msg/UInt32 | Count: ' in outcome.out
    assert 'was not finished' in outcome.err
    assert '/numbers' in ros2('bag', 'info', '-t', str(folder)).lines
    assert ros2('bag', 'reindex', str(folder)).code == 0
    numbers = read(folder)['/numbers']
    assert numbers == list(range(len(numbers)))
    assert numbers


def test_what_is_recorded_is_played(env: Mapping[str, str], tmp_path: Path) -> None:
    """Recording what is played gives what was recorded: bytes, order, QoS; under another name."""
    first, second = tmp_path / 'first', tmp_path / 'second'
    words = ['-a', '-x', 'rosout|parameter']
    with record(env, first, *words) as recorder, source(env, 300) as publisher:
        publisher.wait_for('published')
        recorder.stop()
    topics = ['--topics', '/counted', '/loose', '/latched']
    with record(env, second, *topics) as recorder:
        words = ['bag', 'play', str(first), '--remap', '/numbers:=/counted', '--delay', '2']
        with RunningProcess([*PROGRAM, *words, '-r', '0.2'], env) as player:
            # one that stands still at the end misses nothing: the player waits for it
            until(lambda: arrived(second, '/counted') > 0, recorder)
            recorder.signal(signal.SIGSTOP)
            with contextlib.suppress(subprocess.TimeoutExpired):
                player.wait(3.0)
            recorder.signal(signal.SIGCONT)
            assert player.wait(60.0) == 0
        assert f"topics of '{first}', " in player.output
        assert 'Set rate to 0.2\n' in player.output
        assert 'Playback until timestamp: -1' in player.output
        assert 'SPACE' not in player.output  # there is no keyboard
        until(lambda: arrived(second, '/counted') == 300, recorder)
        recorder.stop()
    before, after = read(first), read(second)
    assert after['/counted'] == before['/numbers'] == list(range(300))
    # best effort: a busy machine may lose some, and changes none
    assert after['/loose'] == [each for each in before['/loose'] if each in after['/loose']]
    assert after['/latched'] == ['kept']


def test_play_chooses_a_part_and_a_rate(
    env: Mapping[str, str], tmp_path: Path, ros2: Ros2
) -> None:
    """From an offset on, of one topic, a thousand times faster; in a loop until it is ended."""
    first, second = tmp_path / 'first', tmp_path / 'second'
    words = ['-e', 'numbers|loose']
    with record(env, first, *words) as recorder, source(env, 100, 0.02) as publisher:
        publisher.wait_for('published')
        recorder.stop()
    with record(env, second, '--topics', '/numbers', '/clock') as recorder:
        words = ['bag', 'play', str(first), '--topics', '/numbers', '--start-offset', '1']
        words += ['-r', '1000', '-l', '--delay', '1', '--clock', '100']
        with RunningProcess([*PROGRAM, *words], env) as player:
            recorder.wait_for("Subscribed to topic '/numbers'")
            recorder.wait_for("Subscribed to topic '/clock'")
            assert player.is_running()
            until(lambda: '/clock' in ros2('topic', 'list').lines, player)
            ros2('topic', 'echo', '/numbers', '--once', '--filter', 'm.data == 99')
            player.signal(signal.SIGINT)
            assert player.wait() == 0
        recorder.stop()
    found = read(second)
    assert 99 in found['/numbers']
    numbers = [number for number in found['/numbers'] if isinstance(number, int)]
    assert min(numbers) > 10
    # also while it waits: a node with `use_sim_time` would see a jump of years
    start = BagReader(first).metadata.start // 1_000_000_000
    assert min(each.sec for each in found['/clock']) > start  # type: ignore[attr-defined]


def test_messages_that_do_not_arrive_are_counted(env: Mapping[str, str], tmp_path: Path) -> None:
    """A recorder that keeps a hundred messages is stopped while a thousand more come."""
    overrides = tmp_path / 'qos.yaml'
    overrides.write_text('/numbers: {history: keep_last, depth: 100}\n')
    folder = tmp_path / 'bag'
    words = ['--topics', '/numbers', '/loose', '--qos-profile-overrides-path', str(overrides)]
    with record(env, folder, *words) as recorder, source(env, 1000) as publisher:
        publisher.wait_for('published')
        file = folder / 'bag_0.mcap'
        until(lambda: b'/numbers' in file.read_bytes(), recorder)
        recorder.signal(signal.SIGSTOP)
        publisher.signal(signal.SIGUSR1)
        publisher.wait_for('published', count=2)
        recorder.signal(signal.SIGCONT)
        until(lambda: arrived(folder, '/numbers') > 1000, recorder)
        recorder.stop()
    numbers = read(folder)['/numbers']
    # what came before the first one that arrived, and after the last one, is no gap
    first, last = int(str(numbers[0])), int(str(numbers[-1]))
    lost = last - first + 1 - len(numbers)
    assert lost > 0
    assert f'/numbers: {lost}' in recorder.output


@pytest.mark.parametrize(
    ('words', 'problem'),
    [
        (('record',), 'Need to specify at least one option'),
        (('record', '-e', '['), "'[' is no regular expression"),
        (('record', '-a', '-o', '.'), 'already exists'),
        (('info', '/nothing'), "Bag path '/nothing' does not exist!"),
        (('play', '/nothing'), "Bag path '/nothing' does not exist!"),
        (('reindex', '/'), 'holds no recording'),
    ],
)
def test_refusals(
    env: Mapping[str, str], ros2: Ros2, words: tuple[str, ...], problem: str
) -> None:
    """One sentence, and exit code 1."""
    outcome = ros2('bag', *words)
    assert outcome.code == 1
    assert problem in outcome.err
