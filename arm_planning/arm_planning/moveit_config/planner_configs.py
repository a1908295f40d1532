# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Planner configurations by their names, as ompl_planning.yaml has them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

TYPE = 'type'  # key of what searches, in a configuration


@dataclass(frozen=True, slots=True)
class PlannerConfigs:
    """Names under which clients ask for planners."""

    # entries of each configuration, by its name
    configs: Mapping[str, Mapping[str, object]] = field(default_factory=dict)
    # names of the configurations of each group
    groups: Mapping[str, Sequence[str]] = field(default_factory=dict)
    # that of a group whose requests name none
    defaults: Mapping[str, str] = field(default_factory=dict)

    @property
    def ids(self) -> Sequence[str]:
        """Names as MoveIt lists them: the group, and the group with each configuration."""
        return [
            name
            for group, configs in self.groups.items()
            for name in (group, *(f'{group}[{config}]' for config in configs))
        ]

    def name(self, planner_id: str, group: str) -> str:
        """Return the name of a configuration.

        Args:
            planner_id: What a request has: the name, ``group[name]``, the group, or nothing.
        """
        name = planner_id.removeprefix(f'{group}[').removesuffix(']')
        return self.defaults.get(group, '') if name in {'', group} else name

    def search(self, name: str) -> str:
        """Return what searches by a configuration, by OMPL's name; empty where it is unknown."""
        listed = {each for names in self.groups.values() for each in names}
        if not self.configs and name in listed:  # by the names of MoveIt's own configurations
            return f'geometric::{name.removesuffix("ConfigDefault").removesuffix("k")}'
        return str(self.configs.get(name, {}).get(TYPE, ''))
