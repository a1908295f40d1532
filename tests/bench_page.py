# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The cycle of a moving arm: without its page, with the page unseen, and with one open.

The browser is on the same machine, and draws in software. It has the lowest priority: its work is
that of another machine.
"""

from __future__ import annotations

from contextlib import ExitStack
import time

from bench_axes import bus_values
import browser
from diagnostic_msgs.msg import DiagnosticArray
from isolation import reserve
from processes import executable, RunningProcess
import psutil
from ros_client import RosClient
from sensor_msgs.msg import JointState

SECONDS = 15.0
MOVING = 0.05  # [rad/s]
SEEN = r'the robot is seen at (http://localhost:\d+)$'
LATE = ('jitter_p50', 'jitter_p99', 'jitter_max')
VARIANTS = ('no page', 'page unseen', 'page open')


def main() -> None:
    """Run the variants and print the table; without a browser the last is left out."""
    reason = browser.lacking()
    if reason:
        print(f'without an open page: {reason}')
    print(f'{"Panda at 10 ms":16}{"SYNC late by p50 / p99 / max":>34}{"left out":>10}{"page":>9}')
    for variant in VARIANTS[: 2 if reason else 3]:
        measure(variant)


def measure(variant: str) -> None:
    """Measure one variant, and print its line."""
    with ExitStack() as stack:
        isolation = stack.enter_context(reserve())
        words = [executable('arm_bringup', 'demo'), 'panda', '--can', isolation.bus]
        if variant == 'no page':
            words.append('--no-view')
        arm = stack.enter_context(RunningProcess(words, isolation.env | {'NO_VIEW': ''}))
        client = stack.enter_context(RosClient(isolation.domain_id))
        states = client.listen(JointState, '/joint_states')
        client.spin_until(lambda: moves(states), 60.0, 'motion')
        diagnostics = client.listen(DiagnosticArray, '/diagnostics')
        if variant == 'page open':
            url = arm.wait_for(SEEN).rpartition(' ')[2]
            page = browser.open_page(stack.enter_context(browser.browser()), url)
            for process in browser.processes():
                process.nice(19)
            page.locator('canvas').first.wait_for()
        client.spin_until(lambda: has_bus(diagnostics), 10.0, 'status of the bus')
        first, used, begin = bus_values(diagnostics[-1]), page_time(arm), time.monotonic()
        client.spin_until(lambda: time.monotonic() - begin > SECONDS, SECONDS + 5, 'end')
        client.spin_until(lambda: has_bus(diagnostics), 10.0, 'status of the bus')
        last = bus_values(diagnostics[-1])
        share = (page_time(arm) - used) / (time.monotonic() - begin)
    late = ' / '.join(f'{float(last[key]) * 1e3:.2f}' for key in LATE) + ' ms'
    left_out = float(last['overruns']) - float(first['overruns'])
    print(f'{variant:16}{late:>34}{left_out:>10.0f}{share:>9.1%}', flush=True)


def moves(states: list[JointState]) -> bool:
    """Whether a joint moves."""
    return bool(states) and max(states[-1].velocity) > MOVING


def has_bus(diagnostics: list[DiagnosticArray]) -> bool:
    """Whether the last message has the bus in it."""
    return bool(diagnostics) and any(
        status.name.endswith(': bus') for status in diagnostics[-1].status
    )


def page_time(arm: RunningProcess) -> float:
    """Return the processor time in [s] of the arm's page; 0 where there is none."""
    return sum(
        sum(child.cpu_times()[:2])
        for child in psutil.Process(arm.pid).children(recursive=True)
        if any(word.endswith('/web_viewer') for word in child.cmdline())
    )


if __name__ == '__main__':
    main()
