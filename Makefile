# make compare: from a map to a fair comparison.  make test: all tests but the slow ones, with fewer random examples,
# without those of costly checks that have passed with the same sources (TESTED=: with them).
# make check: all that has to pass.  make fuzz: property-based tests on new random examples.
PYTHON ?= python3
VENV ?= .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/installed
# a file's tests run in one process, so that kernels are compiled once and fixtures are made once; a process that dies,
# or hangs in a test (pyproject.toml), ends the run
WORKERS ?= 2
PYTEST := $(BIN)/python -m pytest --numprocesses $(WORKERS) --dist loadfile --max-worker-restart 0 --quiet
export NUMBA_CACHE_DIR := $(CURDIR)/$(VENV)/kernels
# tests start hundreds of processes: what Python has compiled is kept, whatever the environment says
export PYTHONDONTWRITEBYTECODE :=
# workers share the cores: on small matrices, threads of linear algebra would mostly wait for each other, and busily
export OPENBLAS_NUM_THREADS := 1

.PHONY: compare test theorem-1 fuzz lint check checks suite bounds browser paper proofs comparison digests oldest solvers manual figures docs bench peers claims conformance clean

compare: $(INSTALLED)
	$(BIN)/cgla compare --out results --overwrite

TESTED ?= browser paper proofs solvers manual
test: $(INSTALLED)
	CGLA_EXAMPLES=0.25 $(PYTEST) -m "not slow" --ignore=tests/benchmarks $$($(BIN)/python tests/support/digests.py --due $(TESTED))

# the property-based tests of Lemma 1 and Theorem 1 alone, half a minute
theorem-1: $(INSTALLED)
	$(PYTEST) tests/theorem_1

# every run draws other examples, twenty times as many; a failure prints the example and the line that brings it back.
# make fuzz TESTS=tests/model/test_risk.py: only those
TESTS ?=
fuzz: $(INSTALLED)
	CGLA_FUZZ=1 $(PYTEST) -m hypothesis $(TESTS)

lint: $(INSTALLED)
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports --no-cache

check: lint checks
checks: suite bounds browser paper proofs solvers manual

# all tests but those of the next targets
suite: $(INSTALLED)
	$(PYTEST) $$($(BIN)/python tests/support/digests.py --others browser paper proofs solvers manual)

# costly checks, which `make test` and CI leave out where nothing that they look at has changed (tests/support/digests.py): tests of
# kernels with accesses to arrays checked, tests that drive a browser, tests of the paper's claims, of proofs in the plane
# and of solvers, the blocks of the manual, and `make compare`
bounds browser paper proofs solvers manual comparison: $(INSTALLED)
	$(BIN)/python tests/support/digests.py $@

# runs them all, and writes the digests of what has passed into tests/digests: commit those
digests: $(INSTALLED)
	CGLA_NEEDS_BROWSER=1 CGLA_DIGESTS=write $(BIN)/python tests/support/digests.py bounds browser paper proofs solvers manual comparison

# the main paths with the lowest versions that pyproject.toml allows, and with current ones on a newer Python if it is there
OLDEST ?= python3.11
NEWEST ?= python3.13
OF_VERSIONS := -m "not slow" -o filterwarnings=ignore::DeprecationWarning --quiet --numprocesses $(WORKERS) --dist loadfile \
	tests/model tests/cost_to_go tests/certificate/test_certificate.py tests/mission tests/networkx_backend tests/scenarios \
	tests/solvers/test_solver_contract.py tests/comparisons/study tests/comparisons/plots tests/comparisons/cli
