# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""QoS options of `topic echo`, `hz`, `pub`, and the choice that fits the publishers."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import Any

from rosbag_files import OfferedQos, UNLIMITED

from ..cli.commands import positive_float, unsigned_int
from ..names import Handle
from .graph import Graph

RECORD_DEPTH = 10_000  # messages of a topic that may wait for the recorder: ten seconds at 1 kHz

PLAY_DEPTH = 10

_DURATIONS = ('deadline', 'lifespan', 'liveliness_lease_duration')
_COMMON = ('reliability', 'durability', 'deadline', 'lifespan')


def offered(profile: Handle) -> OfferedQos:
    """Write down what a publisher offers."""
    policies = {name: getattr(profile, name).name.lower() for name in _POLICIES}
    durations = {name: getattr(profile, name).nanoseconds for name in _DURATIONS}
    conventions = profile.avoid_ros_namespace_conventions
    return OfferedQos(
        depth=profile.depth, avoid_ros_namespace_conventions=conventions, **policies, **durations
    )


def to_profile(qos: OfferedQos) -> Handle:
    """Make a profile of rclpy."""
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
    """What connects to all publishers, and gets what they kept where all of them keep."""
    reliable = all(each.reliability == 'reliable' for each in publishers)
    latched = all(each.durability == 'transient_local' for each in publishers)
    return OfferedQos(
        'keep_last',
        RECORD_DEPTH,
        'reliable' if reliable else 'best_effort',
        'transient_local' if latched and publishers else 'volatile',
    )


def for_playing(publishers: Sequence[OfferedQos]) -> OfferedQos:
    """What the publishers of a recording offered, where they agreed; else the default."""
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
    """A profile of a file with overrides, with the history that a file may leave out."""
    if qos.history in {'unknown', 'system_default'}:
        return replace(qos, history='keep_last', depth=qos.depth or depth)
    return qos


def is_compatible(requested: OfferedQos, publisher: OfferedQos) -> bool:
    """Whether a subscription gets what a publisher sends."""
    if requested.reliability == 'reliable' and publisher.reliability == 'best_effort':
        return False
    return not (requested.durability == 'transient_local' and publisher.durability == 'volatile')


_POLICIES = ('history', 'reliability', 'durability', 'liveliness')
_FALL_BACK = (
    'Some, but not all, publishers are offering QoS{0}Policy.{1}. Falling back to '
    'QoS{0}Policy.{2} as it will connect to all publishers'
)


def _policy(name: str) -> Handle:
    from rclpy import qos

    return getattr(qos, f'QoS{name.capitalize()}Policy')


def _preset(key: str) -> Handle:
    """Return a profile of its own: a preset is shared by the whole process."""
    from rclpy.qos import QoSPresetProfiles, QoSProfile

    preset = QoSPresetProfiles.get_from_short_key(key)
    names = [name.lstrip('_') for name in QoSProfile.__slots__]
    return QoSProfile(**{name: getattr(preset, name) for name in names})


def add_qos_arguments(parser: Any, verb: str, preset: str) -> None:  # noqa: ANN401  # argparse's
    """Add the QoS options of a verb that does `subscribe` or `publish` with a preset."""
    from rclpy.qos import QoSPresetProfiles

    default = _preset(preset)

    def help_(what: str, value: str, default_: object) -> str:
        return (
            f'{what} setting to {verb} with '
            f'(overrides {value} value of --qos-profile option, default: {default_})'
        )

    parser.add_argument(
        '--qos-profile',
        choices=QoSPresetProfiles.short_keys(),
        default=preset,
        help=f'Quality of service preset profile to {verb} with (default: {preset})',
    )
    parser.add_argument(
        '--qos-depth',
        metavar='N',
        type=unsigned_int,
        help=help_('Queue size', 'depth', default.depth),
    )
    for name in _POLICIES:
        parser.add_argument(
            f'--qos-{name}',
            choices=_policy(name).short_keys(),
            help=help_(f'Quality of service {name}', name, getattr(default, name).short_key),
        )
    parser.add_argument(
        '--qos-liveliness-lease-duration-seconds',
        type=positive_float,
        help=help_(
            'Quality of service liveliness lease duration',
            'liveliness lease duration',
            default.liveliness_lease_duration,
        ),
    )


SUBSCRIPTION_QOS = partial(add_qos_arguments, verb='subscribe', preset='sensor_data')
PUBLISHER_QOS = partial(add_qos_arguments, verb='publish', preset='default')


def profile_of(args: Namespace) -> Handle:
    """Return the preset with the overrides of the parsed options."""
    from rclpy.duration import Duration

    profile = _preset(args.qos_profile)
    for name in _POLICIES:
        if (chosen := getattr(args, f'qos_{name}')) is not None:
            setattr(profile, name, _policy(name).get_from_short_key(chosen))
    if args.qos_liveliness_lease_duration_seconds is not None:
        seconds = args.qos_liveliness_lease_duration_seconds
        profile.liveliness_lease_duration = Duration(seconds=seconds)
    if args.qos_depth is not None:
        profile.depth = args.qos_depth
    elif profile.durability.short_key == 'transient_local' and profile.depth == 0:
        profile.depth = 1
    return profile


def matching_profile(
    args: Namespace, graph: Graph, topic: str, report: Callable[[str], None]
) -> Handle:
    """Return the profile that connects to all publishers of a topic, unless the options name one.

    Reliable when all publishers are, transient local when all are; else what connects to all,
    which is reported.
    """
    profile = profile_of(args)
    publishers = [info.qos_profile for info in graph.publishers(topic)]
    overridden = any(
        value is not None
        for name, value in vars(args).items()
        if name.startswith('qos_') and name != 'qos_profile'
    )
    if not publishers or overridden:
        return profile
    for name, strong, weak in (
        ('reliability', 'RELIABLE', 'BEST_EFFORT'),
        ('durability', 'TRANSIENT_LOCAL', 'VOLATILE'),
    ):
        offered = [getattr(publisher, name).name == strong for publisher in publishers]
        if any(offered) and not all(offered):
            report(_FALL_BACK.format(name.capitalize(), strong, weak))
        setattr(profile, name, _policy(name)[strong if all(offered) else weak])
    return profile
