# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Waiting for the graph: complete, incomplete, changing and found."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from types import SimpleNamespace

import pytest

from ros2_frontend.aliases import Endpoint, NamesAndTypes
from ros2_frontend.ros import discovery
from ros2_frontend.ros.discovery import take_census, wait, WaitLimits
from ros2_frontend.ros.participants import DiscoveryPorts

UNKNOWN = '_NODE_NAME_UNKNOWN_'


@dataclass
class FakeView:
    """A view whose endpoints are set by the test: topic to (participant, node)."""

    publishing: dict[str, list[tuple[int, str]]]
    domain_id: int = 0
    looks: int = 0
    changes: int = 0
    read_topics: list[str] = field(default_factory=list)

    def topics(self, hidden: bool = False) -> NamesAndTypes:
        """The topics."""
        return [(name, ['x']) for name in self.publishing]

    def publishers(self, topic: str) -> list[Endpoint]:
        """The endpoints."""
        self.read_topics.append(topic)
        return [
            SimpleNamespace(node_name=node, endpoint_gid=[participant] * 16)
            for participant, node in self.publishing.get(topic, [])
        ]

    def subscriptions(self, topic: str) -> list[Endpoint]:
        """None."""
        return []

    def view(self) -> Hashable:
        """Something new on the first looks."""
        self.looks += 1
        return min(self.looks, self.changes)


def ports(count: int) -> DiscoveryPorts:
    """So many participants on this host."""
    return DiscoveryPorts(frozenset({0}), frozenset(range(1, count)))


@pytest.fixture
def count(monkeypatch: pytest.MonkeyPatch) -> dict[str, int]:
    """How many participants the kernel knows."""
    known = {'count': 0}
    monkeypatch.setattr(discovery, 'read_ports', lambda _: ports(known['count']))
    return known


def test_census_counts_participants_not_endpoints() -> None:
    """Two participants with three endpoints; a third is missing."""
    view = FakeView({'/rosout': [(1, 'a'), (1, 'b'), (2, 'c')]})
    assert take_census(view, ports(3)).missing == 1
    assert take_census(view, ports(2)).missing == 0
    assert take_census(view, ports(1)).missing == 0


def test_census_sees_participants_without_rosout_and_saves_work() -> None:
    """Other topics are looked at only when someone is missing."""
    view = FakeView({'/rosout': [(1, 'a')], '/x': [(2, 'b')], '/y': [(3, 'c')]})
    assert take_census(view, ports(2)).missing == 0
    assert '/y' not in view.read_topics


def test_census_counts_endpoints_of_unknown_nodes() -> None:
    """A participant whose nodes are unknown is not complete."""
    view = FakeView({'/rosout': [(1, UNKNOWN), (1, UNKNOWN), (2, 'c')]})
    assert take_census(view, ports(2)).unnamed == 2


def test_what_is_there_is_answered_at_once(count: dict[str, int]) -> None:
    """Even when the view is not complete."""
    count['count'] = 9
    assert wait(lambda: 'found', FakeView({}), WaitLimits(60.0, 60.0)) == 'found'


def test_a_complete_view_ends_the_wait(count: dict[str, int]) -> None:
    """Long before the limit, once nothing changes any more."""
    count['count'] = 1
    view = FakeView({'/rosout': [(1, 'a')]}, changes=4)
    assert wait(lambda: None, view, WaitLimits(60.0, 0.02)) is None
    assert view.looks > view.changes


@pytest.mark.parametrize(
    ('expected', 'nodes'), [(2, [(1, 'a')]), (1, [(1, UNKNOWN)])], ids=['missing', 'unnamed']
)
def test_an_incomplete_view_is_waited_for(
    count: dict[str, int], expected: int, nodes: list[tuple[int, str]]
) -> None:
    """Beyond the quiet time, until the limit."""
    count['count'] = expected
    view = FakeView({'/rosout': nodes})
    wait(lambda: None, view, WaitLimits(0.1, 0.0))
    assert view.looks > 2  # with a complete view, two looks are enough


def test_what_appears_late_is_found(count: dict[str, int]) -> None:
    """The look is repeated."""
    answers = iter([None, None, None, 'late'])
    assert wait(lambda: next(answers), FakeView({}), WaitLimits(60.0, 60.0)) == 'late'


def test_limits_follow_the_user_and_the_reach(monkeypatch: pytest.MonkeyPatch) -> None:
    """`--spin-time` is the limit; for a name it is also how long nothing may happen."""
    monkeypatch.setattr('ros2_frontend.ros.discovery.is_this_host', lambda environ: True)
    near = WaitLimits.for_lists(None)
    assert WaitLimits.for_lists(2.0).limit == 2.0
    assert WaitLimits.for_names(2.0) == WaitLimits(2.0, 2.0)
    assert WaitLimits.for_names(None).quiet < WaitLimits.for_names(None).limit
    monkeypatch.setattr('ros2_frontend.ros.discovery.is_this_host', lambda environ: False)
    assert WaitLimits.for_lists(None).quiet > near.quiet
