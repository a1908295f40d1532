# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which nodes belong to which robot, where several share a ROS domain."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping

DESCRIPTION = '/robot_description'
"""What each robot has in its namespace."""
SET_NMT_TYPE, SET_MODE_TYPE = 'canopen_interfaces/srv/CONmtID', 'quad_msgs/srv/SetMode'
"""Of services that only a master of drives has, and only the controller of a walking robot."""


def of_robot(description: str, topics: Iterable[str], nodes: Iterable[str]) -> list[str]:
    """Return the nodes of one robot: no other one's namespace is nearer to them.

    Args:
        description: Full name of the topic with the description of the robot.
        topics: Full names of all topics.
        nodes: Full names of nodes.
    """
    robots = {name.removesuffix(DESCRIPTION) for name in topics if name.endswith(DESCRIPTION)}
    own = description.removesuffix(DESCRIPTION)
    robots.add(own)

    def nearest(node: str) -> str | None:
        above = [robot for robot in robots if node.startswith(f'{robot}/')]
        return max(above, key=len, default=None)

    return sorted(node for node in set(nodes) if nearest(node) == own)


def stops_robot(node: str, services: Mapping[str, Collection[str]]) -> bool:
    """Return whether the `stop` of a node is that of a robot: it leads drives, or legs.

    Args:
        node: Its full name.
        services: Names and types of what it offers.
    """
    beside = node.rpartition('/')[0]
    return SET_NMT_TYPE in services.get(f'{node}/set_nmt', ()) or SET_MODE_TYPE in services.get(
        f'{beside}/set_mode', ()
    )
