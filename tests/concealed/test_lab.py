"""The laboratory against closed forms, its own repeatability, and the formats it promises.

Run by tests/run.
"""
import json
import math
import tomllib
from types import SimpleNamespace

import numpy as np
import pytest
from scipy.special import lambertw

from tests.concealed import chain, motion as m, rigs
from tests.concealed.calibrate import base_parameters, fit
from tests.concealed.effects import FORMS, STRANGE
from tests.concealed.generate import TIERS, described, generate, label_hash, plan
from tests.concealed.judge import band, distance, files, judge, table

VOCABULARY = """hysteresis_damping viscous_damping plastic_indentation adhesion viscoelastic_relaxation secondary_stiffening
cyclic_softening gravity guide_friction fluid_drag squeeze_film base_compliance loose_part return_spring residual_magnetism
sensor_resonance charge_droop lowpass_lag channel_skew clipping force_gain
contact_preload attached_mass cyclic_hardening""".split()


def body(**kw):
    P = np.zeros(m.NP)
    P[m.KFAC] = 1.0
    for k, v in kw.items():
        P[getattr(m, k)] = v
    return P


def ride(P, x0, v0, t, n=4000, scale_x=1e-3, tol=1e-9):
    times = np.linspace(0, t, n)
    out = np.zeros((n, 7))
    touch = m.run(P, x0, v0, times, scale_x, abs(v0), tol, out)
    assert touch[2] > 0
    return times, out, touch


@pytest.mark.parametrize("k,p,mu", [(3.51e10, 2.79, 2.70e10), (1.85e8, 1.96, 8.77e7), (1e6, 1.0, 3e5), (1e9, 1.5, 2e10)])
def test_restitution_is_lambert_s(k, p, mu):
    """Hunt-Crossley between touch and leaving: d e = 1 + W0(-(1+d) exp(-(1+d))), d = mu v0/k; loss and impulse follow."""
    d = mu / k
    e = (1 + lambertw(-(1 + d) * np.exp(-(1 + d))).real) / d
    t, out, touch = ride(body(M=1.0, K=k, PW=p, MU=mu), -1e-4, 1.0, 0.05, 40000)
    assert touch[0] == pytest.approx(1e-4, rel=1e-9) and touch[1] == pytest.approx(1.0, rel=1e-9)
    assert -out[-1, 1] == pytest.approx(e, rel=1e-7)
    impulse = np.trapezoid(out[:, 3], t)
    assert impulse == pytest.approx(1 + e, rel=2e-4)
    loss = np.trapezoid(out[:, 3] * out[:, 1], t)
    assert loss == pytest.approx((1 - e * e) / 2, rel=2e-3)


def test_undamped_contact_gives_the_energy_back():
    _, out, _ = ride(body(M=0.7, K=2e8, PW=1.7), -1e-4, 0.9, 0.05)
    assert -out[-1, 1] == pytest.approx(0.9, rel=1e-7)
    x, v = out[:, 0], out[:, 1]
    energy = 0.5 * 0.7 * v ** 2 + 2e8 * np.maximum(x, 0) ** 2.7 / 2.7
    assert np.ptp(energy) < 1e-6 * energy[0]


def test_walton_braun_restitution_is_root_of_the_stiffnesses():
    for ratio in (1.3, 2.0, 5.0):
        _, out, _ = ride(body(M=1.0, K=1e6, PW=1.0, PL=2, PL_R=ratio), -1e-4, 1.0, 0.05)
        assert -out[-1, 1] == pytest.approx(ratio ** -0.5, rel=1e-6)


