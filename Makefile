# SPDX-FileCopyrightText: 2026 the foc_ros developers
# SPDX-License-Identifier: Apache-2.0
# make setup [PYTHON=python3.12] [ROS=wheels|system]   create .venv with what demo and test need; repeated only after a change.
#                  Linters, Sphinx and the peers of the benchmark are installed by the targets that use them
# make check       lint, and the quick tests: three quarters of a minute on two cores
# make test        all tests but the long ones: three and a half minutes on two cores
# make test-long   the long studies, tests under load and the commands of the documentation
#                  test/tiers.py lists the long tests (mark `long`), and those that start another process, a ROS graph or a
#                  browser, or take more than half a second (mark `process`); make check has neither
# make lint        ruff, mypy and the import contracts
# make demo        the demo: the node and the packaged recording
# make doc         the documentation as HTML, in build/doc/index.html
# make bench       the benchmark; OPTIONS=--quick for a first look, --json, '--only NAME'
# make people      predictions of people, where their recordings are beside the checkout: doc/people.md; OPTIONS=--every 4
# make colcon      build, start, lint and test with colcon, as in a ROS workspace
# make dist        build the source distribution and the wheel in build/dist, and try the wheel in an empty environment
# make stress      a live node: ten minutes among faulty publishers, and scenes that are hard to predict in;
#                  'OPTIONS=soak --minutes 1' for a part (scripts/stress.py --help)
# make clean       remove everything that these targets have made

# a pipeline fails if any of its commands fails
SHELL := bash
.SHELLFLAGS := -o pipefail -c
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# wheels: install rclpy from the package index into .venv; system: use rclpy of the ROS installation that is sourced.
# The other targets use what setup has chosen.
ROS ?= $(if $(wildcard $(VENV)/.setup-system),system,wheels)
STAMP := $(VENV)/.setup-$(ROS)
PIP := $(BIN)/python -m pip --disable-pip-version-check --retries 10 --timeout 120
# in the form that editors and mypy follow: the path of the checkout, not an import hook
EDITABLE := --config-settings editable_mode=compat --editable
WORKERS ?= auto

export ROS_LOG_DIR := $(CURDIR)/build/ros_log
export ROS_AUTOMATIC_DISCOVERY_RANGE := LOCALHOST
# A ROS installation of the surrounding shell must not mix with the one in .venv. The loader of the wheels sets these variables itself.
ifeq ($(ROS),wheels)
EXTRAS := ros,report,play,test
export AMENT_PREFIX_PATH := $(CURDIR)/$(VENV)
unexport LD_LIBRARY_PATH _ROS_WHEELS_BOOTSTRAP_COMPLETE PYTHONPATH RMW_IMPLEMENTATION
else ifeq ($(ROS),system)
EXTRAS := report,play,test
export AMENT_PREFIX_PATH := $(CURDIR)/$(VENV):$(AMENT_PREFIX_PATH)
VENV_OPTIONS := --system-site-packages
# the pytest plugins of a ROS installation are for launch tests and do not fit this pytest
export PYTEST_DISABLE_PLUGIN_AUTOLOAD := 1
export PYTEST_ADDOPTS := -p xdist.plugin -p pytest_timeout
else
$(error ROS is wheels or system, got '$(ROS)')
endif

