# make install | make train | make test | make check | make docs | make gpu | make blender: each first creates .venv and installs into it where that has not been done.
PYTHON ?= $(shell command -v python3.11 || command -v python3)
BIN := .venv/bin
INSTALLED := .venv/installed
SHELL := bash

# Variables of make gpu: motion to train on, minutes of training, motion on which its policy and the package's are evaluated.
MOTIONS ?= synthetic
MINUTES ?= 25
TESTED ?= synthetic

# The suite's two parts take about as long as each other. What is not named here, new folders too, is in the second.
FIRST_PART := tests/envs tests/eval

.PHONY: install train test test-first-part test-second-part check docs gpu blender

install: $(INSTALLED)

train: $(INSTALLED)
	$(BIN)/python -m trainers.ppo --config configs/mixed.yaml

# Both parts at once, a process and a core each: threads beyond that would wait for one another. Each line begins with its part.
test: $(INSTALLED)
	@$(MAKE) --no-print-directory --jobs=2 test-first-part test-second-part

test-first-part: PART := $(FIRST_PART)
test-second-part: PART := tests $(addprefix --ignore=,$(FIRST_PART))
test-first-part test-second-part: $(INSTALLED)
	@set -o pipefail; OMP_NUM_THREADS=1 $(BIN)/python -m pytest --override-ini=cache_dir=.pytest_cache/$@ $(PART) 2>&1 | sed -u 's/^/$@: /'

check: $(INSTALLED)
	$(BIN)/ruff check .
	$(BIN)/ruff format --check .
	$(BIN)/pyright --pythonpath $(BIN)/python

# The API reference, from the docstrings.
docs: $(INSTALLED)
	$(BIN)/python -m pip install --disable-pip-version-check --quiet --constraint constraints.txt --editable '.[docs]'
	$(BIN)/python -m sphinx --builder html --keep-going --quiet docs/api build/docs
	@echo "build/docs/index.html"

# The add-on for Blender as committed, to be installed there from disk (docs/blender.md).
blender:
	@mkdir -p build
	git archive --format=zip --output=build/adapt_mimic.zip HEAD:blender
	@echo "build/adapt_mimic.zip"

# Everything that takes a GPU, in one go: tests, agreement with the CPU, speed, a training, and its policy beside the package's on the CPU.
gpu: $(INSTALLED)
	$(BIN)/python -m pytest -m gpu
	$(BIN)/python -m eval.backends --device cuda
	$(BIN)/python -m eval.benchmark worlds --json runs/gpu_worlds.json
	$(BIN)/python -m trainers.ppo --config configs/gpu.yaml device=cuda data.motions=$(MOTIONS) minutes=$(MINUTES)
	$(BIN)/python -m eval.report --run runs/gpu --motions $(TESTED) --out report/gpu
	$(BIN)/python -m eval.report --run agents/weights/mimic.safetensors --motions $(TESTED) --out report/package

$(INSTALLED): pyproject.toml constraints.txt
	@"$(PYTHON)" -c 'import sys; sys.exit(sys.version_info < (3, 11))' 2>/dev/null || \
		{ echo "Python 3.11 or newer is needed, '$(PYTHON)' is not; install it, or name one: make PYTHON=/path/to/python3.11" >&2; exit 1; }
	@"$(PYTHON)" -m venv .venv || \
		{ echo "'$(PYTHON)' cannot create .venv; install its venv module (Debian, Ubuntu: apt install python3-venv)" >&2; exit 1; }
	$(BIN)/python -m pip install --disable-pip-version-check --constraint constraints.txt --editable '.[dev]'
	@touch $@
