# exoid. `make all` runs the default experiment on the embedded rig, `make test` the tests; both install what they need.

PYTHON ?= python3
VENV := .venv
BIN := $(VENV)/bin
INSTALLED := $(VENV)/.installed
# Graph of the experiment: once, there; `exoid init` gives the same file to every new experiment.
EXPERIMENT = $(MAKE) --no-print-directory $(JOBS) -f datasets/experiments/experiment.mk \
	EXOID=$(BIN)/exoid CONFIG=datasets/experiments/default.toml OUT=build/default
# Two steps at a time where the user says nothing else, each with its output in one piece.
JOBS = $(if $(filter -j%,$(MAKEFLAGS)),,-j2 --output-sync=target)

# What blind examinations left, for `make blind-page`.
LEGS = $(wildcard build/blind/report.json build/blind-full/report.json)
MACHINES = $(wildcard build/blind-machines/report.json)
# Seeds of the blind examination: tests/campaigns/blind/README.md says why there are two ranges.
SEEDS ?= tuning
# Sessions of each world from which the decision's criteria are learned.
SESSIONS ?= 2000

.DEFAULT_GOAL := help
.PHONY: help all investigate test test-slow invariants mutation readability check format bench estimators real fuzz vetoes blind blind-full blind-machines blind-fixed blind-page
.PHONY: detectability separation investigation evidence learn cross-validation sensitivity docs lock clean install

help: ## this list
	@grep -hE '^[a-z-]+:.*##' $(MAKEFILE_LIST) | sed 's/:.*##/\t/' | sort | expand -t 12

all: $(INSTALLED) ## the default experiment from its design to its report, into build/default
	+@$(EXPERIMENT) all
	@echo "what is done, stale or missing: $(BIN)/exoid status --config datasets/experiments/default.toml --out build/default"

investigate: $(INSTALLED) ## an experiment whose verdict is not sure, and further ones until it is, into build/undecided; five minutes
	$(BIN)/exoid investigate --config datasets/experiments/undecided.toml --out build/undecided
	$(BIN)/exoid run report --config datasets/experiments/undecided.toml --out build/undecided

test: $(INSTALLED) ## the tests
	$(BIN)/pytest -n 3 --dist loadfile -m "not slow"

test-slow: $(INSTALLED) ## the statistical campaigns, minutes long
	$(BIN)/pytest -n 2 -m slow

invariants: $(INSTALLED) ## what keeps a leg safe, over 20,000 random sequences of faults; about half an hour
	$(BIN)/pytest -m slow tests/acquisition/test_invariants.py

mutation: $(VENV)/.mutation ## change numbers and limits one at a time, and see that a test fails each time; about an hour
	$(BIN)/python tests/campaigns/mutation.py

readability: $(INSTALLED) ## measure how readable the code is
	$(BIN)/python tests/campaigns/readability.py

check: $(INSTALLED) ## lint, formatting, types, direction of imports
	$(BIN)/ruff check
	$(BIN)/ruff format --check
	$(BIN)/mypy
	$(BIN)/lint-imports

format: $(INSTALLED) ## format the code
	$(BIN)/ruff check --fix --select I
	$(BIN)/ruff format

bench: $(INSTALLED) ## measure speed
	$(BIN)/python -m tests.campaigns.bench

estimators: $(INSTALLED) ## what docs/estimators.md says of the methods, measured on simulated and real data; long
	$(BIN)/python -m tests.campaigns.estimators

peers: $(VENV)/.peers ## the same recordings through exoid and other tools, and docs/peers.md from what came of it
	$(BIN)/python -m tests.campaigns.peers docs/peers.md

real: $(INSTALLED) ## what docs/real-data.md says of other people's machines, measured on the data in EXOID_REAL_DATA; some minutes
	$(BIN)/python -m tests.campaigns.real docs/real-data.md

fuzz: $(INSTALLED) ## hostile replies against the client, hostile requests against the rig: 60,000 of each
	$(BIN)/python -m tests.campaigns.fuzz

faults: $(INSTALLED) ## let every fault loose on a run and write docs/faults.md from what became of it
	$(BIN)/python -m tests.campaigns.faults docs/faults.md

blind: $(INSTALLED) ## examine `exoid diagnose` on 300 sessions whose truth it cannot see; SEEDS=reporting to report
	$(BIN)/python -m tests.campaigns.blind --cases 300 --seeds $(SEEDS) --out build/blind

blind-full: $(INSTALLED) ## the same on 300 sessions with nothing hidden and 30 of each cause and joint; takes hours
	$(BIN)/python -m tests.campaigns.blind --full --seeds $(SEEDS) --out build/blind-full

blind-machines: $(INSTALLED) ## the same on 200 machines of one joint
	$(BIN)/python -m tests.campaigns.blind --one-joint --cases 200 --seeds $(SEEDS) --out build/blind-machines

