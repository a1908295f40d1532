# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the scenarios of the demos share: drives are enabled, parts run again and again."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Iterable, Mapping, Sequence
import itertools
import math
import time
from typing import Protocol, TypeVar

from demo_runner import DemoClient, DemoResult, DemoScenario, Display
from process_supervisor import CallError

from ..enabling import enabling_services
from .figures import Figures
from .report import warnings
from .results import Results

ENABLE_TIMEOUT = 15.0
"""Longest time in [s] for all drives to be enabled, and for them to be in their mode."""


class EndRequested(Exception):  # noqa: N818  # it is no error: the user asked for the end
    """The user asked for the end."""


class DriveClient(DemoClient, Protocol):
    """What every demo of an arm needs of ROS; :class:`.client.ArmClient` has it."""

    @property
    def figures(self) -> Figures:
        """The latest of /diagnostics, and what the demo measured."""

    def prepare(self, services: Iterable[str]) -> None:
        """Look for services of drives that will be called."""

    def call(self, services: list[str], timeout: float) -> Mapping[str, str]:
        """Call services of drives side by side."""


DriveClientT = TypeVar('DriveClientT', bound=DriveClient)


class ArmScenario(DemoScenario[DriveClientT]):
    """Enables the drives of an arm, and has it move."""

    opening = 'booting'

    def __init__(
        self,
        display: Display[Figures],
        joints: Iterable[str],
        mode_service: str,
        duration: float | None,
    ) -> None:
        """Prepare; nothing happens yet.

        Args:
            display: Where it is shown.
            joints: Names of the joints with a drive.
            mode_service: Service of a drive that selects the mode of streams.
            duration: How long it lasts in [s]; None until :meth:`leave`.
        """
        super().__init__(display)
        self._enabling = enabling_services(list(joints), mode_service)
        self._duration = math.inf if duration is None else duration

    @property
    def _others(self) -> Sequence[str]:
        """Services of drives that are called beside those that enable them."""
        return ()

    def _prepare(self, client: DriveClientT) -> None:
        client.prepare([*itertools.chain(*self._enabling), *self._others])

    def _perform(self, client: DriveClientT) -> None:
        self._enter('enabling')
        for services in self._enabling:
            client.call(services, ENABLE_TIMEOUT)
        self._moving.set()
        self._move(client)

    @abstractmethod
    def _move(self, client: DriveClientT) -> None:
        """Move the enabled arm, bring it to rest, and leave the result."""


class Parts(Protocol):
    """Motions that are run again and again.

    Each method but the last raises CallError, where somebody does not answer or what others rest
    on failed, GivenUpError, where the processes have ended, and EndRequested.
    """

    @property
    def results(self) -> Results:
        """What it found out."""

    def set_up(self) -> None:
        """Do what comes before the first part."""

    def run(self) -> None:
        """Run every part once."""

    def come_to_rest(self) -> None:
        """Cancel what is on its way, and wait for its end."""

    def conclude(self) -> None:
        """Add what was measured all the time to the results."""


MakeParts = Callable[[DriveClientT, Callable[[str], None], Callable[[], None]], Parts]
"""Makes the parts, for a client; one argument is called with the name of each part, one
often: it shows how it goes, and raises EndRequested."""


class PartsScenario(ArmScenario[DriveClientT]):
    """Runs parts until the time is over, once at least; after a problem no more."""

    def __init__(
        self,
        display: Display[Figures],
        joints: Iterable[str],
        mode_service: str,
        duration: float | None,
        make_parts: MakeParts[DriveClientT],
    ) -> None:
        """Prepare; nothing happens yet.

        Args:
            display: Where it is shown.
            joints: Names of the joints with a drive.
            mode_service: Service of a drive that selects the mode of streams.
            duration: How long it is repeated in [s]; None until :meth:`leave`.
            make_parts: Makes the parts.
        """
        super().__init__(display, joints, mode_service, duration)
        self._make_parts = make_parts

    def _move(self, client: DriveClientT) -> None:
        parts = self._make_parts(client, self._enter, lambda: self._look(client))
        results = parts.results
        try:
            self._repeat(parts)
        except EndRequested:
            self._enter('leaving')
            parts.come_to_rest()
        except CallError as error:
            results.problems.append(str(error))
        parts.conclude()
        noted = [*warnings(client.figures), *results.warnings]
        self.result = DemoResult(results.lines(), results.problems, noted)

    def _repeat(self, parts: Parts) -> None:
        begun = time.monotonic()
        parts.set_up()
        while True:
            lap = time.monotonic()
            parts.run()
            now = time.monotonic()
            if now + (now - lap) > begun + self._duration or parts.results.problems:
                return  # another one would take longer, or hide what went wrong
            parts.results.rows.clear()

    def _look(self, client: DriveClientT) -> None:
        self._show(client)
        if self.left:
            raise EndRequested
