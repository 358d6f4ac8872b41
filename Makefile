# make setup [PYTHON=python3.12] [ROS=wheels|system]   a .venv with everything; re-run only when needed
# make demo | test | lint | doc | bench | pages | clean
# make colcon | fuzz | soak | stops   the long checks: colcon build and test, many messages, ten minutes of faults, 200 signals

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
# wheels: rclpy from the package index into .venv; system: the rclpy of the ROS installation that is sourced.
# What setup chose holds for the other targets.
ROS ?= $(if $(wildcard $(VENV)/.setup-system),system,wheels)
STAMP := $(VENV)/.setup-$(ROS)
PIP := $(BIN)/python -m pip --disable-pip-version-check --retries 10 --timeout 120
WORKERS ?= auto

export ROS_LOG_DIR := $(CURDIR)/build/ros_log
export ROS_AUTOMATIC_DISCOVERY_RANGE := LOCALHOST
# A ROS in the surrounding shell must not mix with the one in .venv; the wheels' own loader sets these anew for every process.
ifeq ($(ROS),wheels)
EXTRAS := ros,report,test
export AMENT_PREFIX_PATH := $(CURDIR)/$(VENV)
unexport LD_LIBRARY_PATH _ROS_WHEELS_BOOTSTRAP_COMPLETE PYTHONPATH RMW_IMPLEMENTATION
else ifeq ($(ROS),system)
EXTRAS := report,test
export AMENT_PREFIX_PATH := $(CURDIR)/$(VENV):$(AMENT_PREFIX_PATH)
VENV_OPTIONS := --system-site-packages
# the pytest plugins of a ROS installation are for launch tests, and older than our pytest
export PYTEST_DISABLE_PLUGIN_AUTOLOAD := 1
export PYTEST_ADDOPTS := -p xdist.plugin -p pytest_timeout
else
$(error ROS is wheels or system, got '$(ROS)')
endif

.PHONY: setup demo test lint doc bench pages colcon fuzz soak stops clean

setup: $(STAMP)
ifneq ($(origin PYTHON),file)
	@test "$$($(BIN)/python -V)" = "$$($(PYTHON) -V)" || { echo "make: .venv is $$($(BIN)/python -V), not $$($(PYTHON) -V): make clean first" >&2; exit 1; }
endif

$(STAMP): setup.py setup.cfg pyproject.toml
	@test -e $@ || $(PYTHON) -m venv --clear $(VENV_OPTIONS) $(VENV) || { echo 'make: no venv in $(PYTHON); on Debian and Ubuntu: apt install python3-venv' >&2; exit 1; }
	$(PIP) install --quiet --editable '.[$(EXTRAS)]'
	$(BIN)/python -c 'import foc_ros.core.pipeline'  # compiles the solver's kernels, which takes some seconds once
	touch $@

demo: $(STAMP)
	$(BIN)/python -m foc_ros demo

test: $(STAMP)
	ROS_PYTHON_CHECK_FIELDS=1 $(BIN)/python -m pytest -n $(WORKERS) --maxprocesses 4

lint: $(STAMP)
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports

colcon:
	PYTHON=$(PYTHON) scripts/colcon_check

fuzz: $(STAMP)
	FOC_ROS_FUZZ=100000 ROS_PYTHON_CHECK_FIELDS=1 $(BIN)/python -m pytest -n $(WORKERS) --maxprocesses 4 --timeout 3600 test/test_fuzz.py

soak: $(STAMP)
	$(BIN)/python scripts/soak.py --minutes 10

stops: $(STAMP)
	$(BIN)/python scripts/stops.py --count 100

# build/doc/index.html; what Sphinx warns of, such as a link that leads nowhere, fails
doc: $(VENV)/.doc
	$(BIN)/python -m sphinx --builder html --fail-on-warning --keep-going --quiet --fresh-env doc build/doc

$(VENV)/.doc: $(STAMP)
	$(PIP) install --quiet --editable '.[doc]'
	touch $@

# What it compares with is large, and installed only for this. OPTIONS=--quick for a look, --json, --markdown, '--only NAME'
bench: $(VENV)/.bench
	$(BIN)/python benchmarks/run.py $(OPTIONS)

$(VENV)/.bench: $(STAMP)
	$(PIP) install --quiet --editable '.[bench]'
	touch $@

# What is derived from foc_ros/foc/config.py
pages: $(STAMP)
	$(BIN)/python -m foc_ros.ros.parameters > config/foc.yaml
	$(BIN)/python scripts/make_parameter_page.py

clean:
	rm -rf $(VENV) build dist install log demo_output paper_output *.egg-info .mypy_cache .ruff_cache .pytest_cache .hypothesis .import_linter_cache
	find . -name __pycache__ -type d -prune -exec rm -rf {} +
