# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# source env.sh    in bash or zsh, from any folder: `ros2` and every node of the workspace work.

if [ -n "${ZSH_VERSION:-}" ]; then
  _workspace_shell=zsh
  eval '_workspace_root=${${(%):-%x}:A:h}'
else
  _workspace_shell=bash
  _workspace_root=$(cd -- "$(dirname -- "${BASH_SOURCE[0]}")" && pwd -P)
fi

_workspace_source() {
  # scripts of ROS and colcon read variables that are not set
  case $- in
    *u*) set +u; . "$1"; set -u ;;
    *) . "$1" ;;
  esac
}

if [ -f "$_workspace_root/.venv/.workspace.json" ]; then
  _workspace_source "$_workspace_root/.venv/local_setup.$_workspace_shell"
  if [ -f "$_workspace_root/install/local_setup.$_workspace_shell" ]; then
    _workspace_source "$_workspace_root/install/local_setup.$_workspace_shell"
  fi
  # DDS stays on this host, or is opened as DDS_NETWORK says (libraries/ros_runtime/README.md)
  _workspace_dds=$("$_workspace_root/.venv/bin/python" -I -S -c '
import sys
sys.path.insert(0, sys.argv[1])
from dds_network.shell import main
sys.exit(main())' "$_workspace_root/libraries/ros_runtime") && _workspace_status=0 || _workspace_status=1
  eval "$_workspace_dds"
  unset _workspace_dds
else
  echo "env.sh: there is no finished environment yet; run: make -C $_workspace_root build" >&2
  _workspace_status=1
fi
unset -f _workspace_source
unset _workspace_root _workspace_shell
# the last command is the status of `source`
eval "unset _workspace_status; [ $_workspace_status = 0 ]"