def test_permanent_set_stays_and_thornton_is_elastic_below_yield():
    P = body(M=1.0, K=1e8, PW=1.5, PL=1, PL_Y=1e-4, PL_R=0.4)
    _, out, _ = ride(P, -1e-4, 1.0, 0.05)
    deepest = out[:, 0].max()
    on_return = out[(out[:, 6] == 1) & (out[:, 0] > 0)]
    assert np.all(on_return[on_return[:, 0] < 0.4 * (deepest - 1e-4) * 0.999][:, 3] == 0)
    a = ride(body(M=1.0, K=1e8, PW=1.5, PL=3, PL_Y=1.0), -1e-4, 1.0, 0.05)[1]
    assert -a[-1, 1] == pytest.approx(1.0, rel=1e-6)
    b = ride(body(M=1.0, K=1e8, PW=1.5, PL=3, PL_Y=2e-4), -1e-4, 1.0, 0.05)[1]
    assert -b[-1, 1] < 0.97


def test_friction_and_drag_in_flight():
    """Coulomb: v^2 = v0^2 - 2 F s / M. Quadratic drag: v = v0 exp(-c s / M)."""
    _, out, _ = ride(body(M=0.5, K=1e8, PW=1.5, FR=1, FR_C=2.0), -0.05, 1.0, 0.02)
    s = out[-1, 0] + 0.05
    assert out[-1, 1] == pytest.approx(np.sqrt(1 - 2 * 2.0 * s / 0.5), rel=1e-8)
    _, out, _ = ride(body(M=0.5, K=1e8, PW=1.5, DRAG=3.0, DRAG_N=2, DRAG_BACK=1), -0.05, 1.0, 0.02)
    assert out[-1, 1] == pytest.approx(np.exp(-3.0 * (out[-1, 0] + 0.05) / 0.5), rel=1e-8)


def test_gravity_spring_and_preload_conserve_energy():
    P = body(M=0.4, K=1e7, PW=1.1, G=9.81, SP_PRE=30.0, SP_K=2000.0, TRAVEL=0.003)
    _, out, _ = ride(P, -0.003, 1e-9, 0.03, scale_x=1e-4)
    x, v = out[:, 0], out[:, 1]
    u = x + 0.003
    e = 0.2 * v ** 2 + 1e7 * np.maximum(x, 0) ** 2.1 / 2.1 - 0.4 * 9.81 * u - 30.0 * u + 1000.0 * u * u
    assert np.ptp(e) < 1e-5 * (0.2 * (v ** 2).max())


def test_viscous_contact_is_the_damped_oscillator():
    """Linear spring and dashpot until the force clamps at zero: velocity there by the closed solution."""
    k, c, mass = 1e6, 200.0, 1.0
    _, out, _ = ride(body(M=mass, K=k, PW=1.0, CV=c), -1e-4, 1.0, 0.02)
    z = c / 2 / np.sqrt(k * mass)
    # the dashpot pulls from the instant F = kx + cv = 0; the clamped body then flies: e = exp(-z/sqrt(1-z^2) (pi - 2 asin ...))
    w, n = np.sqrt(k / mass * (1 - z * z)), z * np.sqrt(k / mass)
    t = np.linspace(1e-9, np.pi / w, 400001)
    x = np.exp(-n * t) * np.sin(w * t) / w
    v = np.exp(-n * t) * (np.cos(w * t) - n / w * np.sin(w * t))
    i = np.argmax((k * x + c * v <= 0) & (t > 0.2 * np.pi / w))
    assert -out[-1, 1] == pytest.approx(-v[i], rel=1e-4)


@pytest.mark.parametrize("mode", [1, 2])
def test_moving_stop_and_transducer_tip_conserve_energy(mode):
    P = body(M=1.0, K=1e8, PW=1.5, BMODE=mode, MB=0.2 if mode == 1 else 0.05, KB=2e7)
    n = 4000
    t = np.linspace(0, 0.02, n)
    out = np.zeros((n, 7))
    assert m.run(P, -1e-4, 1.0, t, 1e-3, 1.0, 1e-9, out)[2] > 0
    work = np.trapezoid(out[:, 4 if mode == 2 else 3] * out[:, 1], t)
    # what the body lost is what it did against the contact (or the transducer)
    inertia = 1.0 if mode == 1 else 0.95
    assert 0.5 * inertia * (1 - out[-1, 1] ** 2) == pytest.approx(work, abs=2e-4)
    # and it cannot leave with more than there was
    assert inertia * out[-1, 1] ** 2 < 1.0


