# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The first motion at a terminal: the motion, what was seen, and the conclusion."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
import signal
import sys

from arm_canopen import BusConfig, load_bus, NodeConfig
from arm_canopen.config import DriveConfig
from first_motion import (
    AxisScales,
    BusEditError,
    Correction,
    DriveFacts,
    edited,
    JointKind,
    judge,
    Judgement,
    propose,
    replace_file,
    too_far,
    too_fast,
    Verdict,
)

from .dialogue import agrees, ask_seen, choose, FirstMotionError, say
from .interruptions import Interrupted, interruptions
from .motion import move, Record, Request


def run(request: Request) -> int:
    """Move, ask and conclude, until the person has enough.

    Returns:
        0 when the joint moved as it should, else 1; 130 or 129 when it was interrupted, with the
        drive stopped.

    Raises:
        CanopenError: The bus, a file or the drive prevents it; the drive is stopped.
    """
    _require_small(request)
    try:
        with interruptions():
            while (code := _once(request)) is None:
                pass
            return code
    except Interrupted as interruption:
        if interruption.number != signal.SIGHUP:
            say('interrupted')
        return 128 + interruption.number


def _once(request: Request) -> int | None:
    """Make one motion and conclude; return the exit code, or None for another one."""
    config = load_bus(request.path)
    node, axis = _find(config, request)
    record = move(request, axis)
    if record is None:
        say('nothing was moved')
        return 1
    _show(request.distance.kind, record)
    judgement = _conclude(request, record)
    if judgement.verdict is Verdict.RIGHT:
        return 0
    if not judgement.verdict.wants_change or not _correct(request, node, axis, record, judgement):
        return 1
    return None if agrees('repeat the motion?') else 1


def _require_small(request: Request) -> None:
    kind = request.distance.kind
    if far := too_far(kind, request.distance.value):
        raise FirstMotionError(f'--distance {far}')
    if request.speed.kind is not kind:
        raise FirstMotionError(
            f'--speed is in {request.speed.kind.value}/s, --distance in {kind.value}: a first '
            'motion is slow; give both in units of one kind'
        )
    if fast := too_fast(kind, request.speed.value):
        raise FirstMotionError(f'--speed {fast}')
    if not sys.stdin.isatty():
        raise FirstMotionError('a person has to hold a key: start this in a terminal')


def _find(config: BusConfig, request: Request) -> tuple[NodeConfig, DriveConfig]:
    for node in config.nodes:
        for axis in node.axes if node.is_drive else ():
            if (axis.name or node.name) == request.joint:
                return node, replace(axis, name=request.joint)
    known = ', '.join(config.joints) or 'none'
    raise FirstMotionError(f'no joint {request.joint!r} in {request.path}; joints: {known}')


def _show(kind: JointKind, record: Record) -> None:
    say(f'The motion has ended: {record.detail}.')
    say(
        f'  the drive reported {kind.shown(record.before)} before, {kind.shown(record.after)} '
        f'after: {record.after - record.before:+.4g} {"rad" if kind is JointKind.TURNS else "m"} '
        f'in the unit of bus.yml, {kind.shown(record.after - record.before)}'
    )


def _conclude(request: Request, record: Record) -> Judgement:
    """Ask what the person saw, and say what that means."""
    kind, reported = request.distance.kind, record.after - record.before
    seen = ask_seen(kind, reported)
    facts = record.facts
    scale = facts.axis.scale_pos_to_dev
    says = DriveFacts(scale, facts.factors.gear, facts.factors.position_scale or None)
    judgement = judge(kind, request.distance.value, reported, seen, says)
    say(f'{request.joint}: {judgement.verdict.value}')
    if judgement.remedy:
        say(f'  {judgement.remedy}')
    for number, cause in enumerate(judgement.causes, 1):
        say(f'  {number}. {cause.text} (factor {cause.factor:.4g})')
    return judgement


def _correct(
    request: Request,
    node: NodeConfig,
    axis: DriveConfig,
    record: Record,
    judgement: Judgement,
) -> bool:
    """Show the change of bus.yml, and make it when the person wants; return whether it was."""
    causes, is_certain = judgement.causes, judgement.verdict is Verdict.WRONG_SIGN
    cause = None
    if causes:
        is_certain = len(causes) == 1
        cause = causes[0] if is_certain else choose(causes)
        if cause is None:
            return False
    elif not is_certain:
        say(
            f'  no usual cause has the factor {judgement.measured:.3g}; as it was seen by eye, '
            'measure it over a larger --distance before you keep it'
        )
    # what the file says decides which keys change; what the drive says, the values before
    current = replace(record.facts.axis, scale_from_factor_group=axis.scale_from_factor_group)
    correction = propose(AxisScales.of(current), judgement, cause)
    say(f'In {request.path}, at {node.name}:')
    for key, value in correction.values.items():
        before = correction.before[key]
        say(f'  {key}: {before!r} -> {value!r}' if before != value else f'  {key}: {value!r}')
    for note in correction.notes:
        say(f'  {note}')
    if not (request.write and is_certain) and not agrees('change them?'):
        return False
    channel = axis.channel if len(node.axes) > 1 else None
    apply(correction, request.path, node.name, request.joint, channel)
    say(f'{request.path.resolve()} is changed')
    return True


def apply(
    correction: Correction, path: Path, device: str, joint: str, channel: int | None
) -> None:
    """Change keys in a bus.yml; the file is replaced as a whole, or not at all.

    The channel is the place of the axis in ``channels``; None for a device with one axis.

    Raises:
        FirstMotionError: It has a form in which nothing is changed, or the result would differ.
        ConfigError: The file could not be read with these keys.
    """
    values = correction.values

    def check(new: Path) -> None:
        for axis in load_bus(new).node(device).axes:
            is_meant = (axis.name or device) == joint
            if is_meant and any(getattr(axis, key) != value for key, value in values.items()):
                raise FirstMotionError(
                    f'{path}: the keys of {device} are not where they were expected; write by '
                    f'hand: {", ".join(f"{key}: {value}" for key, value in values.items())}'
                )

    edit = partial(edited, device=device, values=values, reason=correction.reason, channel=channel)
    try:
        replace_file(path, edit, check)
    except BusEditError as error:
        raise FirstMotionError(f'{path}: {error}') from error
