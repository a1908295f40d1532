# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the hardware node and whoever commands the joints agree about."""

from __future__ import annotations

from typing import Final

STREAM_TIMEOUT: Final = 0.5
"""A pause [s] that ends a stream of joint commands: a robot that it leaves with a foot in the air
is laid down by the hardware node, so the next stream has to begin where the joints are then."""