def test_loose_part_keeps_the_momentum():
    P = body(M=1.0, K=1e8, PW=1.5, LM=0.2, LGAP=1e-4, LK=5e7, LP=1.0)
    t, out, _ = ride(P, -1e-4, 1.0, 0.02, 20000)
    # body and part together change their momentum by the contact's impulse; the part leaves with the rest
    impulse = np.trapezoid(out[:, 3], t)
    part = (1.0 - impulse - 0.8 * out[-1, 1]) / 0.2
    energy = 0.4 * out[-1, 1] ** 2 + 0.1 * part ** 2
    assert energy == pytest.approx(0.5, rel=3e-3)


def test_a_contactor_drives_its_loose_part_along_and_is_struck_by_it():
    free = body(M=0.4, K=1e7, PW=1.0, SP_PRE=60.0, SP_K=5e3, TRAVEL=3e-3)
    P = free.copy()
    FORMS["loose_part", "linear"][2](np.random.default_rng(1), SimpleNamespace(kind="contactor-opening", ref=dict(x=2e-4, T=5e-4)))(0.2, P, {}, None)
    t = np.linspace(0, 0.012, 4000)
    whole, split = np.zeros((4000, 7)), np.zeros((4000, 7))
    touch, struck = (m.run(p, -3e-3, 0.0, t, 2e-4, 0.8, 1e-9, out) for p, out in ((free, whole), (P, split)))
    # until the touch the whole mass moves as one
    assert struck[0] == pytest.approx(touch[0], rel=1e-3)
    # then the part pushes, harder than the spring that drives the body
    own = (P[m.M] - P[m.LM]) * split[:, 2] + split[:, 3] + P[m.SP_K] * (split[:, 0] + P[m.TRAVEL]) - P[m.SP_PRE]
    assert t[np.argmax(own)] > struck[0] and own.max() > P[m.SP_PRE]


def test_maxwell_branch_relaxes_by_its_time_constant():
    n = 2000
    t = np.linspace(0, 1, n)
    x = np.where(t < 0.1, t * 1e-2, 1e-3)
    v = np.where(t < 0.1, 1e-2, 0.0)
    P = body(M=1.0, K=1e3, PW=1.0, VE_N=1, VE_KIND=0)
    P[m.VE_K], P[m.VE_T] = 500.0, 0.2
    out = np.zeros((n, 7))
    m.imposed(P, t, x, v, out)
    end = 1.0 + 500 * 1e-2 * 0.2 * (1 - np.exp(-0.5)) * np.exp(-(t - 0.1) / 0.2)
    late = t > 0.11
    assert np.allclose(out[late, 3], end[late], rtol=2e-3)


def test_a_return_of_its_own_power_ends_at_its_set():
    P = body(M=1.0, K=1e8, PW=1.5, PL=4, PL_Y=1e-4, PL_R=0.5, PL_M=1.9)
    _, out, _ = ride(P, -1e-4, 1.0, 0.05)
    top = out[:, 0].max()
    back = out[out[:, 6] == 1]
    still = 0.5 * (top - 1e-4) ** 2 / top
    assert np.all(back[(back[:, 0] < still * 0.999) & (back[:, 0] > 0)][:, 3] == 0)
    mid = back[back[:, 0] > 1.2 * still]
    want = 1e8 * top ** 1.5 * ((mid[:, 0] - still) / (top - still)) ** 1.9
    assert len(mid) > 5 and np.allclose(mid[:, 3], want, rtol=1e-4)


