# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Builds a contract from a document; one error lists all missing, unknown and invalid values."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
import difflib
from enum import Enum
import math
from typing import Any, TypeVar

from quad_description import FEET

from ...exceptions import PolicyError
from .document import ContractDocument
from .model import (
    ActionContract,
    BodyFrame,
    CommandRanges,
    FIXED_WIDTHS,
    Gains,
    HistoryLayout,
    HistoryStart,
    Newest,
    ObservationTerm,
    PER_JOINT,
    PolicyContract,
    QuaternionOrder,
    RecurrentState,
    Source,
)

T = TypeVar('T')
E = TypeVar('E', bound=Enum)
HOW = (
    'set what is open in a file (check_policy --contract FILE, parameter policy_contract), or in '
    'the model: attach_contract MODEL [FILE ...] --set KEY=VALUE'
)
MAX_HISTORY = 200  # steps; more is a mistake
MAX_POINTS = 10_000  # of a constant or a scan

MEANINGS = {
    'joints': 'names of the joints in the order of observations and actions',
    'default_positions': 'default pose in [rad], a number for each joint',
    'period': 'time between two steps of the policy in [s]',
    'observation.terms': 'terms of the observation, in their order',
    'action.scale': 'what an action of 1 moves a joint by in [rad]',
    'source': f'one of {", ".join(each.value for each in Source)}',
    'frame': 'frame of the velocity: base, or yawed (turned by 180 degrees about z)',
    'order': 'order of the quaternion: xyzw or wxyz',
    'relative': 'true where joint positions count from the default pose, else false',
    'phase_period': 'period of the clock in [s]',
    'values': 'what it always is; for a height scan: that of a flat ground at normal height',
    'feet': f'links of the feet in the order of the training: {", ".join(FEET)}, in any order',
    'flat': 'true: the ground counts as flat; nothing measures heights here',
    'layout': 'per_term (all steps of a term together) or frames (whole observations)',
    'newest': 'first or last',
}
"""What an open key means, by its path or its last part."""


class _UnfitError(Exception):
    """A value does not suit its key; the text says what is expected."""


class _Section:
    """Reads keys from a mapping, one by one; all sections of a contract share their findings."""

    def __init__(self, values: object, path: str, above: _Section | None = None) -> None:
        # where a person finds the value of an open key, by its path
        self.hints: Mapping[str, str] = above.hints if above else {}
        # keys that are needed and have no value, with what they mean
        self.open: list[str] = above.open if above else []
        self.wrong: list[str] = above.wrong if above else []  # what is unknown or senseless
        self._path = path
        self._known: list[str] = []
        if not isinstance(values, Mapping):
            self.wrong.append(f'{path or "the contract"} must be a mapping, not {values!r}')
            values = {}
        self.values = {str(key): value for key, value in values.items()}  # what the mapping has

    def path(self, key: str) -> str:
        """Return the full path of a key."""
        return f'{self._path}.{key}' if self._path else key

    def missing(self, key: str) -> None:
        """Record a missing key."""
        path = self.path(key)
        meaning = MEANINGS.get(path) or MEANINGS.get(key, '')
        hint = self.hints.get(path)
        self.open.append(
            path + (f': {meaning}' if meaning else '') + (f' ({hint})' if hint else '')
        )

    def required(self, key: str, convert: Callable[[Any], T], default: T) -> T:
        """Return a value; if it is missing, record that and return the default."""
        if self.values.get(key) is None:
            self.missing(key)
        return self.optional(key, convert, default)

    def optional(self, key: str, convert: Callable[[Any], T], default: T) -> T:
        """Return a value, or the default if it is missing."""
        self._known.append(key)
        value = self.values.get(key)
        if value is None:
            return default
        try:
            return convert(value)
        except _UnfitError as problem:
            self.wrong.append(f'{self.path(key)} {value!r} must be {problem}')
            return default

    def section(self, key: str) -> _Section:
        """Return the mapping below a key; empty if it is missing."""
        self._known.append(key)
        value = self.values.get(key)
        return _Section({} if value is None else value, self.path(key), self)

    @property
    def keys(self) -> tuple[str, ...]:
        """Return all keys and mark them as known."""
        self._known.extend(self.values)
        return tuple(self.values)

    def end(self) -> None:
        """Record the keys that were not read."""
        for key in self.values:
            if key not in self._known:
                close = difflib.get_close_matches(key, self._known, n=1)
                hint = f'did you mean {close[0]!r}?' if close else f'known: {sorted(self._known)}'
                self.wrong.append(f'unknown key {self.path(key)}; {hint}')


