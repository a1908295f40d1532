# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What to type in a second terminal when an arm has been brought up."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from process_supervisor import RosOptions

CALL = 'ros2 service call {} std_srvs/srv/Trigger'
TARGET = 'ros2 service call {}/target canopen_interfaces/srv/COTargetDouble "{{ target: 0.1 }}"'


def next_commands(
    drives: Sequence[str],
    mode_service: str,
    controllers: Sequence[str],
    ros: RosOptions,
    *,
    enabled: bool,
    simulated: bool,
    planned: bool = False,
) -> str:
    """Return the text to print, in lines.

    A target of a single drive is absolute, so it is proposed for simulated ones only.

    Args:
        drives: Names of the drives.
        mode_service: Service of each that selects the mode of streams.
        controllers: Names of the trajectory controllers; empty without motion.
        ros: Options of all nodes.
        enabled: The bring-up enables the drives.
        simulated: The drives are simulated.
        planned: move_group runs, too.
    """

    def lines() -> Iterator[str]:
        first = ros.resolve(drives[0])
        if not enabled:
            others = ' # and of the others' if len(drives) > 1 else ''
            for name in ('init', mode_service):
                yield CALL.format(f'{first}/{name}') + others
        if controllers:
            yield f'ros2 run arm_servo servo_keyboard_input{ros.hint}'
        elif simulated:
            yield TARGET.format(first)
        for name in controllers:
            yield f'ros2 action info {ros.resolve(name)}/follow_joint_trajectory'
        if planned:
            yield f'ros2 action info {ros.resolve("move_action")}'
        yield f'ros2 topic echo --once {ros.resolve("joint_states")}'

    advice = '' if enabled else ' (--enable enables all drives at the start)'
    return '\n    '.join([f'in a second terminal{advice}:', *lines()])
