# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_controller attach_contract``: embeds a policy's contract in its ONNX file."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path
import sys

from quad_description import run_command

from .exceptions import PolicyError, QuadControllerError
from .policy.check import scale_rows
from .policy.contract.build import build_contract
from .policy.contract.document import ContractDocument, setting
from .policy.contract.mjlab import CONTRACT_KEY, read_metadata
from .policy.load import find_policy, read_contract_file, SHIPPED
from .policy.network import OnnxNetwork, read_model, SIDES_KEY, with_metadata
from .policy.options import table_text


def run(arguments: Sequence[str]) -> int:
    """Embed a contract; return 0 if it is complete."""
    options = _parser().parse_args(arguments)
    try:
        model = find_policy(options.model)
        document = _document(model, options.file, options.set)
        rows = [('contract', 'value', 'from'), *document.rows()]
        sys.stdout.write(f'{table_text(rows, widest=60)}\n')
        for row in scale_rows(build_contract(document), document):
            sys.stdout.write(f'{row.verdict.value}: {row.subject} {row.found}\n')
        if options.dry_run:
            return 0
        target = options.output or model
        if target.parent == SHIPPED:
            raise PolicyError(f'{model.name} is shipped: write another file (--output)')
        _write(model, target, document)
        written = read_model(target)
    except (QuadControllerError, OSError) as error:
        sys.stdout.write(f'{error}\n')
        return 1
    of = f' (with {", ".join(written.sides)})' if written.sides else ''
    sys.stdout.write(f'{target} has its contract, sha256 {written.digest}{of}\n')
    return 0


def main() -> None:
    """Entry point."""
    run_command(run)


def _document(model: Path, files: Sequence[Path], settings: Sequence[str]) -> ContractDocument:
    """Merge the sources; settings override files, later files earlier ones, files the model."""
    document = read_metadata(OnnxNetwork(model, new_weights=True).metadata)
    top = ContractDocument({})
    for text in settings:
        top = setting(text).over(top)
    # patterns of some files are matched with the joints, wherever those stand
    joints = top.values.get('joints') or document.values.get('joints') or ()
    for path in files:
        document = read_contract_file(path, joints).over(document)
        joints = joints or document.values.get('joints') or ()
    return top.over(document)


def _write(model: Path, target: Path, document: ContractDocument) -> None:
    """Write the model with its contract, atomically."""
    read = read_model(model)
    data = with_metadata(read.data, CONTRACT_KEY, document.to_yaml())
    if read.sides:
        # exports that were renamed may share the name of their side file
        data = with_metadata(data, SIDES_KEY, read.sides_digest)
    if read.sides and target.resolve().parent != model.resolve().parent:
        names = ', '.join(read.sides)
        raise PolicyError(f'the weights of {model} lie in {names}: write --output beside them')
    part = target.with_name(f'{target.name}.part')
    part.write_bytes(data)
    part.replace(target)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(
        description='Write the contract of a policy into its ONNX file: what it observes, in what '
        'order, frames and scales. Later files count before earlier ones, --set before all.',
        allow_abbrev=False,
    )
    parser.add_argument('model', help='ONNX file, or the name of one that is shipped')
    parser.add_argument(
        'file',
        type=Path,
        nargs='*',
        help='our YAML; deploy.yaml or env.yaml of Isaac Lab; config.yaml and base.yaml of '
        'rl_sar; config.json of MuJoCo Playground',
    )
    parser.add_argument(
        '--set',
        action='append',
        default=[],
        metavar='KEY=VALUE',
        help='such as observation.terms.gyro.frame=base; the value is YAML',
    )
    parser.add_argument('--output', type=Path, help='write another file, not the model itself')
    parser.add_argument(
        '--dry-run', action='store_true', help='print what there is, write nothing'
    )
    return parser


if __name__ == '__main__':
    main()
