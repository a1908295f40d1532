# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
#
# Every target makes what it needs of the environment first (tools/README.md says how).

# with a name, .venv is made from that interpreter: make PYTHON=python3.12 build
PYTHON ?=
# seconds; of motion in demo, of walking in demo-quad (at least 6), of whole rounds in demo-arm and demo-plan (at least one);
# without it a demo runs until Ctrl-C, chaos for 10 minutes, soak for an hour
DURATION ?=
# a robot of arm_bringup, or the path of a robot folder
ROBOT ?= panda
# 1: demos without the page on which the robot is seen
NO_VIEW ?=
export NO_VIEW
# compilers at the same time; without it one a core, and one for each GiB of memory at most
JOBS ?=
# of the training
MINUTES ?= 30
# what pytest gets besides: make test ARGS='-k sync -x'; one after another: ARGS=-n0
ARGS ?=

WORKSPACE = cd tools && $(or $(PYTHON),python3) -m workspace $(if $(PYTHON),--python $(PYTHON))
BUILD = $(WORKSPACE) build $(if $(JOBS),--jobs $(JOBS))
IN_ENVIRONMENT = bash -c '. "$(CURDIR)/env.sh" && exec "$$@"' environment
# some containers set PYTHONDONTWRITEBYTECODE: every worker and process would compile all that it imports
PYTEST = $(IN_ENVIRONMENT) env -u PYTHONDONTWRITEBYTECODE python -m pytest -n auto --dist loadgroup

.PHONY: help demo demo-arm demo-plan demo-quad test check build lint docs pictures bench findings train chaos soak setup pins clean distclean
.DEFAULT_GOAL := help

help:
	@echo 'make demo       watch a simulated arm move (DURATION=20: for 20 s, ROBOT=prbt is another arm, NO_VIEW=1 opens no page)'
	@echo 'make demo-arm   jog it and send it trajectories, with what was measured (ROBOT=gp110, DURATION=60: rounds within 60 s, one of 25 s to 40 s at least)'
	@echo 'make demo-plan  have it pick and place among obstacles, with move_group (ROBOT=prbt, DURATION=60: rounds within 60 s, one of about 30 s at least)'
	@echo 'make demo-quad  watch a simulated quadruped walk (DURATION=20: for 20 s, at least 6)'
	@echo 'make test       build everything and run all tests'
	@echo 'make check      lint, types, and the tests that take no time: between two edits'
	@echo 'make build      build every package; then: source env.sh'
	@echo 'make lint       ruff, its formatter, mypy, who imports whom, dead code, spelling, containers, manual'
	@echo 'make docs       build the manual as a site in build/site, to be read without a network'
	@echo 'make pictures   take the pictures of the README anew (Chromium)'
	@echo 'make bench      print the figures'
	@echo 'make findings   see whether the surprises of other software are as we found them (installs each anew; minutes)'
	@echo 'make train      train a policy that walks, check it and compare it (MINUTES=30, SEED=1)'
	@echo 'make chaos      disturb arm and quadruped in motion at random (DURATION=600, SEED=1)'
	@echo 'make soak       run both for long, and check that nothing is lost or grows (DURATION=3600)'
	@echo 'make setup      make the environment only'
	@echo 'make pins       renew the pinned requirements'
	@echo 'make clean      remove what was built'
	@echo 'make distclean  remove the environment too'

demo: system
	@$(BUILD) arm_bringup
	@$(IN_ENVIRONMENT) ros2 run arm_bringup demo $(ROBOT) $(if $(DURATION),--duration $(DURATION))

demo-quad: system
	@$(BUILD) quad_bringup
	@$(IN_ENVIRONMENT) ros2 run quad_bringup demo $(if $(DURATION),--duration $(DURATION))

demo-arm: system
	@$(BUILD) arm_bringup arm_servo
	@$(IN_ENVIRONMENT) ros2 run arm_bringup motion_demo $(ROBOT) $(if $(DURATION),--duration $(DURATION))

demo-plan: system
	@$(BUILD) arm_bringup arm_servo arm_planning
	@$(IN_ENVIRONMENT) ros2 run arm_bringup plan_demo $(ROBOT) $(if $(DURATION),--duration $(DURATION))

test: system
	@$(BUILD) --dev
	@$(PYTEST) $(ARGS)

check: lint
	@$(BUILD) --dev
	@$(PYTEST) -q -m 'not scenario and not slow' $(ARGS)

build: system
	@$(BUILD)

lint: system
	@$(WORKSPACE) lint

docs: system
	@$(WORKSPACE) docs

pictures: system
	@$(BUILD) --dev
	@$(IN_ENVIRONMENT) python tests/pictures.py

bench: system
	@$(BUILD) --dev
	@$(IN_ENVIRONMENT) tools/bench

findings:
	@tools/findings

train: system
	@$(BUILD) --with training quad_controller
	@$(IN_ENVIRONMENT) nice python quad_controller/training/train.py --minutes $(MINUTES) \
	  $(if $(SEED),--seed $(SEED))

chaos: system
	@$(BUILD) --dev
	@$(IN_ENVIRONMENT) python tests/chaos.py \
	  $(if $(DURATION),--duration $(DURATION)) $(if $(SEED),--seed $(SEED))

soak: system
	@$(BUILD) --dev
	@$(IN_ENVIRONMENT) python tests/soak.py $(if $(DURATION),--duration $(DURATION))

setup: system
	@$(WORKSPACE) setup

pins: system
	@$(WORKSPACE) pins

clean:
	rm -rf build install log */build libraries/*/build */*.egg-info libraries/*/*.egg-info .mypy_cache .pytest_cache .ruff_cache .hypothesis

distclean: clean
	rm -rf .venv .workspace.lock

# all that can be said before there is a Python to say more
.PHONY: system
system:
	@command -v $(or $(PYTHON),python3) >/dev/null || { \
	  echo 'error: there is no $(or $(PYTHON),python3). Install with:' >&2; \
	  echo '    sudo apt-get install python3 python3-venv python3-dev g++ git' >&2; exit 1; }
