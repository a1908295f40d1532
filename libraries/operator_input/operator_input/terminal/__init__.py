# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Keys of a terminal: raw mode, every encoding, true releases where there are any."""

from .keyboard import TerminalKeyboard
from .negotiation import Stage
from .status import StatusLine

__all__ = ['Stage', 'StatusLine', 'TerminalKeyboard']
