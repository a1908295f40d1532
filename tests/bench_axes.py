# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Arms as real processes, in figures; the first beside ros2_canopen's on the same scenario.

Run it with ``make bench``, or ``python tests/bench_axes.py [SECONDS]`` in the environment.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
import sys
from tempfile import TemporaryDirectory
import time
from typing import TYPE_CHECKING

from bus_watch import BusRecorder
from canopen_interfaces.srv import COTargetDouble
from diagnostic_msgs.msg import DiagnosticArray
from isolation import reserve
import psutil
from sensor_msgs.msg import JointState
from simulated_arm import panda_bus, SimulatedArm

from canopen_core.standard import ALL_NODES, CobId

if TYPE_CHECKING:
    from processes import RunningProcess

SECONDS = 15.0
TARGETS = 40
FIRST_NODE_ID = 2

MASTER_ARGUMENTS = ('-p', 'robot_joint_states:=true')

Rows = dict[str, str]


@dataclass(frozen=True, slots=True)
class Scenario:
    """An arm and its cycle: number of axes, SYNC period in [ms]."""

    axes: int
    period: int

    @property
    def title(self) -> str:
        """Name of the column."""
        return f'{self.axes} axes, {self.period} ms'

    @property
    def joints(self) -> list[str]:
        """Names of the drives."""
        return [f'panda_joint{number}' for number in range(1, self.axes + 1)]


SCENARIOS = (Scenario(7, 10), Scenario(7, 5), Scenario(7, 4), Scenario(12, 5))
"""At 1 Mbit/s the third fills two thirds of the bus, the fourth nine tenths."""

REFERENCE: dict[str, str] = {
    'frames/s on the bus': '2907',
    'frames lost': '0',
    'master, CPU of one core': '14.5 %',
    'slaves, CPU of one core (sum)': '46 %',
    'last boot-up to all operational': '1.7 s from start',
    'init of all joints': '0.7 to 0.8 s (in turn)',
    'SYNC period deviation p50 / p99': '0.88 / 6.1 ms',
}
"""ros2_canopen's C++ classes: seven fake slaves, SYNC 10 ms, multicast bus, a 2-core machine."""


def main() -> None:
    """Run the scenarios and print the table."""
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else SECONDS
    columns = {scenario.title: measure(scenario, seconds) for scenario in SCENARIOS}
    heads = [*columns, 'C++, 7 axes, 10 ms']
    print(f'{"":34}' + ''.join(f'{head:>22}' for head in heads))
    for name in next(iter(columns.values())):
        figures = [rows[name] for rows in columns.values()]
        print(f'{name:34}' + ''.join(f'{x:>22}' for x in [*figures, REFERENCE.get(name, '-')]))


def measure(scenario: Scenario, seconds: float) -> Rows:
    """Run one scenario."""
    with reserve() as isolation, TemporaryDirectory() as folder:
        bus = write_bus(Path(folder), scenario)
        with (
            BusRecorder(isolation.bus) as recorder,
            SimulatedArm(isolation, bus, scenario.joints, MASTER_ARGUMENTS) as arm,
        ):
            rows = boot_and_init(arm, recorder)
            rows |= reaction(arm, recorder)
            rows |= joint_state_latency(arm, recorder, '/joint_states', 'master')
            publisher = arm.start('canopen_joint_state_publisher', *aggregator(scenario))
            publisher.wait_until_ready()
            rows |= joint_state_latency(arm, recorder, '/aggregated', 'publisher')
            publisher.stop()
            recorder.pause()
            return rows | steady_state(arm, seconds)


def write_bus(folder: Path, scenario: Scenario) -> Path:
    """Write the Panda's bus.yml with another number of axes and another period."""
    text = panda_bus().read_text().partition('nodes:')[0]
    text = text.replace('sync_period: 10000', f'sync_period: {scenario.period * 1000}')
    text = text.replace('"@BUS_CONFIG_PATH@"', f'"{panda_bus().parent}"')
    nodes = ''.join(
        f'  {joint}:\n    node_id: {node_id}\n'
        for node_id, joint in enumerate(scenario.joints, start=FIRST_NODE_ID)
    )
    path = folder / 'bus.yml'
    path.write_text(f'{text}nodes:\n{nodes}')
    return path


def boot_and_init(arm: SimulatedArm, recorder: BusRecorder) -> Rows:
    """Time the boot and the parallel init from the frames on the bus."""
    nodes = range(FIRST_NODE_ID, FIRST_NODE_ID + len(arm.joints))

    def starts() -> list[float]:
        return [
            f.timestamp
            for f in recorder.frames
            if f.can_id == CobId.NMT and f.data[0] == 1 and f.data[1] in (ALL_NODES, *nodes)
        ]

    arm.client.spin_until(lambda: bool(starts()), 5.0, 'NMT start of a node')
    boot_ups = [f.timestamp for f in recorder.frames if is_boot_up(f.can_id, f.data)]
    started = max(starts())
    init = arm.init_all()
    return {
        'last boot-up to all operational': f'{started - max(boot_ups):.3f} s',
        'init of all joints': f'{init:.3f} s (at once)',
    }