def build_contract(document: ContractDocument) -> PolicyContract:
    """Build a contract from the merged document.

    Raises:
        PolicyError: A value is missing, unknown, invalid or unsupported; the message lists all.
    """
    top = _Section(document.values, '')
    top.hints = document.hints
    contract = _contract(top)
    problems = [*document.refusals, *top.wrong]
    if top.open:
        problems.append(f'open: {"; ".join(top.open)}')
        problems.append(HOW)
    if problems:
        raise PolicyError(
            'the contract of the policy is not complete:\n'
            + '\n'.join(f'  {problem}' for problem in problems),
            '; '.join(problems),
        )
    return contract


def _contract(top: _Section) -> PolicyContract:
    unknown: tuple[str, ...] = ()
    joints = top.required('joints', _words, unknown)
    count = len(joints)
    defaults = top.required('default_positions', _numbers(count), (0.0,) * count)
    observation = top.section('observation')
    history = observation.section('history')
    section, states = observation.section('terms'), top.section('recurrence')
    terms = tuple(_term(name, section.section(name), count) for name in section.keys)
    if not terms:
        observation.missing('terms')
    stacked = any(term.history > 1 for term in terms)
    needed = history.required if stacked else history.optional
    layout = needed('layout', _choice(HistoryLayout), HistoryLayout.PER_TERM)
    if layout is HistoryLayout.FRAMES and len({term.history for term in terms}) > 1:
        top.wrong.append(
            'observation.history.layout frames needs the same history of all terms, not '
            + ', '.join(f'{term.name} {term.history}' for term in terms)
        )
    contract = PolicyContract(
        joint_names=joints,
        default_positions=defaults,
        period=top.required('period', _number(1e-4, 10.0), 0.02),
        terms=terms,
        clip=observation.optional('clip', _number(0.0, math.inf), None),
        history_layout=layout,
        newest=needed('newest', _choice(Newest), Newest.LAST),
        history_start=history.optional('start', _choice(HistoryStart), HistoryStart.REPEAT),
        action=_action(top.section('action'), count, defaults),
        recurrence=tuple(
            RecurrentState(name, states.optional(name, str, '')) for name in states.keys
        ),
        commands=_commands(top.section('commands')),
        gains=_gains(top.section('gains'), count),
        robot=top.optional('robot', str, ''),
        kind=top.optional('kind', str, ''),
    )
    history.end()
    observation.end()
    top.end()
    return contract


def _term(name: str, section: _Section, joints: int) -> ObservationTerm:
    source = section.required('source', _choice(Source), Source.CONSTANT)
    values: tuple[float, ...] = ()
    if source is Source.HEIGHT_SCAN:
        section.required('flat', _declared, default=True)
    if source in {Source.HEIGHT_SCAN, Source.CONSTANT}:
        values = section.required('values', _any_numbers, (0.0,))
    count = FIXED_WIDTHS.get(source) or (joints if source in PER_JOINT else len(values))

    def own(key: str, sources: Collection[Source], convert: Callable[[Any], T], default: T) -> T:
        """Return a value that the terms of some sources need, and no others have."""
        return section.required(key, convert, default) if source in sources else default

    velocities = {Source.LINEAR_VELOCITY, Source.ANGULAR_VELOCITY}
    threshold, noise = 0.0, None
    if source is Source.PHASE:
        threshold = section.optional('phase_threshold', _number(0.0, 1.0), threshold)
    if source is Source.JOINT_VELOCITIES:
        noise = section.optional('noise', _number(0.0), noise)
    term = ObservationTerm(
        name=name,
        source=source,
        width=count,
        scale=section.optional('scale', _numbers(count), (1.0,) * count),
        offset=section.optional('offset', _numbers(count), (0.0,) * count),
        clip=section.optional('clip', _pair, None),
        history=section.optional('history', _number(1, MAX_HISTORY, whole=True), 1),
        frame=own('frame', velocities, _choice(BodyFrame), BodyFrame.BASE),
        relative=own('relative', {Source.JOINT_POSITIONS}, _flag, default=True),
        quaternion=own(
            'order', {Source.ORIENTATION}, _choice(QuaternionOrder), QuaternionOrder.XYZW
        ),
        phase_period=own('phase_period', {Source.PHASE}, _number(0.1, 5.0), 1.0),
        phase_threshold=threshold,
        values=values,
        feet=own('feet', {Source.FOOT_CONTACTS}, _feet, ()),
        noise=noise,
    )
    section.end()
    return term


