# Everything that a fresh clone needs; each target makes what it stands on.
# The first Python on the path that Lariat runs on.
fits = import sys; sys.exit(not (3, 11) <= sys.version_info[:2] < (3, 15))
ifeq ($(origin PYTHON),undefined)
PYTHON := $(shell for p in python3.11 python3.12 python3.13 python3.14 python3; do \
  $$p -c '$(fits)' 2>/dev/null && command -v $$p && break; done)
endif
BIN := .venv/bin
TOOLS := .venv-tools/bin
SCENARIO ?= scenarios/three-cylinders.toml

# Installs a Debian package where what it gives is missing and this user may; else says which it is.
system = $(or $(PYTHON),uv run --no-project --python 3.13 python) -c $(1) 2>/dev/null || { [ "$$(id -u)" = 0 ] && command -v apt-get >/dev/null && \
  echo "Installing the system package $(2)" && apt-get update -qq && \
  apt-get install -y -qq --no-install-recommends $(2) >/dev/null; } || \
  { echo "the system package $(2) is missing; install it (Debian: apt-get install $(2)), then make again" >&2; exit 2; }

.PHONY: up test ros check docs format lock sbom clean

up: .venv/installed  ## the whole stack, live; opens the dashboard, or prints its address last
	$(BIN)/lariat up $(SCENARIO) --browser

# Tests start hundreds of processes, which would compile every module again.
test: export PYTHONDONTWRITEBYTECODE =
test: .venv/installed-dev  ## in parallel the tests that compute, one by one those of pages and those that are live
	$(BIN)/pytest -m "not live and not slow and not ros" --numprocesses auto --dist loadfile --ignore tests/browser
	$(BIN)/pytest -m "not live and not slow" tests/browser
	$(BIN)/pytest -m "live and not slow and not ros"

ros: .venv/installed-dev .ros/rclpy .ros/pyzeros  ## the tests against real rclpy and another implementation of ROS 2's wire
	$(BIN)/pytest -m ros

.ros/rclpy:
	$(BIN)/python -m venv $@
	$@/bin/pip install --quiet numpy ros-rclpy==9.1.2 ros-rmw-fastrtps-cpp ros-sensor-msgs ros-trajectory-msgs \
	  ros-visualization-msgs ros-std-srvs ros-test-msgs ros-diagnostic-msgs

.ros/pyzeros:
	$(BIN)/python -m venv $@
	$@/bin/pip install --quiet pyzeros==0.1.0

check: .venv/installed-dev  ## style, types, import rules
	$(BIN)/ruff format --check .
	$(BIN)/ruff check .
	$(BIN)/pyright --threads
	$(BIN)/lint-imports

docs: .venv/installed-dev  ## the documentation as a site, site/index.html; a warning is an error
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --quiet

format: .venv/installed-dev
	$(BIN)/ruff format .
	$(BIN)/ruff check --fix .

clean:
	rm -rf .venv .venv-tools

.venv/bin/python:
ifeq ($(PYTHON),)
	@command -v uv >/dev/null || { echo "Lariat needs Python 3.11 to 3.14, and there is none on the path: \
	install one (Debian: apt-get install python3 python3-venv) or uv, or set PYTHON=/path/to/python3.11" >&2; exit 2; }
else
	@$(PYTHON) -c '$(fits)' || { echo "Lariat needs Python 3.11 to 3.14, $(PYTHON) is another one; \
	set PYTHON=/path/to/python3.11" >&2; exit 2; }
	@$(call system,'import ensurepip',python3-venv)
endif
	@$(call system,'import ctypes; ctypes.CDLL("libX11.so.6")',libx11-6)
	@$(call system,'import ctypes; ctypes.CDLL("libgomp.so.1")',libgomp1)
	$(if $(PYTHON),$(PYTHON) -m venv,uv venv --seed --python 3.13) .venv

# Installs a lock by its hashes, then the clone without asking anybody for more, then PyTorch, whose
# build is the user's choice: one that is installed already stays. A lock names all that it needs but
# PyTorch, so that nothing is resolved.
install = $(BIN)/python -m pip install --quiet --require-hashes --no-deps --requirement requirements/$(1).txt && \
  $(BIN)/python -m pip install --quiet --no-deps --no-build-isolation --editable . && \
  $(BIN)/python -m pip install --quiet --editable '.[torch]' --no-build-isolation && \
  $(BIN)/python requirements/kernels.py

.venv/installed: requirements/all.txt | .venv/bin/python
	@echo "Installing Lariat and what it needs into .venv; the first time takes some minutes"
	@$(call install,all)
	@touch $@

.venv/installed-dev: requirements/dev.txt | .venv/bin/python
	@echo "Installing Lariat, what it needs and its tests' tools into .venv; the first time takes some minutes"
	@$(call install,dev)
	@touch $@ .venv/installed

# Tools of their own, so that the bill names what Lariat needs and nothing else.
$(TOOLS)/cyclonedx-py: | .venv/bin/python
	$(BIN)/python -m venv .venv-tools
	$(TOOLS)/python -m pip install --quiet uv cyclonedx-bom

lock: $(TOOLS)/cyclonedx-py  ## locks every dependency by version and hash
	$(TOOLS)/python requirements/lock.py

sbom: .venv/installed $(TOOLS)/cyclonedx-py  ## software bill of materials of what is installed, with licences
	$(TOOLS)/cyclonedx-py environment --output-format JSON --output-file lariat.cdx.json $(BIN)/python