blind-fixed: $(INSTALLED) ## record anew how the fixed set of CI comes out, in tests/campaigns/blind/fixed_set.json
	$(BIN)/python -m tests.campaigns.blind --fixed --write --out build/blind-fixed

detectability: $(INSTALLED) ## does a diagnosis name causes of the sizes that `exoid detect` predicts? Twelve causes, ten minutes
	$(BIN)/python -m tests.campaigns.detectability

separation: $(INSTALLED) ## do excitations of `exoid design --separate` decide as predicted? Twelve pairs of causes, half an hour
	$(BIN)/python -m tests.campaigns.separation

investigation: $(INSTALLED) ## does a further motion end the doubt of a verdict, in every world? Goes on where it was stopped; hours
	$(BIN)/python -m tests.campaigns.investigation

vetoes: $(INSTALLED) ## count false vetoes and named faults on simulated and real sessions, and write docs/vetoes.md; goes on where it was stopped
	$(BIN)/python -m tests.campaigns.vetoes docs/vetoes.md

blind-page: $(INSTALLED) ## write docs/blind.md and docs/blind-machines.md from the examinations that were made
	$(if $(LEGS),$(BIN)/python -m tests.campaigns.blind.page $(LEGS) docs/blind.md)
	$(if $(MACHINES),$(BIN)/python -m tests.campaigns.blind.page $(MACHINES) docs/blind-machines.md)

evidence: $(INSTALLED) ## what the decision needs of SESSIONS simulated sessions of each world, in build/learn; goes on where it was stopped; hours
	$(BIN)/python -m tests.campaigns.learn evidence --seeds $(SEEDS) --cases $(SESSIONS)

learn: $(INSTALLED) ## learn the decision's criteria from that evidence, into build/learn/learned.json
	$(BIN)/python -m tests.campaigns.learn fit

cross-validation: $(INSTALLED) ## learn the criteria without each world and each third of the forms, and judge them on what was left out; hours
	$(BIN)/python -m tests.campaigns.learn cross-validate

sensitivity: $(INSTALLED) ## measure on that evidence how much each criterion matters; `make docs` then writes docs/criteria.md
	$(BIN)/python -m tests.campaigns.learn sensitivity

docs: $(INSTALLED) ## bring the generated pages up to date, and make the site of all pages in build/site
	$(BIN)/python docs/site/setting_pages.py
	$(BIN)/python -m pipelines.effects.reference docs/effects
	$(BIN)/python docs/site/export_table.py
	$(BIN)/python -m pipelines.diagnosis.reference docs/criteria.md
	$(BIN)/python docs/site/example_verdict.py
	$(BIN)/sphinx-build --quiet --write-all --fail-on-warning --keep-going -c docs/site -d build/doctrees docs build/site

lock: ## pin the newest versions that fit pyproject.toml, in requirements.lock
	rm -rf build/lock
	$(PYTHON) -m venv build/lock
	build/lock/bin/pip install --quiet ".[dev,bench]" hatchling editables
	build/lock/bin/pip freeze --exclude exoid > build/lock/newest
	@# Not all that fits this Python fits the oldest one.
	build/lock/bin/pip install --quiet --dry-run --python-version 3.11.0 --only-binary=:all: --target build/lock/oldest -r build/lock/newest
	cp build/lock/newest requirements.lock

install: $(INSTALLED) ## make the environment in .venv

$(INSTALLED): pyproject.toml requirements.lock
	@$(PYTHON) -c 'import sys; sys.exit(sys.version_info < (3, 11))' || { \
	  echo "exoid needs Python 3.11 or newer, found $$($(PYTHON) --version 2>&1); name another: make PYTHON=python3.11" >&2; \
	  exit 2; }
	@test -x $(BIN)/python || $(PYTHON) -m venv $(VENV)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -r requirements.lock
	$(BIN)/python -m pip install --quiet --disable-pip-version-check --no-deps --no-build-isolation --editable .
	@touch $@

# What exoid is compared with is heavy, and nothing else needs it. Some of it comes as source, with a build system of its own.
$(VENV)/.peers: $(INSTALLED)
	$(BIN)/python -m pip install --quiet --disable-pip-version-check -c requirements.lock --editable ".[peers]"
	@touch $@

$(VENV)/.mutation: $(INSTALLED)
	@$(BIN)/python -m pip install --quiet --disable-pip-version-check -c requirements.lock --editable ".[mutation]"
	@touch $@

clean: ## remove results and caches; the environment stays
	rm -rf build .pytest_cache .ruff_cache .mypy_cache .import_linter_cache .hypothesis
	find exoid_cli pipelines tests -name __pycache__ -prune -exec rm -rf {} +
