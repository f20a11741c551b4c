# make run | test | test-all | check | bench. The first command makes the virtual environment; later ones use it.
PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
READY := $(VENV)/.ready
ROLES := robot world dashboard
WORKERS := $(shell echo $$((2 * $$(getconf _NPROCESSORS_ONLN))))  # tests with processes mostly wait
PYTEST := $(BIN)/python -m pytest -q -n $(WORKERS) --dist worksteal

# every process of a fleet would compile every module anew
unexport PYTHONDONTWRITEBYTECODE

.DEFAULT_GOAL := help
.PHONY: help setup run test test-all check check-costs format bench docs release images mutants lock clean

help:  ## list these commands
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed -E 's/:.*## /\t/' | expand -t 10

setup: $(READY)  ## make the virtual environment (once)

$(READY): pyproject.toml requirements.lock
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11) and "zenoh-swarm needs Python 3.11 or newer: make PYTHON=python3.11 ...")'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --editable .
	@$(BIN)/python -m swarm.kernels
	@touch $@

run: $(READY)  ## run the paper's mission with four robots and show it in Rerun
	$(BIN)/swarm run paper --robots 4 --record paper.rrd

test: $(READY)  ## run the tests, whole missions over processes included: minutes
	$(PYTEST) -m "not long"

test-all: test  ## run the long tests too, and every law with more examples
	$(PYTEST) -m "long or hypothesis" --hypothesis-profile all

check-costs: $(READY)  ## run the tests of `make test` and list those that take most processor time
	$(PYTEST) -m "not long" --costs

check: $(READY)  ## run lint, types and the quick tests
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/mypy
	$(BIN)/python -m pytest -q -n auto -m "not processes and not long"

format: $(READY)  ## format the code
	$(BIN)/ruff check --fix .
	$(BIN)/ruff format .

docs: $(READY)  ## build the docs as a site in build/site
	NO_MKDOCS_2_WARNING=1 $(BIN)/mkdocs build --strict --quiet
	@echo "open build/site/index.html"

bench: $(READY)  ## measure every number of docs/benchmarks.md
	$(BIN)/python -m benchmarks

release: $(READY)  ## build the wheel, the site, the images and their checksums in build/release; VERSION=0.2.0 names them first
	$(BIN)/python deploy/release.py $(VERSION) $(if $(HOME_URL),--home $(HOME_URL))

# buildah's own format has no health checks
images: export BUILDAH_FORMAT := docker
images:  ## build the images of robot, world and dashboard, with docker or buildah; BASE=IMAGE, ROLES="robot world", BUILD=FLAGS
	@engine=$$(docker info > /dev/null 2>&1 && echo docker || command -v buildah) || { echo "make images needs docker or buildah" >&2; exit 1; }; \
	version=$$(sed -n 's/^version = "\(.*\)"$$/\1/p' pyproject.toml); \
	for role in $(ROLES); do \
		$$engine build --target $$role --tag zenoh-swarm-$$role $(if $(BASE),--build-arg BASE=$(BASE)) --build-arg VERSION=$$version $(BUILD) . || exit 1; \
	done

mutants: $(READY)  ## change the code of claims and joint plans a little, and list the changes that no test notices: half an hour
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-build-isolation --constraint requirements.lock --editable '.[mutants]'
	$(BIN)/mutmut run
	$(BIN)/mutmut results

lock:  ## pin the newest versions in requirements.lock (commit the result)
	$(PYTHON) -m venv $(VENV)-lock
	$(VENV)-lock/bin/python -m pip install --quiet --editable '.[dev]'
	$(VENV)-lock/bin/python -m pip freeze --all --exclude pip --exclude-editable > requirements.lock
	rm -rf $(VENV)-lock

clean:  ## remove the environment and caches
	rm -rf $(VENV) $(VENV)-* .mypy_cache .ruff_cache .pytest_cache .hypothesis build mutants *.egg-info
