# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The cycle beside the ROS nodes, in a process of its own, and there without the C core.

Seven simulated drives on the multicast bus; the second variant has no ROS at all, so that a real
division in two processes, with the exchange between them, could only be worse.
"""

from __future__ import annotations

import json
import os
from pathlib import Path
import subprocess
import sys
from tempfile import TemporaryDirectory
import time
from typing import TYPE_CHECKING

from bench_axes import bus_values, cpu_time, Scenario, write_bus
from diagnostic_msgs.msg import DiagnosticArray
from isolation import reserve
import psutil
from simulated_arm import SimulatedArm

from arm_canopen import Event, load_bus
from arm_canopen.cia402.axis import Axis
from arm_canopen.cia402.motion_group import MotionGroup
from arm_canopen.master.network import Network
from arm_canopen.master.runner import NetworkThread
from canopen_core.can import open_bus

if TYPE_CHECKING:
    from isolation import Isolation

SECONDS = 10.0
SCENARIOS = (Scenario(7, 10), Scenario(7, 4))
KEYS = ('jitter_p50', 'jitter_p99', 'jitter_max', 'overruns')


def main() -> None:
    """Run both variants and print the table."""
    if sys.argv[1:2] == ['--alone']:
        print(json.dumps(run_alone(*sys.argv[2:4])))
        return
    print(f'{"":22}{"SYNC late by p50 / p99 / max":>34}{"cycles left out":>18}{"CPU":>9}')
    for scenario in SCENARIOS:
        with reserve() as isolation, TemporaryDirectory() as folder:
            bus = write_bus(Path(folder), scenario)
            with SimulatedArm(isolation, bus, scenario.joints) as arm:
                show(scenario, 'with ROS', with_nodes(arm))
                arm.master.stop()
                show(scenario, 'alone', alone(bus, isolation))
                show(scenario, 'no C core', alone(bus, isolation, CANOPEN_CORE_COMPILED='0'))


def show(scenario: Scenario, variant: str, figures: dict[str, float]) -> None:
    """Print one line."""
    late = ' / '.join(f'{figures[key] * 1e3:.2f}' for key in KEYS[:3]) + ' ms'
    title = f'{scenario.title}, {variant}'
    print(f'{title:22}{late:>34}{figures["overruns"]:>18.0f}{figures["cpu"]:>9.1%}')


def with_nodes(arm: SimulatedArm) -> dict[str, float]:
    """Measure the master as it is."""
    diagnostics = arm.client.listen(DiagnosticArray, '/diagnostics')
    arm.client.spin_until(lambda: bool(diagnostics), 5.0, '/diagnostics')
    first, used = bus_values(diagnostics[-1]), cpu_time(arm.master)
    begin = time.monotonic()
    arm.client.spin_until(lambda: time.monotonic() - begin > SECONDS, SECONDS + 5, 'end')
    last = bus_values(diagnostics[-1])
    cpu = (cpu_time(arm.master) - used) / (time.monotonic() - begin)
    figures = {key: float(last[key]) for key in KEYS}
    return {**figures, 'overruns': figures['overruns'] - float(first['overruns']), 'cpu': cpu}


def alone(bus: Path, isolation: Isolation, **variables: str) -> dict[str, float]:
    """Measure the cycle in a process without ROS, with environment variables of its own."""
    command = [sys.executable, __file__, '--alone', str(bus), isolation.bus]
    env = {**os.environ, **variables}
    output = subprocess.run(command, check=True, capture_output=True, text=True, env=env).stdout
    figures: dict[str, float] = json.loads(output.splitlines()[-1])
    return figures


def run_alone(path: str, interface: str) -> dict[str, float]:
    """Run network and drives without a node, and return the figures."""
    config = load_bus(path)

    def ignore(event: Event) -> None:
        """Discard the report."""

    with open_bus(interface) as can:
        network = Network(config, can.send, ignore)
        drives = [Axis(node, network.scheduler) for node in network.nodes.values()]
        network.on_cycle = MotionGroup(drives, ignore).cycle
        thread = NetworkThread(can, network)
        thread.start()
        while not all(node.online for node in network.nodes.values()):
            time.sleep(0.01)
        first = thread.call(thread.figures).result()
        process, begin = psutil.Process(), time.monotonic()
        used = sum(process.cpu_times()[:2])
        time.sleep(SECONDS)
        cpu = (sum(process.cpu_times()[:2]) - used) / (time.monotonic() - begin)
        last = thread.call(thread.figures).result()
        thread.stop()
    return {
        'jitter_p50': last.jitter_p50,
        'jitter_p99': last.jitter_p99,
        'jitter_max': last.jitter_max,
        'overruns': last.overruns - first.overruns,
        'cpu': cpu,
    }


if __name__ == '__main__':
    main()
