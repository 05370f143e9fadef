VENV := .venv
RUN := $(VENV)/bin/python
READY := $(VENV)/.ready
PEERS_READY := $(VENV)/.peers-ready
BENCH := build/bench

# The first of these that runs, is 3.11 or 3.13 (those that Blender is built for) and can make an environment.
SUITS := import ensurepip, sys, venv; sys.exit(sys.version_info[:2] not in [(3, 11), (3, 13)])
PYTHON ?= $(shell for p in python3.13 python3.11 python3; do $$p -c '$(SUITS)' 2>/dev/null && echo $$p && break; done)

.PHONY: help demo test gui-test lint format zip bench bench-full clean

help: ## list the targets
	@sed -n 's/^\([a-z-]*\):.*## /\1\t/p' $(MAKEFILE_LIST) | expand -t 12
	@echo "PYTHON=... picks the interpreter (3.11 or 3.13) that makes $(VENV)."

demo: $(READY) ## reconstruct the bundled scan into demo/, with a picture
	$(RUN) -m scripts.demo

test: $(READY) ## run every test that needs no window, two at a time; ARGS="-k word" picks some
	$(RUN) -m pytest -n 2 --dist worksteal $(ARGS)

gui-test: $(READY) ## run the tests in a Blender with a window; BLENDER=/path/to/blender picks it
	$(RUN) scripts/gui_tests.py $(if $(BLENDER),--blender "$(BLENDER)") $(ARGS)

lint: $(READY) ## check style and likely mistakes
	$(RUN) -m ruff check
	$(RUN) -m ruff format --check

format: $(READY) ## let ruff fix what it can
	$(RUN) -m ruff check --fix
	$(RUN) -m ruff format

zip: $(READY) ## build and validate the Blender extension into dist/
	$(RUN) scripts/build_extension.py

bench: $(PEERS_READY) ## compare with other ways on a few shapes (minutes); CASES=folder brings your own
	$(if $(CASES),,$(RUN) -m benchmarks.make_cases $(BENCH)-quick --quick)
	$(RUN) -m benchmarks $(or $(CASES),$(BENCH)-quick) --peer --surfaces --save build/results $(ARGS)

bench-full: $(PEERS_READY) ## on all shapes and samplings into docs/ (an hour); goes on where it ended; MINUTES=n
	$(if $(CASES),,$(RUN) -m benchmarks.make_cases $(BENCH))
	$(RUN) -m benchmarks $(or $(CASES),$(BENCH)) --results --page bench --surfaces --repeats 3 --jobs 2 \
		--keep $(BENCH)-kept $(if $(MINUTES),--minutes $(MINUTES)); \
	status=$$?; $(RUN) -m benchmarks.paper && $(RUN) -m benchmarks.claims && exit $$status

clean: ## remove what the other targets made, the environment included
	rm -rf $(VENV) demo dist build .pytest_cache .ruff_cache .hypothesis

$(READY): requirements.txt
	@test -n "$(PYTHON)" || { echo "No Python 3.11 or 3.13 with venv and pip found; install one (Debian: python3-venv too) or name it: make PYTHON=/path/to/python"; exit 2; }
	@"$(PYTHON)" -c '$(SUITS)' || { echo "$(PYTHON) does not suit: Python 3.11 or 3.13 with venv and pip is needed"; exit 2; }
	"$(PYTHON)" -m venv --clear $(VENV)
	$(RUN) -m pip install --quiet --disable-pip-version-check -r requirements.txt
	@touch $@

$(PEERS_READY): $(READY) benchmarks/requirements.txt
	$(RUN) -m pip install --quiet --disable-pip-version-check -r benchmarks/requirements.txt
	@touch $@
