# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The first motion of a joint: guarded while it moves, then judged by what a person has seen.

`guard` decides, `judgement` concludes, `scales` and `bus_edit` correct: pure, without clock, bus
or terminal. `movers` command the drive, `checks` look at it before, `program` is the terminal.
"""
