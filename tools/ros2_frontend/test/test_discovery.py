# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How long a command waits for the graph, in virtual time."""

from __future__ import annotations

from types import SimpleNamespace

import pytest

from ros2_frontend.ros import graph
from ros2_frontend.ros.graph import Graph


class Clock:
    """Steady time that passes by sleeping only."""

    now = 100.0

    def monotonic(self) -> float:
        """Return it in [s]."""
        return self.now

    def sleep(self, duration: float) -> None:
        """Advance by a duration."""
        self.now += duration


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> Clock:
    """Replace the time of the module by a virtual one."""
    clock = Clock()
    monkeypatch.setattr(graph, 'time', clock)
    return clock


def view(known: int, spin_time: float | None = None, nodes: int = 2) -> Graph:
    """Return a graph in which some participants are known as those of ROS, and some nodes."""
    node = SimpleNamespace(
        context=SimpleNamespace(get_domain_id=lambda: 7),
        get_publishers_info_by_topic=lambda topic, **_: [topic] * known,
        get_node_names_and_namespaces=lambda: [('node', '/')] * nodes,
    )
    return Graph(SimpleNamespace(node=node), spin_time)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ('seen', 'here', 'waits'),
    [
        ((2, None), True, (0.5, 1.5)),
        ((1, None), True, (1.0, 1.5)),  # a node is late, or the other participant is not of ROS
        ((2, None, 1), True, (1.0, 1.5)),  # the other one has not named its nodes
        ((2, None), False, (3.2, 3.2)),
        ((2, 2.0), True, (2.0, 2.0)),
        ((1, 0.2), False, (0.2, 0.2)),
    ],
)
def test_a_command_waits_as_its_user_and_the_reach_of_dds_want(
    clock: Clock,
    monkeypatch: pytest.MonkeyPatch,
    seen: tuple[int, float | None] | tuple[int, float | None, int],
    here: bool,
    waits: tuple[float, float],
) -> None:
    """Lists as ros2cli on this host; a name that is missing a little longer."""
    monkeypatch.setattr(graph, 'is_this_host', lambda environ: here)
    monkeypatch.setattr(graph, 'participants_on_this_host', lambda domain: 2)
    found = view(*seen)
    found.settle()
    assert clock.now - 100.0 == pytest.approx(waits[0])
    assert found.wait_for(lambda: None) is None
    assert clock.now - 100.0 == pytest.approx(waits[1])


def test_what_is_there_or_comes_late_is_found(clock: Clock) -> None:
    """At once, and by looking again."""
    found = view(2)
    assert found.wait_for(lambda: 'here') == 'here'
    assert clock.now == 100.0
    assert found.wait_until(lambda: 'late' if clock.now > 160.0 else None) == 'late'
    assert found.wait_until(lambda: None, 2.0) is None
    assert clock.now == pytest.approx(162.0, abs=0.3)
