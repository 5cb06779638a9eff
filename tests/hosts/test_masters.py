"""Bar and contact, exported as they stand, in other people's masters."""

import importlib.util
import os

import pytest

from . import cases, masters, measure


@pytest.fixture(params=masters.ALL, ids=[m[0] for m in masters.ALL])
def master(request):
    modules = {"fmpy": "fmpy", "libcosimpy": "libcosimpy", "ecospy": "ecospy"}
    module = modules.get(request.param[1])
    # found, not imported: ecospy wants TBB loaded before it
    if module and os.environ.get("CI") != "true" and importlib.util.find_spec(module) is None:
        pytest.skip(f"{module} is not installed: tests/hosts/run installs it")
    return request.param


def test_the_impact_comes_out_right_with_the_lookahead_of_its_order(master):
    name, _, function, lookahead = master
    # 22 steps a contact: sequential masters within a thousandth, parallel ones within a few hundredths
    assert measure.worst_master(function, lookahead) < (1e-3 if lookahead == 0.5 else 5e-2)


def test_without_lookahead_energy_is_gained(master):
    name, _, function, lookahead = master
    assert measure.worst_master(function, 0.0) > 5e-2


def test_parallel_masters_agree_to_rounding(master, tmp_path):
    name, _, function, lookahead = master
    if lookahead != 1.5:
        pytest.skip("steps in sequence: there is no other such host here")
    ours = masters.touchdown_parallel(tmp_path, 1.5, 0.35)
    (tmp_path / "other").mkdir()
    assert function(tmp_path / "other", 1.5, 0.35) == pytest.approx(ours, rel=1e-9)


def test_fmi_sim_flies_the_bar_and_presses_the_contact(tmp_path):
    if masters.fmi_sim_path() is None:
        assert os.environ.get("CI") != "true", "CI runs fmi-sim: tests/hosts/run builds it"
        pytest.skip("fmi-sim is not here: cargo install fmi-sim --version 0.7.0")
    assert abs(masters.fmi_sim_flight(tmp_path)) < 1e-9
    assert masters.fmi_sim_contact(tmp_path) < 1e-9


def test_energy_told_beyond_the_work_done_shows_a_coupling_that_is_too_coarse(tmp_path):
    fmu = cases.pack(tmp_path / "HysteresisContact.fmu")
    # the figures of documentation/cosimulation.html
    made_up, off = measure.made_up(fmu, 20, 0.0)
    assert made_up == pytest.approx(0.29, abs=0.01) and off == pytest.approx(0.18, abs=0.01)
    made_up, off = measure.made_up(fmu, 20, 0.5)
    assert made_up == pytest.approx(-0.016, abs=0.001) and abs(off) < 2e-4
    assert measure.made_up(fmu, 40, 0.0)[0] == pytest.approx(0.133, abs=0.005)
