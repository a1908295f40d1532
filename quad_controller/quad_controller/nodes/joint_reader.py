# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Joint states in the robot's order, and what to do about joints that nobody measures.

The legs must be measured. An arm's servo need not be: protocol v1 of the XGO does not report
one of them. Such a joint counts as being where it is sent, and is not sent anywhere before it is
to move, because nobody knows how far it would jump.
"""

from __future__ import annotations

from collections.abc import Sequence

from sensor_msgs.msg import JointState

from quad_description import JointSample, Quadruped, Targets

STILL_TITLES = frozenset({'relax', 'to relax', 'lie', 'to lie'})
"""States of the controller in which no joint but those of the legs moves."""


class JointReader:
    """Puts the joints of a message into the robot's order.

    The order of a message seldom changes, so the permutation is kept until it does.
    """

    def __init__(self, robot: Quadruped) -> None:
        self._names = robot.names
        self._spared = {robot.names[index] for index in robot.others}
        self._seen: list[str] | None = None
        self._places: list[int | None] = []
        # joints that were in no message yet; empty before the first
        self.unreported: tuple[str, ...] = ()

    def read(
        self, message: JointState, numbers: Sequence[float], sent: Sequence[float]
    ) -> JointSample:
        """Return the joints of a message.

        Args:
            message: What was measured, but for its numbers.
            numbers: Positions [rad], and velocities [rad/s] behind them.
            sent: Where all joints were sent [rad], for those that are never reported.

        Raises:
            ValueError: A joint of a leg, or one that was there before, is missing, or there are
                not as many positions as names.
        """
        if len(message.position) != len(message.name):
            raise ValueError(
                f'joint states: {len(message.position)} positions for {len(message.name)} names'
            )
        if message.name != self._seen:
            self._find(list(message.name))
        count = len(message.position)
        position, velocity = numbers[:count], numbers[count:]
        known = len(velocity) == count
        return JointSample(
            tuple(
                target if place is None else position[place]
                for place, target in zip(self._places, sent, strict=True)
            ),
            tuple(0.0 if place is None else velocity[place] for place in self._places)
            if known
            else None,
        )

    def _find(self, names: list[str]) -> None:
        missing = [name for name in self._names if name not in names]
        if needed := [name for name in missing if name not in self._spared]:
            self._seen = None
            raise ValueError(
                f'joint states without {", ".join(needed)}; does the hardware node use the same '
                'robot description?'
            )
        self._spared &= set(missing)
        self.unreported = tuple(missing)
        self._places = [names.index(name) if name in names else None for name in self._names]
        self._seen = names


class CommandFilter:
    """Decides how many joints a command is for: all, or the first ones, which are the legs."""

    def __init__(self, robot: Quadruped, *, others_move: bool) -> None:
        """Begin with a robot that has not moved."""
        legs = len(robot.names) - len(robot.others)
        legs_first = all(index >= legs for index in robot.others)
        self._count = legs if legs_first else len(robot.names)
        # whether joints that are no legs' will be sent elsewhere, ever
        self.others_move = others_move
        self._moved = False

    def select(self, targets: Targets, title: str, unreported: Sequence[str]) -> Targets:
        """Return the targets to send.

        Args:
            targets: Of all joints [rad].
        """
        self._moved = self._moved or title not in STILL_TITLES
        if unreported and not (self.others_move and self._moved):
            return targets[: self._count]
        return targets
