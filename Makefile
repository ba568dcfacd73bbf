# make compare: from a map to a fair comparison.  make test: all tests but the slow ones, with fewer random examples.
# make check: all that has to pass.  make fuzz: property-based tests on new random examples.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/installed
# a file's tests run in one process, so that kernels are compiled once and fixtures are made once
WORKERS ?= 2
PYTEST := $(BIN)/python -m pytest --numprocesses $(WORKERS) --dist loadfile --quiet
export NUMBA_CACHE_DIR := $(CURDIR)/$(VENV)/kernels
# tests start hundreds of processes: what Python has compiled is kept, whatever the environment says
export PYTHONDONTWRITEBYTECODE :=

.PHONY: compare test fuzz lint check suite bounds docs bench claims conformance clean

compare: $(INSTALLED)
	$(BIN)/cgla compare --out results --overwrite

test: $(INSTALLED)
	CGLA_EXAMPLES=0.25 $(PYTEST) -m "not slow" --ignore=tests/benchmarks

# every run draws other examples, twenty times as many; a failure prints the example and the line that brings it back.
# make fuzz TESTS=tests/model/test_risk.py: only those
TESTS ?=
fuzz: $(INSTALLED)
	CGLA_FUZZ=1 $(PYTEST) -m hypothesis $(TESTS)

lint: $(INSTALLED)
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy

check: lint suite bounds

suite: $(INSTALLED)
	$(PYTEST) $(addprefix --ignore=,$(OF_KERNELS))

# tests of kernels, which also have to read and write inside their arrays: once, with that checked, compiled in a hurry
OF_KERNELS := tests/model/test_risk.py tests/model/test_risk_raster.py tests/model/test_no_fly.py tests/model/test_graph.py \
	tests/cost_to_go/test_cost_matrix.py tests/eikonal/test_mesh.py tests/eikonal/test_marching_kernels.py \
	tests/eikonal/test_queue_kernels.py \
	tests/certificate/test_certificate_kernels.py tests/certificate/test_tips.py tests/certificate/test_corners.py \
	tests/cost_to_go/test_repair.py \
	tests/fusion/test_fusion.py tests/motion/test_trajectory.py tests/motion/test_space_time.py \
	tests/turning/test_curve.py tests/solvers/continuous/test_roadmap_kernels.py
bounds: $(INSTALLED)
	NUMBA_BOUNDSCHECK=1 NUMBA_OPT=1 NUMBA_CACHE_DIR=$(NUMBA_CACHE_DIR)-checked $(PYTEST) $(OF_KERNELS)

# the site, in build/docs; warnings are errors. The second time, what has not changed is not made again
docs: $(VENV)/installed-docs
	$(BIN)/python -m sphinx --fail-on-warning --keep-going --nitpicky --quiet --jobs 2 \
		--doctree-dir build/doctrees docs build/docs

# ours against peers; then the tree against an older commit. make bench OLD=…: against another one
OLD ?= 422fc1b
bench: $(INSTALLED)
	$(BIN)/python -m pytest tests/benchmarks --benchmark-only --benchmark-columns=min,median,rounds -s
	$(BIN)/python tests/benchmarks/old_and_new.py $(OLD)

# an hour: every claim of the paper in full, and quickly on three other samples; then the verdicts that are shipped and the
# manual's table of them. Seed 1 is left out: some settings of experiments were chosen on its maps
claims: $(INSTALLED)
	$(BIN)/cgla claims --seed 2 --out results/claims --overwrite
	for seed in 3 4 5; do $(BIN)/cgla claims --quick --seed $$seed --json > results/claims/quick-$$seed.json || exit; done
	$(BIN)/python -m cgla_graph.comparisons.claims.summary results/claims/claims.json docs/claims.md results/claims/quick-*.json

# minutes: the instances of the conformance suite, with what is proven of them
conformance: $(INSTALLED)
	$(BIN)/python -m cgla_graph.comparisons.conformance.make comparisons/conformance/instances.json

$(INSTALLED): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit("Python 3.11 or newer is needed: make PYTHON=…" if sys.version_info < (3, 11) else 0)'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --editable '.[dev]'
	touch $@

$(VENV)/installed-docs: $(INSTALLED)
	$(BIN)/python -m pip install --quiet --editable '.[docs]'
	touch $@

clean:
	rm -rf $(VENV) build docs/generated dist results *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis .benchmarks
