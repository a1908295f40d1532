# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which worker of pytest-xdist gets which tests."""

from __future__ import annotations

import pytest
from xdist.remote import Producer
from xdist.scheduler import LoadGroupScheduling
from xdist.workermanage import WorkerController


class Lanes(LoadGroupScheduling):  # type: ignore[misc]  # it has no types
    """Gives files with whole robots to as many workers as cores: more would starve them.

    Each of these workers takes such a file as long as there is one, then other tests. Pages are
    for the first of them, as browsers without a graphics card take much of a core. The other
    workers take other tests as long as there are any.
    """

    def __init__(self, config: pytest.Config, log: Producer, robots: int) -> None:
        """Let ``robots`` workers begin with robots."""
        super().__init__(config, log)
        self._robots = robots

    def _assign_work_unit(self, node: WorkerController) -> None:
        lane = self.nodes.index(node)
        if lane == 0:
            order = ('pages', 'robots', '')
        elif lane < self._robots:
            order = ('robots', '', 'pages')
        else:
            order = ('', 'robots', 'pages')
        scopes = (scope for kind in order for scope in self.workqueue if _kind(scope) == kind)
        self.workqueue.move_to_end(next(scopes), last=False)
        super()._assign_work_unit(node)


def _kind(scope: str) -> str:
    kind = scope.partition(' ')[0]
    return kind if kind in {'pages', 'robots'} else ''
