# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The ROS client of the demos: calls services of the drives, and receives /diagnostics."""

from __future__ import annotations

from collections.abc import Callable

from diagnostic_msgs.msg import DiagnosticArray

from ..service_client import ServiceClient
from .figures import Figures


class ArmClient(ServiceClient):
    """A node of its own; use it in one thread.

    Attributes:
        figures: The latest of /diagnostics.
    """

    def __init__(self, given_up: Callable[[], bool], namespace: str = '') -> None:
        """Join the ROS graph.

        Args:
            given_up: True when nothing shall be waited for any more.
            namespace: That of the arm.
        """
        super().__init__('demo', given_up, namespace)
        self.figures = Figures()
        self.node.create_subscription(DiagnosticArray, 'diagnostics', self._take, 50)

    def _take(self, message: DiagnosticArray) -> None:
        self.figures = self.figures.updated(message.status)
