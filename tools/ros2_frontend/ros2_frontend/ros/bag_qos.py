# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""QoS of recordings: offered profiles, a profile for all publishers, profiles for playing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from rosbag_files import OfferedQos, UNLIMITED

from ..names import Handle

RECORD_DEPTH = 10_000  # messages of a topic that may wait for the recorder: ten seconds at 1 kHz

PLAY_DEPTH = 10

_POLICIES = ('history', 'reliability', 'durability', 'liveliness')
_DURATIONS = ('deadline', 'lifespan', 'liveliness_lease_duration')
_COMMON = ('reliability', 'durability', 'deadline', 'lifespan')


def offered(profile: Handle) -> OfferedQos:
    """Convert the rclpy profile of a publisher to `OfferedQos`."""
    policies = {name: getattr(profile, name).name.lower() for name in _POLICIES}
    durations = {name: getattr(profile, name).nanoseconds for name in _DURATIONS}
    conventions = profile.avoid_ros_namespace_conventions
    return OfferedQos(
        depth=profile.depth, avoid_ros_namespace_conventions=conventions, **policies, **durations
    )


def to_profile(qos: OfferedQos) -> Handle:
    """Convert to a profile of rclpy."""
    from rclpy import qos as rclpy_qos
    from rclpy.duration import Duration

    policies = {
        name: getattr(rclpy_qos, f'{name.capitalize()}Policy')[getattr(qos, name).upper()]
        for name in _POLICIES
    }
    durations = {
        name: Duration(nanoseconds=getattr(qos, name))
        for name in _DURATIONS
        if getattr(qos, name) != UNLIMITED
    }
    conventions = qos.avoid_ros_namespace_conventions
    return rclpy_qos.QoSProfile(
        depth=qos.depth, avoid_ros_namespace_conventions=conventions, **policies, **durations
    )


def for_recording(publishers: Sequence[OfferedQos]) -> OfferedQos:
    """Return a profile that matches all publishers; transient local if all of them are."""
    reliable = all(each.reliability == 'reliable' for each in publishers)
    latched = all(each.durability == 'transient_local' for each in publishers)
    return OfferedQos(
        'keep_last',
        RECORD_DEPTH,
        'reliable' if reliable else 'best_effort',
        'transient_local' if latched and publishers else 'volatile',
    )


def for_playing(publishers: Sequence[OfferedQos]) -> OfferedQos:
    """Return the policies that all publishers of a recording share, with defaults for the rest."""
    default = OfferedQos('keep_last', PLAY_DEPTH)
    if not publishers:
        return default
    first = publishers[0]
    depth = max(PLAY_DEPTH, *(each.depth for each in publishers))
    common = {
        name: getattr(first, name)
        for name in _COMMON
        if all(getattr(each, name) == getattr(first, name) for each in publishers)
    }
    return replace(default, depth=depth, **common)


def overridden(qos: OfferedQos, depth: int) -> OfferedQos:
    """Return a profile of an overrides file, completed by the history that it may omit."""
    if qos.history in {'unknown', 'system_default'}:
        return replace(qos, history='keep_last', depth=qos.depth or depth)
    return qos


def is_compatible(requested: OfferedQos, publisher: OfferedQos) -> bool:
    """Return whether a subscription is compatible with a publisher."""
    if requested.reliability == 'reliable' and publisher.reliability == 'best_effort':
        return False
    return not (requested.durability == 'transient_local' and publisher.durability == 'volatile')
