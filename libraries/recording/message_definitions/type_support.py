# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Loads the part of rosidl that message types need at run time."""

from __future__ import annotations

import importlib
import sys
from typing import Any

_TYPE_SUPPORT = 'rosidl_generator_py'
_GENERATOR = 'rosidl_generator_py.generate_py_impl'


def load_type_support() -> None:
    """Load the importer of type supports without the code generator.

    The package goes without its generator where that cannot be imported. With it come templates
    and a parser for interface files: 10 MB and a tenth of a second for each process, for
    nothing. Who needs it later can still import it by its module.
    """
    if _TYPE_SUPPORT in sys.modules:
        return
    modules: dict[str, Any] = sys.modules
    modules[_GENERATOR] = None  # by which Python takes it for missing
    try:
        importlib.import_module(_TYPE_SUPPORT)
    finally:
        del modules[_GENERATOR]