def test_a_gradual_layer_becomes_the_sharp_one():
    n = 400
    t = np.linspace(0, 1, n)
    x = 1e-3 * t
    out = {}
    for w in (0.0, 1e-6, 1e-4):
        P = body(M=1.0, K=1e3, PW=1.0, ST_K=2e3, ST_D=4e-4, ST_P=1.3, ST_W=w)
        o = np.zeros((n, 7))
        m.imposed(P, t, x, np.full(n, 1e-3), o)
        out[w] = o[:, 3]
    assert np.allclose(out[0.0], out[1e-6], atol=2e-3 * out[0.0].max())
    mid = np.searchsorted(x, 4e-4)
    assert out[1e-4][mid] > out[0.0][mid] + 0.005 * out[0.0].max()


def test_a_third_layer_and_damping_of_a_power_of_speed_are_what_they_say():
    n = 50
    x, v = np.full(n, 6e-4), np.full(n, 0.3)
    t = np.arange(n) * 1e-4
    o = np.zeros((n, 7))
    m.imposed(body(M=1.0, K=1e3, PW=1.0, ST_K=2e3, ST_D=4e-4, ST_P=1.0, ST2_K=5e3, ST2_D=5e-4), t, x, v, o)
    assert o[-1, 3] == pytest.approx(0.6 + 0.4 + 0.5, rel=1e-9)
    m.imposed(body(M=1.0, K=1e3, PW=1.0, MU=1e3, MU_THIN=0.3, MU_POW=0.5), t, x, v, o)
    assert o[-1, 3] == pytest.approx(0.6 + 0.6 * 0.3 / math.sqrt(1.02), rel=1e-9)


def test_a_stop_that_slides_in_its_seat_loses_energy():
    moving = dict(M=1.0, K=1e8, PW=1.5, BMODE=1.0, MB=1.0, KB=1e6, KB3=0.0)
    free = [ride(body(**moving, CB_DRY=dry), -1e-4, 0.5, 0.01)[1] for dry in (0.0, 40.0)]
    assert np.abs(free[1][-1, 1]) < 0.97 * np.abs(free[0][-1, 1])


def test_progressive_spring_and_eddy_fade_in_flight():
    P = body(M=0.4, K=1e7, PW=1.1, SP_PRE=30.0, SP_K=2000.0, SP_K3=1e8, TRAVEL=0.003)
    _, out, _ = ride(P, -0.003, 1e-9, 0.02, scale_x=1e-4)
    u = out[:, 0] + 0.003
    e = 0.2 * out[:, 1] ** 2 + 1e7 * np.maximum(out[:, 0], 0) ** 2.1 / 2.1 - 30.0 * u + 1000.0 * u * u + 2.5e7 * u ** 4
    assert np.ptp(e) < 1e-5 * 0.2 * (out[:, 1] ** 2).max()
    t, out, _ = ride(body(M=1.0, K=1e7, PW=1.0, MG_F=2.0, MG_T=0.01, MG_EDDY=1.0), -0.02, 1.0, 0.015)
    assert out[-1, 1] == pytest.approx(1.0 - 2.0 * 0.01 * (1 - 1 / (1 + t[-1] / 0.01)), rel=1e-7)


def test_an_overloaded_amplifier_lets_go_late_and_a_clock_drifts():
    t = np.arange(1000) * 1e-4
    y = np.sin(2 * np.pi * 20 * t)
    hard, slow = chain.clipped(y, 0.8, False), chain.clipped(y, 0.8, 2e-3, 1e-4)
    late = np.flatnonzero(slow != hard)
    assert 15 <= len(late) <= 20 * 4 and np.all(np.abs(slow[late]) == 0.8)
    s = chain.shifted(np.sin(2 * np.pi * 20 * t), 1e-4, 1e-4, 0.01)
    assert np.allclose(s[50:-50], np.sin(2 * np.pi * 20 * (t - 1e-4 - 0.01 * t))[50:-50], atol=1e-6)


