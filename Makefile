# make run       set up, then open the demo; ARGS="scene.glb --view traced" are passed on
# make test      set up, then ruff, mypy and every test; ARGS="-k bvh" go to pytest
# make lint      ruff and mypy alone             make wheel   build dist/*.whl
# make soak      the tests with a long form, in that form: hours; ARGS="-k bvh" as above
# make shots     draw the pictures in screenshots/ again: they are the README's and the golden tests' alike
# make clean     remove everything that was built
RUN := .venv/bin/python -m

.PHONY: run test lint pytest soak shots approve wheel clean setup setup-dev

run: setup
	@$(RUN) app $(ARGS)

test: lint pytest

lint: setup-dev
	$(RUN) ruff check
	$(RUN) mypy

pytest: setup-dev
	$(RUN) pytest $(ARGS)

soak: setup-dev
	$(RUN) pytest --soak $(ARGS)

shots approve: setup-dev
	$(RUN) tests.image.approve $(ARGS)

wheel: setup-dev
	$(RUN) hatchling build --target wheel

setup:
	@sh scripts/setup.sh run

setup-dev:
	@sh scripts/setup.sh dev

clean:
	rm -rf .venv .pytest_cache .mypy_cache .ruff_cache .hypothesis dist build out
	find app tests -type d -name __pycache__ -exec rm -rf {} +
