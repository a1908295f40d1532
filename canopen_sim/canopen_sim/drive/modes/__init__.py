# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The modes of operation of the simulated drive (CiA 402-2, clauses 9 to 14), one file each."""
