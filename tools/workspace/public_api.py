# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A contract of import-linter: packages import only the public modules of others."""

from __future__ import annotations

from typing import cast

from grimp import ImportGraph
from importlinter import Contract, ContractCheck, fields, output


class PublicApiContract(Contract):
    """Other packages may import only a package itself and its families.

    Attributes:
        families: Further public modules of packages; with ``.*`` all modules in them.
    """

    families = fields.SetField(subfield=fields.StringField())

    def check(self, graph: ImportGraph, verbose: bool) -> ContractCheck:
        """Check every import of another package."""
        families = cast('set[str]', self.families)
        gone = sorted({name.removesuffix('.*') for name in families} - graph.modules)

        def is_offered(module: str) -> bool:
            parent = module.rpartition('.')[0]
            return '.' not in module or module in families or f'{parent}.*' in families

        borders = [
            f'{importer} imports {imported}'
            for importer in sorted(graph.modules)
            for imported in sorted(graph.find_modules_directly_imported_by(importer))
            if imported.partition('.')[0] != importer.partition('.')[0]
            and not is_offered(imported)
        ]
        problems = [*borders, *(f'there is no module {name} any more' for name in gone)]
        return ContractCheck(kept=not problems, metadata={'problems': problems})

    def render_broken_contract(self, check: ContractCheck) -> None:
        """Print the forbidden imports."""
        for problem in check.metadata['problems']:
            output.print_error(problem)