def _action(section: _Section, joints: int, defaults: tuple[float, ...]) -> ActionContract:
    action = ActionContract(
        scale=section.required('scale', _numbers(joints), (1.0,) * joints),
        offset=section.optional('offset', _numbers(joints), defaults),
        clip=section.optional('clip', _pairs(joints), None),
        target_clip=section.optional('target_clip', _pairs(joints), None),
        low_pass=section.optional('low_pass', _number(0.0, 1000.0), 0.0),
        output=section.optional('output', str, ''),
    )
    section.end()
    return action


def _commands(section: _Section) -> CommandRanges | None:
    if not section.values:
        return None
    free = (-math.inf, math.inf)
    ranges = CommandRanges(*(section.optional(axis, _pair, free) for axis in ('x', 'y', 'yaw')))
    section.end()
    return ranges


def _gains(section: _Section, joints: int) -> Gains | None:
    none = (0.0,) * joints
    stiffness = section.optional('stiffness', _numbers(joints), none)
    damping = section.optional('damping', _numbers(joints), none)
    section.end()
    return Gains(stiffness, damping) if any(stiffness) or any(damping) else None


def _number(
    lowest: float = -math.inf, highest: float = math.inf, *, whole: bool = False
) -> Callable[[object], Any]:
    def convert(value: object) -> float:
        try:
            # YAML 1.1 takes 1e-3 for a text
            number = math.nan if isinstance(value, bool) else float(value)  # type: ignore[arg-type]
        except (TypeError, ValueError):
            number = math.nan
        if math.isnan(number):
            raise _UnfitError('a number')
        if not lowest <= number <= highest:
            raise _UnfitError(f'within {lowest:g} to {highest:g}')
        if whole and number != int(number):
            raise _UnfitError('a whole number')
        return int(number) if whole else number

    return convert


def _any_numbers(value: object) -> tuple[float, ...]:
    entries = value if isinstance(value, (list, tuple)) else [value]
    if not 1 <= len(entries) <= MAX_POINTS:
        raise _UnfitError(f'1 to {MAX_POINTS} numbers')
    numbers = tuple(map(_number(), entries))
    if not all(map(math.isfinite, numbers)):
        raise _UnfitError('finite numbers')
    return numbers


def _numbers(count: int) -> Callable[[object], tuple[float, ...]]:
    def convert(value: object) -> tuple[float, ...]:
        numbers = _any_numbers(value)
        if not isinstance(value, (list, tuple)):
            return numbers * count
        if count and len(numbers) != count:  # 0: the joints are open
            raise _UnfitError(f'a number or {count} of them, not {len(numbers)}')
        return numbers

    return convert


def _pair(value: object) -> tuple[float, float]:
    if isinstance(value, (list, tuple)) and len(value) == 2:
        low, high = map(_number(), value)
        if low <= high:
            return low, high
    raise _UnfitError('two numbers, lowest and highest')


def _pairs(count: int) -> Callable[[object], tuple[tuple[float, float], ...]]:
    def convert(value: object) -> tuple[tuple[float, float], ...]:
        if not isinstance(value, (list, tuple)):
            raise _UnfitError('two numbers, or two for each joint')
        if all(isinstance(each, (list, tuple)) for each in value):
            if len(value) != count:
                raise _UnfitError(f'two numbers, or two for each of {count} joints')
            return tuple(map(_pair, value))
        return (_pair(value),) * count

    return convert


def _flag(value: object) -> bool:
    if not isinstance(value, bool):
        raise _UnfitError('true or false')
    return value


def _feet(value: object) -> tuple[str, ...]:
    names = _words(value)
    if sorted(names) != sorted(FEET):
        raise _UnfitError(f'each of {", ".join(FEET)} once, in the order of the training')
    return names


def _declared(value: object) -> bool:
    if value is not True:
        raise _UnfitError('true: nothing measures heights here')
    return value


def _words(value: object) -> tuple[str, ...]:
    if not isinstance(value, (list, tuple)) or not all(isinstance(each, str) for each in value):
        raise _UnfitError('a list of names')
    return tuple(value)


def _choice(kind: type[E]) -> Callable[[object], E]:
    def convert(value: object) -> E:
        try:
            return kind(value)
        except ValueError:
            raise _UnfitError(f'one of {", ".join(each.value for each in kind)}') from None

    return convert
