"""The element inside multibody engines: impact, rest and contactor, with the lookahead that suits and with none."""

import os

import pytest

from . import cases, measure

PACKAGES = {"MuJoCo": "mujoco", "Exudyn": "exudyn", "Drake": "pydrake"}
NAMES = [f"{engine}, {how}" for engine, how, *_ in measure.ENGINES]


@pytest.fixture(scope="session")
def fmu(tmp_path_factory):
    return cases.pack(tmp_path_factory.mktemp("fmu") / "HysteresisContact.fmu")


@pytest.fixture(scope="session")
def opening():
    return measure.contactor_reference()


@pytest.fixture(params=measure.ENGINES, ids=NAMES)
def engine(request):
    package = PACKAGES[request.param[0]]
    if os.environ.get("CI") != "true":
        pytest.importorskip(package, reason=f"{package} is not installed: tests/hosts/run installs it")
    __import__(package)
    return request.param


def test_restitution_and_peak_at_some_twenty_steps_a_contact(fmu, engine):
    name, how, drive, options, lookahead = engine
    restitution, peak = measure.worst_impact(fmu, drive, options, lookahead)
    # generalized alpha weighs the load with that of the step before: no lookahead undoes all of it
    assert restitution < (1e-2 if how == "generalized alpha" else 1e-3)
    assert peak < (6e-2 if how == "generalized alpha" else 3e-2)


def test_half_a_step_of_lookahead_too_many_or_too_few_is_seen(fmu, engine):
    name, how, drive, options, lookahead = engine
    for other in [lookahead - 0.5, lookahead + 0.5]:
        restitution, _ = measure.worst_impact(fmu, drive, options, other)
        assert restitution > 5e-2


def test_a_body_set_down_comes_to_rest_where_it_should(fmu, engine):
    name, how, drive, options, lookahead = engine
    end, moves = measure.rest(fmu, drive, options, lookahead)
    assert abs(end) < 1e-6 and moves < 1e-6


def test_the_contactor_opens_as_in_our_own_master(fmu, engine, opening):
    name, how, drive, options, lookahead = engine
    peak, rebound = measure.contactor(fmu, drive, options, lookahead)
    assert peak == pytest.approx(opening[0], rel=6e-2)
    assert rebound == pytest.approx(opening[1], rel=1e-2)
