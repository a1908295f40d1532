# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The search for a switch and an index pulse, as a sequence of directions and speeds."""

from __future__ import annotations

from enum import auto, Enum

from .switches import INDEX_METHODS, Reference, REFERENCES, Switches


class Phase(Enum):
    """What a search does."""

    SEARCH = auto()  # fast, until the switch is active
    LEAVE = auto()  # slowly past the edge, out of the active range
    RETURN = auto()  # slowly back over the edge
    INDEX = auto()  # slowly to the index pulse
    FOUND = auto()
    FAILED = auto()


class HomingRun:
    """One search for home: from the position of the axis it derives the direction.

    Attributes:
        phase: What it does.
        direction: Where it goes: -1, 1.
        home: Mechanical position of home in [inc], once found.
    """

    def __init__(self, method: int, switches: Switches, position: float) -> None:
        """Begin a search.

        Args:
            method: A number of :data:`~.switches.REFERENCES` or
                :data:`~.switches.INDEX_METHODS`.
            switches: Where the switches are.
            position: Mechanical position of the axis in [inc].
        """
        self.home = position
        self._switches = switches
        self._turned = False
        self._reference: Reference | None = REFERENCES.get(method)
        if self._reference is None:
            self.direction = INDEX_METHODS[method]
            self._seek_index(position, self.direction)
        else:
            self.phase = Phase.SEARCH
            self.direction = self._reference.first

    @property
    def fast(self) -> bool:
        """It moves with the speed of the search for a switch."""
        return self.phase is Phase.SEARCH

    @property
    def done(self) -> bool:
        """It has ended."""
        return self.phase in (Phase.FOUND, Phase.FAILED)

    def look(self, position: float) -> None:
        """See where the axis is, mechanically in [inc]."""
        if self._reference is None or self.phase is Phase.INDEX:
            self._look_for_index(position)
            return
        active = self._switches.active(self._reference.switch, position)
        if self.phase is Phase.SEARCH:
            self._search(active, position)
        elif self.phase is Phase.LEAVE:
            self._leave(self._reference, active, position)
        elif self.phase is Phase.RETURN and active:
            self._pass_edge(self._reference)

    def _search(self, active: bool, position: float) -> None:
        if active and self._reference is not None:
            self.phase, self.direction = Phase.LEAVE, self._reference.side
        elif self._switches.limit_ahead(self.direction, position):
            self.direction = -self.direction
            if self._turned:
                self.phase = Phase.FAILED
            self._turned = True

    def _leave(self, reference: Reference, active: bool, position: float) -> None:
        if active:
            if self._switches.limit_ahead(self.direction, position):
                self.phase = Phase.FAILED
            return
        edge = self._switches.edge(reference.switch, reference.side)
        if (position - edge) * self.direction < 0.0:
            return  # it ran over the whole switch, and comes back
        if reference.final == reference.side:
            self._pass_edge(reference)
        else:
            self.phase, self.direction = Phase.RETURN, reference.final

    def _pass_edge(self, reference: Reference) -> None:
        edge = self._switches.edge(reference.switch, reference.side)
        if reference.to_index:
            self._seek_index(edge, reference.final)
        else:
            self.home, self.phase = edge, Phase.FOUND

    def _seek_index(self, position: float, direction: int) -> None:
        self.phase, self.direction = Phase.INDEX, direction
        self.home = self._switches.next_index(position, direction)

    def _look_for_index(self, position: float) -> None:
        if (position - self.home) * self.direction >= 0.0:
            self.phase = Phase.FOUND
        elif self._switches.limit_ahead(self.direction, position):
            self.phase = Phase.FAILED
