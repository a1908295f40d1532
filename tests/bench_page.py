# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The cycle of a moving arm: without its page, with the page unseen, and with one open.

The browser is on the same machine, and draws in software. It has the lowest priority: its work is
that of another machine.

Lateness is that of the last cycles, a window of them. It is read when the whole window lies in the
measured time: the start of the processes is no part of it.
"""

from __future__ import annotations

from contextlib import ExitStack
import time

from bench_axes import bus_values
import browser
from diagnostic_msgs.msg import DiagnosticArray
from isolation import reserve
from processes import executable, RunningProcess
from ros_client import RosClient
from sensor_msgs.msg import JointState

from arm_canopen.master.runner import WINDOW

TIMEOUT = 60.0  # [s]
MOVING = 0.05  # [rad/s]
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
        url = '' if variant == 'no page' else browser.url_of(arm, TIMEOUT)
        client = stack.enter_context(RosClient(isolation.domain_id))
        states = client.listen(JointState, '/joint_states')
        client.spin_until(lambda: moves(states), TIMEOUT, 'motion')
        diagnostics = client.listen(DiagnosticArray, '/diagnostics')
        if variant == 'page open':
            page = browser.open_page(stack.enter_context(browser.browser()), url, drawn=True)
            for process in browser.processes():
                process.nice(19)
            page.locator('canvas').first.wait_for()
        client.spin_until(lambda: has_bus(diagnostics), 10.0, 'status of the bus')
        first, used, begin = bus_values(diagnostics[-1]), page_time(arm), time.monotonic()
        end = int(first['cycles']) + WINDOW
        client.spin_until(lambda: cycles(diagnostics) >= end, TIMEOUT, 'cycles')
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


def cycles(diagnostics: list[DiagnosticArray]) -> int:
    """Return how many cycles there were until the last message; 0 where it has no bus."""
    return int(bus_values(diagnostics[-1])['cycles']) if has_bus(diagnostics) else 0


def page_time(arm: RunningProcess) -> float:
    """Return the processor time in [s] of the arm's page; 0 where there is none."""
    return sum(sum(viewer.cpu_times()[:2]) for viewer in browser.viewers_below(arm))


if __name__ == '__main__':
    main()
