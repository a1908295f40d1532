# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The network: boot-up, NMT, SDO queues, SYNC cycle, process image."""
