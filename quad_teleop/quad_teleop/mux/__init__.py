# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Several sources of velocities, one robot."""

from .multiplexer import Multiplexer
from .sources import Input, Inputs, read_inputs

__all__ = ['Input', 'Inputs', 'Multiplexer', 'read_inputs']