IN_VERSIONS := CGLA_EXAMPLES=0.1 NUMBA_CACHE_DIR=
EXTRAS := distributed,geo,graphs,parquet,skimage
OF_TESTS := build hypothesis packaging pytest pytest-benchmark pytest-xdist 'setuptools>=77'
oldest: pyproject.toml
	$(OLDEST) -m venv .venv-oldest
	.venv-oldest/bin/python -m pip install --quiet $(OF_TESTS)
	.venv-oldest/bin/python tests/support/oldest_versions.py $(EXTRAS) > .venv-oldest/pins.txt
	.venv-oldest/bin/python -m pip install --quiet --constraint .venv-oldest/pins.txt --no-build-isolation --editable '.[$(EXTRAS)]'
	$(IN_VERSIONS)$(CURDIR)/.venv-oldest/kernels .venv-oldest/bin/python -m pytest $(OF_VERSIONS)
	if $(NEWEST) -c '' 2>/dev/null; then $(NEWEST) -m venv .venv-newest && \
		.venv-newest/bin/python -m pip install --quiet $(OF_TESTS) --editable '.[distributed]' && \
		$(IN_VERSIONS)$(CURDIR)/.venv-newest/kernels .venv-newest/bin/python -m pytest $(OF_VERSIONS); fi

# the pictures of the manual; make figures FIGURES=bracket: only that one
FIGURES ?=
figures: $(INSTALLED)
	$(BIN)/python docs/_extensions/manual_figures.py $(FIGURES)

# the site, in build/docs; warnings are errors. The second time, what has not changed is not made again
docs: $(VENV)/installed-docs
	$(BIN)/python -m sphinx --fail-on-warning --keep-going --nitpicky --quiet --jobs 2 \
		--doctree-dir build/doctrees docs build/docs

# ours against peers, where a missed target is told and the rest goes on; then the tree against an older commit.
# make bench OLD=…: against another one
OLD ?= 9fcc6a22
bench: $(INSTALLED)
	-$(BIN)/python -m pytest tests/benchmarks --benchmark-only --benchmark-columns=min,median,rounds -s -o faulthandler_timeout=0
	$(BIN)/python tests/benchmarks/old_and_new.py $(OLD)
	$(BIN)/python tests/benchmarks/peers.py --each 1 --seconds 1 --out results/peers-few.json

# planners of other libraries against ours on 40 maps, half an hour of CPU time; then the manual's tables of them. OMPL where it
# is installed for C++ (Debian: libompl-dev, pkg-config). make peers PEERS='--seconds 20 --workers 2': other limits
PEERS ?=
peers: $(INSTALLED)
	$(BIN)/python -m pip install --quiet scikit-fmm eikonalfm pykonal
	mkdir -p build && sh examples/conformance/build_ompl.sh build || true
	$(BIN)/python tests/benchmarks/peers.py --page docs/conformance.md $(PEERS)

# 90 minutes on two cores, and 3 for each quick study: every claim of the paper in full, and quickly on three other samples; then
# the answers that are shipped, the manual's page of them and the README's part. `--resume` goes on with a study that was broken
claims: $(INSTALLED)
	$(BIN)/cgla claims --seed 2 --out results/claims --overwrite
	for seed in 3 4 5; do $(BIN)/cgla claims --quick --seed $$seed --json > results/claims/quick-$$seed.json || exit; done
	$(BIN)/python -m cgla_graph.comparisons.claims.summary results/claims/claims.json docs/claims.md README.md \
		results/claims/quick-*.json

# minutes: the instances of the conformance suite, with what is proven of them; and proof files of that
conformance: $(INSTALLED)
	$(BIN)/python -m cgla_graph.comparisons.conformance.make comparisons/conformance/instances.json
	$(BIN)/python -m cgla_graph.comparisons.conformance.proof_files comparisons/conformance

# make INSTALL=dev,docs: with what the site needs, in one go
INSTALL ?= dev
$(INSTALLED): pyproject.toml
	@$(PYTHON) -c 'import sys; sys.exit("Python 3.11 or newer is needed: make PYTHON=…" if sys.version_info < (3, 11) else 0)'
	$(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --editable '.[$(INSTALL)]'
	touch $@

$(VENV)/installed-docs: $(INSTALLED)
	$(BIN)/python -m pip install --quiet --editable '.[docs]'
	touch $@

clean:
	rm -rf $(VENV) .venv-oldest .venv-newest build docs/generated dist results *.egg-info .pytest_cache .mypy_cache .ruff_cache .hypothesis .benchmarks