def test_play_keeps_its_width_and_a_shaken_rig_follows_its_force():
    t = np.arange(4000) * 1e-5
    x = 1e-3 * np.sin(2 * np.pi * 50 * t)
    r = chain.played(x, 1e-4)
    assert np.all(np.abs(r - x) <= 0.5e-4 * (1 + 1e-9))
    turn = int(np.argmax(x))
    stuck = np.flatnonzero(x[turn:] < x[turn] - 1e-4)[0]
    assert np.ptp(r[turn:turn + stuck - 1]) < 1e-12
    assert r[turn + stuck + 50] == pytest.approx(x[turn + stuck + 50] + 0.5e-4, rel=1e-9)
    w, a, ph = 500.0, 3.0, 0.4
    t, out, _ = ride(body(M=0.6, K=1e7, PW=1.0, VIB=a, VIB_W=w, VIB_PH=ph), -1.0, 1.0, 0.02)
    assert np.allclose(out[:, 1], 1.0 + a / 0.6 / w * (np.cos(ph) - np.cos(w * t + ph)), rtol=1e-7)


@pytest.mark.parametrize("form", [1.0, 2.0, 3.0])
def test_a_preloaded_spring_gives_its_energy_back_and_acts_at_once(form):
    F0, d = 120.0, 4e-6
    P = body(M=0.7, K=2e8, PW=1.7, PRE=form, PRE_F=F0, PRE_D=d, PRE_SAG=0.3, PRE_X=3e-4)
    _, out, _ = ride(P, -1e-4, 0.9, 0.05)
    assert -out[-1, 1] == pytest.approx(0.9, rel=1e-6)
    inside = out[out[:, 0] > 20 * d]
    extra = inside[:, 3] - 2e8 * inside[:, 0] ** 1.7
    want = F0 * (1 - (0.3 * (1 - np.exp(-inside[:, 0] / 3e-4)) if form == 3.0 else 0.0))
    assert len(inside) > 20 and np.allclose(extra, want, rtol=1e-6)


def rider(t, out, P, v0=1.0):
    """Speed and lead of the riding mass, from the impulse the contact gave and what the body has of it."""
    impulse = np.concatenate([[0.0], np.cumsum(0.5 * (out[1:, 3] + out[:-1, 3]) * np.diff(t))])
    va = (P[m.M] * v0 - impulse - (P[m.M] - P[m.AM]) * out[:, 1]) / P[m.AM]
    lead = np.concatenate([[0.0], np.cumsum(0.5 * (va[1:] - out[1:, 1] + va[:-1] - out[:-1, 1]) * np.diff(t))])
    return va, lead


def test_a_riding_mass_rings_at_its_frequency_and_keeps_the_energy():
    P = body(M=1.0, K=1e8, PW=1.5, AM=0.2, AM_K=4e5)
    t, out, _ = ride(P, -1e-4, 1.0, 0.04, 40000)
    va, lead = rider(t, out, P)
    energy = 0.4 * out[:, 1] ** 2 + 0.1 * va ** 2 + 2e5 * lead ** 2 + 1e8 * np.maximum(out[:, 0], 0) ** 2.5 / 2.5
    assert np.ptp(energy) < 2e-3 * energy[0]
    # in flight both ring about their common speed: omega^2 = k (1/m_body + 1/m_rider)
    fly = t > 0.01
    v = out[fly, 1] - out[fly, 1].mean()
    cross = t[fly][1:][(v[1:] > 0) & (v[:-1] <= 0)]
    assert np.diff(cross).mean() == pytest.approx(2 * np.pi / math.sqrt(4e5 * (1 / 0.8 + 1 / 0.2)), rel=3e-3)
    stiff = ride(body(M=1.0, K=1e8, PW=1.5, AM=0.2, AM_K=4e10, AM_C=9e4), -1e-4, 1.0, 0.02)[1]
    assert -stiff[-1, 1] == pytest.approx(1.0, rel=2e-3)          # on a stiff spring it is part of the body