def reaction(arm: SimulatedArm, recorder: BusRecorder) -> Rows:
    """Time from the call of ~/target to the RPDO that carries it."""
    for joint in arm.joints:
        answer = arm.client.trigger(f'/{joint}/position_mode')
        if not answer.success:
            raise SystemExit(answer.message)
    client = arm.client.node.create_client(COTargetDouble, '/panda_joint1/target')
    client.wait_for_service(5.0)
    delays = []
    for number in range(1, TARGETS + 1):
        begin = time.monotonic()
        future = client.call_async(COTargetDouble.Request(target=number * 0.007))
        arm.client.spin_until(future.done, 5.0, 'answer of ~/target')
        target = (number * 7).to_bytes(4, 'little')
        carries = partial(recorder.first_after, begin, 0x202, target, 3)
        arm.client.spin_until(partial(is_there, carries), 5.0, 'RPDO of the target')
        frame = carries()
        delays.append(frame.timestamp - begin if frame else float('nan'))
    longest = max(delays) * 1e3
    return {'~/target call to RPDO p50 / max': f'{milliseconds(delays, 0.5)} / {longest:.1f} ms'}


def aggregator(scenario: Scenario) -> list[str]:
    """Return the arguments of the publisher that needs no master, on a topic of its own."""
    description = f'robot_description:={urdf(scenario.joints)}'
    return ['-p', description, '-r', '/joint_states:=/aggregated']


def joint_state_latency(arm: SimulatedArm, recorder: BusRecorder, topic: str, source: str) -> Rows:
    """Time from the last TPDO of a SYNC to the /joint_states message that carries it."""
    arrivals: list[tuple[float, int]] = []

    def take(message: JointState) -> None:
        stamp = message.header.stamp
        arrivals.append((time.monotonic(), stamp.sec * 10**9 + stamp.nanosec))

    arm.client.node.create_subscription(JointState, topic, take, 10)
    arm.client.spin_until(lambda: len(arrivals) >= 300, 20.0, topic)
    delays = []
    for arrived, _ in arrivals[50:]:
        last = recorder.last_before(arrived, 0x280, 0x2FF)
        if last is not None:
            delays.append(arrived - last.timestamp)
    share = f'{milliseconds(delays, 0.5)} / {milliseconds(delays, 0.99)} ms'
    return {f'TPDO to /joint_states ({source})': share}


def steady_state(arm: SimulatedArm, seconds: float) -> Rows:
    """CPU, memory, losses and jitter while the drives run, with /joint_states on."""
    diagnostics = arm.client.listen(DiagnosticArray, '/diagnostics')
    arm.client.spin_until(lambda: bool(diagnostics), 5.0, '/diagnostics')
    processes = {'master': arm.master, 'slaves': arm.slaves}
    before = {name: cpu_time(process) for name, process in processes.items()}
    first, begin = bus_values(diagnostics[-1]), time.monotonic()
    arm.client.spin_until(lambda: time.monotonic() - begin > seconds, seconds + 5, 'end')
    elapsed = time.monotonic() - begin
    share = {
        name: (cpu_time(process) - before[name]) / elapsed for name, process in processes.items()
    }
    last = bus_values(diagnostics[-1])
    memory = sum(psutil.Process(p.pid).memory_full_info().pss for p in processes.values())

    def grown(key: str) -> int:
        return int(last[key]) - int(first[key])

    late = [float(last[key]) * 1e3 for key in ('jitter_p50', 'jitter_p99')]
    return {
        'frames/s on the bus': f'{float(last["frames_per_second"]):.0f}',
        'bus load at 1 Mbit/s': f'{float(last["bus_load"]):.0f} %',
        'frames lost': str(grown('frames_lost')),
        'TPDOs that missed their SYNC': str(grown('missed_pdos')),
        'cycles left out': str(grown('overruns')),
        'master, CPU of one core': f'{share["master"]:.1%}',
        'slaves, CPU of one core (sum)': f'{share["slaves"]:.1%}',
        'SYNC late by p50 / p99': f'{late[0]:.2f} / {late[1]:.2f} ms',
        'memory of master and slaves (PSS)': f'{memory / 2**20:.0f} MiB',
    }


def is_there(look: Callable[[], object]) -> bool:
    """Return whether a look finds something."""
    return look() is not None


def bus_values(message: DiagnosticArray) -> dict[str, str]:
    """Return the values of the bus status."""
    for status in message.status:
        if status.name.endswith(': bus'):
            return {entry.key: entry.value for entry in status.values}
    raise SystemExit('/diagnostics has no status of the bus')


def cpu_time(process: RunningProcess) -> float:
    """Return the processor time that a process has used in [s]."""
    times = psutil.Process(process.pid).cpu_times()
    return times.user + times.system


def is_boot_up(can_id: int, data: bytes) -> bool:
    """Return whether a frame is a boot-up message."""
    return 0x701 <= can_id <= 0x77F and data == b'\0'


def milliseconds(values: Sequence[float], share: float) -> str:
    """Return a percentile in [ms]."""
    ordered = sorted(values)
    return f'{ordered[int((len(ordered) - 1) * share)] * 1e3:.2f}'


def urdf(names: Sequence[str]) -> str:
    """Return the URDF of a chain of joints."""
    links = ''.join(f'<link name="link{number}"/>' for number in range(len(names) + 1))
    joints = ''.join(
        f'<joint name="{name}" type="continuous"><parent link="link{number}"/>'
        f'<child link="link{number + 1}"/></joint>'
        for number, name in enumerate(names)
    )
    return f'<robot name="r">{links}{joints}</robot>'


if __name__ == '__main__':
    main()
