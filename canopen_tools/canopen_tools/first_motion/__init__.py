# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The first motion of a joint at a terminal, with a master of its own on the bus.

The library first_motion guards the motion, concludes and corrects. `movers` command the drive,
`checks` look at it before, `program` is the terminal.
"""
