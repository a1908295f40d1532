# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a policy observed in its training: the range of each number of its observation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import json

import numpy as np
import numpy.typing as npt

from ..exceptions import PolicyError
from .network import Floats

STATISTICS_KEY = 'observation_statistics'
"""Key in the metadata of a model: a JSON object with lists of mean, std, min and max."""
DIGITS = 5  # of each number in the metadata


@dataclass(frozen=True, slots=True, eq=False)
class ObservationStatistics:
    """Of each number of an observation, as the network is given it."""

    mean: Floats  # means
    std: Floats  # standard deviations
    least: Floats  # smallest values
    most: Floats  # largest values

    @classmethod
    def of(cls, rows: npt.NDArray[np.floating]) -> ObservationStatistics:
        """Return those of some observations, one in each row.

        Raises:
            ValueError: There is none.
        """
        if not len(rows):
            raise ValueError('statistics need one observation at least')
        values = np.asarray(rows, np.float64)
        found = (values.mean(0), values.std(0), values.min(0), values.max(0))
        mean, std, least, most = (np.asarray(each, np.float32) for each in found)
        return cls(mean, std, least, most)

    @classmethod
    def from_metadata(
        cls, metadata: Mapping[str, str], width: int
    ) -> ObservationStatistics | None:
        """Return those that a model has; None when it has none.

        Raises:
            PolicyError: They are no such object, or of another width.
        """
        if STATISTICS_KEY not in metadata:
            return None
        try:
            found = json.loads(metadata[STATISTICS_KEY])
            arrays = [np.array(found[key], np.float32) for key in ('mean', 'std', 'min', 'max')]
        except (ValueError, KeyError, TypeError) as error:
            raise PolicyError(f'metadata {STATISTICS_KEY} cannot be read: {error}') from error
        if any(array.shape != (width,) for array in arrays):
            raise PolicyError(f'metadata {STATISTICS_KEY} is not for {width} numbers')
        return cls(*arrays)

    def to_json(self) -> str:
        """Return it as metadata have it."""
        named = {'mean': self.mean, 'std': self.std, 'min': self.least, 'max': self.most}
        rounded = {
            key: [float(f'{value:.{DIGITS}g}') for value in array.tolist()]
            for key, array in named.items()
        }
        return json.dumps(rounded, separators=(',', ':'))
