"""Bar and contact, exported as they stand, in other people's masters."""

import importlib.util
import os
import tempfile

import pytest

from . import masters, measure


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


def test_fmi_sim_flies_the_bar():
    if masters.fmi_sim_path() is None:
        pytest.skip("fmi-sim is not on the path: cargo install fmi-sim --version 0.7.0")
    with tempfile.TemporaryDirectory() as folder:
        assert masters.fmi_sim(folder) == pytest.approx(0.008, rel=1e-9)