@pytest.mark.parametrize("more", [dict(AM_C=60.0), dict(AM_K3=4e12, AM_C=20.0), dict(AM_DRY=15.0), dict(AM_GAP=2e-5, AM_C=30.0)])
def test_a_riding_mass_only_takes_energy(more):
    P = body(M=1.0, K=1e8, PW=1.5, AM=0.2, AM_K=4e5, **more)
    t, out, _ = ride(P, -1e-4, 1.0, 0.03, 40000)
    va, lead = rider(t, out, P)
    e = np.abs(lead) - P[m.AM_GAP]
    e = np.maximum(e, 0.0) if P[m.AM_GAP] > 0 else np.abs(lead)
    energy = 0.4 * out[:, 1] ** 2 + 0.1 * va ** 2 + 2e5 * e ** 2 + P[m.AM_K3] * e ** 4 / 4 + 1e8 * np.maximum(out[:, 0], 0) ** 2.5 / 2.5
    assert np.max(np.diff(energy[::200])) < 1e-3 * energy[0]
    assert energy[-1] < 0.99 * energy[0]


def test_hardening_grows_with_the_order_from_the_first_recording_on():
    rig = rigs.draw(np.random.default_rng(3), "drop-test")
    for key in [k for k in FORMS if k[0] == "cyclic_hardening"]:
        apply, got = FORMS[key][2](np.random.default_rng(1), rig), []
        for r in rig.recs:
            P = rig.P.copy()
            apply(0.2, P, {}, r)
            got.append(P[m.KFAC])
        assert got[0] == 1.0 and np.all(np.diff(got) > 0) and got[-1] < 1.3, key