# why $(PYTHON) does not run
define EXPLAIN_PYTHON
case "$$(command -v $(PYTHON))" in \
'') echo 'make: there is no $(PYTHON); choose another, as in make setup PYTHON=python3.12' >&2 ;; \
*/shims/*) echo "make: $(PYTHON) is a shim of pyenv, and no active version has it; activate one that has: pyenv shell" \
    $$(pyenv whence $(notdir $(PYTHON)) 2>/dev/null | head -n 1) >&2 ;; \
*) $(PYTHON) -c '' ;; \
esac
endef
CHECK_PYTHON = $(PYTHON) -c '' 2>/dev/null || { $(EXPLAIN_PYTHON); exit 1; }

# as the commands and the node do: with small matrices, the threads of OpenBLAS keep processors busy and save no time
ONE_THREAD := OPENBLAS_NUM_THREADS=1
# tests that share something run in one worker; what is compiled for one target is there for the next
TEST = env -u PYTHONDONTWRITEBYTECODE ROS_PYTHON_CHECK_FIELDS=1 $(ONE_THREAD) $(BIN)/python -m pytest -n $(WORKERS) --maxprocesses 4 --dist loadgroup

.PHONY: setup help check quick-tests test test-long lint demo doc bench people stress colcon dist clean

setup: $(STAMP)
ifneq ($(origin PYTHON),file)
	@$(CHECK_PYTHON)
	@test "$$($(BIN)/python -V)" = "$$($(PYTHON) -V)" || { echo "make: .venv is $$($(BIN)/python -V), not $$($(PYTHON) -V): make clean first" >&2; exit 1; }
endif
	@echo 'setup: ready; next: make demo'

$(STAMP): setup.py setup.cfg pyproject.toml
	@$(CHECK_PYTHON)
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { echo "make: foc_ros needs Python 3.11 to 3.14, and $(PYTHON) is $$($(PYTHON) -V); choose another, as in make setup PYTHON=python3.12" >&2; exit 1; }
	@echo "setup: creating .venv with $$($(PYTHON) -V)"
	@test -e $@ || $(PYTHON) -m venv --clear $(VENV_OPTIONS) $(VENV) || { echo 'make: no venv in $(PYTHON); on Debian and Ubuntu: apt install python3-venv' >&2; exit 1; }
	@echo 'setup: installing foc_ros[$(EXTRAS)], some minutes'
	@$(PIP) install --progress-bar off $(EDITABLE) '.[$(EXTRAS)]' | sed -un 's/^Collecting \([^ ]*\).*/  \1/p; s/^Installing collected packages.*/  installing them, one or two minutes/p'
	@touch $@

help:
	@sed -n '/SPDX/d; s/^# //p; /^$$/q' Makefile

# mypy keeps one processor busy for as long as the tests do
check: $(VENV)/.lint
	@$(MAKE) --no-print-directory --jobs 2 --output-sync=target lint quick-tests

quick-tests: $(STAMP)
	$(TEST) -m 'not long and not process'

test: $(STAMP)
	$(TEST) -m 'not long'

test-long: $(STAMP)
	$(TEST) -m long

demo: $(STAMP)
	$(BIN)/python -m foc_ros demo

lint: $(VENV)/.lint
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports

$(VENV)/.lint: $(STAMP)
	@echo 'lint: installing the linters'
	@$(PIP) install --quiet 'foc_ros[lint]'
	@touch $@

colcon: $(STAMP)
	scripts/colcon_check

dist: $(VENV)/.dist
	PYTHON=$(BIN)/python scripts/dist_check

$(VENV)/.dist: $(STAMP)
	@echo 'dist: installing build and twine'
	@$(PIP) install --quiet 'foc_ros[dist]'
	@touch $@

stress: $(STAMP)
	$(if $(OPTIONS),$(BIN)/python scripts/stress.py $(OPTIONS),for part in soak hostile; do $(BIN)/python scripts/stress.py $$part || exit; done)

# a warning of Sphinx, such as a link to a page that does not exist, is a failure
doc: $(VENV)/.doc
	$(ONE_THREAD) $(BIN)/python -m sphinx --builder html --fail-on-warning --keep-going --quiet --fresh-env doc build/doc

$(VENV)/.doc: $(STAMP)
	@echo 'doc: installing Sphinx'
	@$(PIP) install --quiet 'foc_ros[doc]'
	touch $@

# the peers are large and are installed only for this
bench: $(VENV)/.bench
	$(BIN)/python benchmarks/run.py $(OPTIONS)

$(VENV)/.bench: $(STAMP)
	@echo 'bench: installing the peers'
	@$(PIP) install --quiet 'foc_ros[bench]'
	touch $@

people: $(STAMP)
	$(BIN)/python scripts/people.py $(OPTIONS)

clean:
	rm -rf doc/auto_examples doc/sg_execution_times.rst
	rm -rf $(VENV) build dist install log demo_output paper_output *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