@pytest.mark.parametrize("key", [k for k in FORMS if k[0] in ("contact_preload", "attached_mass", "cyclic_hardening")], ids="-".join)
def test_what_real_recordings_ask_for_acts_and_is_absorbed_by_calibration(key):
    kind = "indentation" if key == ("contact_preload", "tanh") else "drop-test"
    rng = np.random.default_rng([11, len(key[1])])
    rig = rigs.draw(rng, kind, True if kind == "drop-test" else False, rigs.CHANNELS if kind == "drop-test" else None)
    apply = FORMS[key][2](rng, rig)
    sims, bare = (rigs.simulate(rig, rig.P, e) for e in ([(apply, 0.15)], []))
    seen = ["force"] if kind == "indentation" else rig.channels
    moved = math.sqrt(np.mean(np.concatenate([(a[c] - b[c]) / rig.sigma[c] for a, b in zip(sims, bare) for c in seen]) ** 2))
    f = fit(rig, sims, base_parameters(rig), stride=max(1, rig.recs[0].n // 220), speed_std=1e-3)
    assert moved > 1.0 and 0.1 < f.over_noise < moved and f.r2 > 0.99


def test_filters_do_what_their_names_say():
    dt, tau = 1e-5, 1e-3
    t = np.arange(4000) * dt
    step = (t > 0.005) * 1.0
    late = t > 0.0052
    a = chain.filtered(step, dt, "lag", 1, 1 / tau)
    b = chain.filtered(step, dt, "droop", 1, 1 / tau)
    assert np.allclose(a[late], 1 - np.exp(-(t[late] - 0.005) / tau), atol=0.02)
    assert np.allclose(a + b, step, atol=1e-9)
    ramp = t.copy()
    assert np.allclose(chain.filtered(ramp, dt, "bessel", 4, 2e4)[2000:] - (ramp[2000:]), np.mean(chain.filtered(ramp, dt, "bessel", 4, 2e4)[2000:] - ramp[2000:]), atol=1e-7)
    s = chain.shifted(np.sin(2 * np.pi * 100 * t), dt, 3.3e-5)
    assert np.allclose(s[100:-100], np.sin(2 * np.pi * 100 * (t - 3.3e-5))[100:-100], atol=1e-6)
    y = chain.noise(np.random.default_rng(1), 200000, 2.0, 0.5)
    assert y.std() == pytest.approx(2.0, rel=0.02) and np.corrcoef(y[1:], y[:-1])[0, 1] == pytest.approx(0.5, abs=0.01)


def test_every_mechanism_has_at_least_two_forms():
    for v in VOCABULARY:
        assert sum(k[0] == v for k in FORMS) >= 2, v
        assert any(k[0] == v for k in STRANGE), f"{v} has no form but those the diagnosis fits"
    assert STRANGE <= set(FORMS)
    assert {k[0] for k in FORMS if not k[0].startswith("unknown:")} == set(VOCABULARY)
    outside = {k[0] for k in FORMS if k[0].startswith("unknown:")}
    assert len(outside) >= 6 and sum(k[0] in outside for k in STRANGE) >= 4


def test_plan_covers_tiers_and_mechanisms():
    p = plan(np.random.default_rng(1), 110)
    assert len(p) == 110
    assert {t for t, _ in p} == {"null", "plain", "concealed", "deep", "faint", "pair", "unknown"}
    assert {x for t, x in p if t == "concealed"} == set(VOCABULARY)


@pytest.fixture(scope="module")
def drawn(tmp_path_factory):
    d = tmp_path_factory.mktemp("lab")
    generate(77, 4, d / "a", None)
    generate(77, 4, d / "b", None)
    generate(78, 1, d / "c", None)
    return d


def test_a_seed_gives_the_same_bytes(drawn):
    a = sorted(p.relative_to(drawn / "a") for p in (drawn / "a").rglob("*") if p.is_file())
    assert a == sorted(p.relative_to(drawn / "b") for p in (drawn / "b").rglob("*") if p.is_file())
    for p in a:
        assert (drawn / "a" / p).read_bytes() == (drawn / "b" / p).read_bytes()
    assert (drawn / "a/open/s77-001/r01.csv").read_bytes() != (drawn / "c/open/s78-001/r01.csv").read_bytes()


def test_the_hash_seals_every_label(drawn):
    h = label_hash(drawn / "a" / "truth")
    assert h == label_hash(drawn / "b" / "truth") and len(h) == 64
    f = drawn / "b" / "truth" / "s77-003.json"
    old = f.read_text()
    f.write_text(old.replace('"tier"', '"Tier"'))
    assert label_hash(drawn / "b" / "truth") != h
    f.write_text(old)
    assert label_hash(drawn / "b" / "truth") == h


def test_cases_are_recordings_1_and_labels_are_kept_apart(drawn):
    for case in sorted((drawn / "a" / "open").iterdir()):
        t = json.loads((drawn / "a" / "truth" / f"{case.name}.json").read_text())
        for key in ("missing", "kind", "tier", "strength", "origin", "acts", "oracle_misfit", "misfit_over_noise", "base_refit_r2", "base_refit_nrmse", "misfit_share"):
            assert key in t
        assert t["base_refit_r2"] > 0.99
        assert all(v in VOCABULARY or v.startswith("unknown:") for v in t["missing"])
        if t["tier"] in TIERS and len(t["missing"]) == 1:
            assert TIERS[t["tier"]][0] * 0.9 < t["misfit_over_noise"] < TIERS[t["tier"]][1] * 1.15
        c = tomllib.loads((case / "campaign.toml").read_text())
        assert c["format"] == "recordings/1" and c["campaign"]["kind"] == t["kind"]
        assert set(c["simulation"]) == {"terms", "k", "p", "mu_d"}
        if t["kind"] != "indentation":
            assert c["rig"]["moving_mass"] == pytest.approx(t["true_base"]["M"], rel=0.012)
        assert len(c["recording"]) == {"drop-test": 10, "contactor-opening": 9, "indentation": 8}[t["kind"]]
        assert [r["order"] for r in c["recording"]] == list(range(1, len(c["recording"]) + 1))
        for r in c["recording"]:
            a = table(case / r["file"])
            assert set(a) <= {"time", "force", "acceleration", "penetration"} and len(a) >= 3
            steps = np.diff(a["time"])
            assert np.allclose(steps, steps[0], rtol=1e-4) and a["time"][0] == 0
            assert all(np.isfinite(v).all() for v in a.values())
        text = (case / "campaign.toml").read_text() + (case / "r01.csv").read_text()
        assert not any(v in text.replace('"gravity"', "").replace('"hysteresis_damping"', "").replace("return_spring_rate", "") for v in VOCABULARY)


def test_the_judge_knows_right_from_wrong(drawn, tmp_path):
    names = {p.stem: json.loads(p.read_text()) for p in (drawn / "a" / "truth").glob("*.json")}
    for name, t in names.items():
        case = drawn / "a" / "open" / name
        answer = tmp_path / name
        for k in ("before", "after"):
            (answer / "predictions" / k).mkdir(parents=True)
            for f in files(case):
                (answer / "predictions" / k / f).write_bytes((case / f).read_bytes())
        assert distance(case, answer / "predictions" / "after") == 0.0
        unknown = any(x.startswith("unknown") for x in t["missing"])
        best = max(t["acts"], key=t["acts"].get)
        v = {"mismatch": {"detected": bool(t["missing"]), "where": [{"origin": (t["origin"] or ["contact"])[0], "phase": best}]},
             "missing": [] if unknown else [{"mechanism": x, "also_possible": [], "parameters": {}} for x in t["missing"]],
             "unexplained": {"detected": unknown}}
        (answer / "verdict.json").write_text(json.dumps(v))
        r = judge(case, t, answer)
        assert r["right"] and r["gain"] is None
        assert r["located"] in (True, None)
        v["missing"].append({"mechanism": "force_gain" if "force_gain" not in t["missing"] else "gravity", "also_possible": []})
        v["mismatch"]["detected"] = True
        if unknown:
            v["missing"].append({"mechanism": "adhesion"})
        (answer / "verdict.json").write_text(json.dumps(v))
        assert not judge(case, t, answer)["right"]
    (answer / "verdict.json").write_text("{")
    assert not judge(case, t, answer)["answered"]


def test_parameters_are_told_by_their_own_names():
    names = [k for k in dir(m) if k.isupper() and k not in m.COUNTS and isinstance(getattr(m, k), int)]
    assert len({getattr(m, k) for k in names}) == len(names)
    rig = rigs.draw(np.random.default_rng(1), "drop-test", hysteresis=False)
    rig.recs = [SimpleNamespace()]

    def damped(s, P, ch, r):
        P[m.MU] = 2.0 * s

    assert described(rig, [(dict(apply=damped), 3.0)]) == {"mu": 6.0}


def test_a_tie_held_open_counts():
    import pathlib
    import tempfile
    t = dict(missing=["lowpass_lag"], forms=["first-order"], strengths=[0.1], kind="drop-test", tier="deep", misfit_over_noise=0.5, acts={"loading": 1.0},
             origin=["chain"], oracle_misfit=0.01, true_effect={}, true_base={})
    with tempfile.TemporaryDirectory() as d:
        d = pathlib.Path(d)
        (d / "campaign.toml").write_text("recording = []\n")
        for also, right in ((["lowpass_lag"], True), ([], False)):
            (d / "verdict.json").write_text(json.dumps({"mismatch": {"detected": True}, "missing": [{"mechanism": "channel_skew", "also_possible": also}], "unexplained": {"detected": False}}))
            assert judge(d, t, d)["right"] is right


def test_binomial_band_covers():
    assert band(0, 10)[0] == 0.0 and band(10, 10)[1] == 1.0
    lo, hi = band(5, 10)
    assert lo == pytest.approx(0.1871, abs=1e-3) and hi == pytest.approx(0.8129, abs=1e-3)
