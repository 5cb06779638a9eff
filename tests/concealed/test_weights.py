"""The table of probabilities: its posterior, its loss, and its fit on made-up evidence."""
import numpy as np

from tests.concealed import calibration as c
from tests.concealed import weights as w


def verdict(rng, strength=30.0):
    """(verdict, cause) with one of three causes ahead by `strength` nats at most, more often than not the true one."""
    ln = {"": 0.0, "gravity": 0.0, "unknown": -8.0}
    cause = str(rng.choice(list(ln)))
    for name in ln:
        ln[name] += rng.normal(0.0, 4.0) + (rng.uniform(0.0, strength) if name == cause else 0.0)
    structure = lambda names, value: dict(mechanisms=names, forms=names, named=True, at_bound=False, heldout_nrmse=None, overdispersion=4.0, overdispersion_left=1.1,
                                          parameters=2 * len(names),
                                          ln_evidence=[value] * 6, ln_evidence_drifting=[value - 200.0] * 6)
    v = {"fit": {"before": {"heldout_nrmse": 0.01}},
         "evidence": {"sizes": [0.0, 0.001, 0.003, 0.01, 0.03, 0.1], "own_sizes": [0.01, 0.03, 0.1, 0.3], "levels": 4, "flat": 0.0,
                      "structures": [structure([], ln[""]), structure(["gravity"], ln["gravity"])],
                      "unknown": [{"beside": [], "place": "", "ln_evidence": [ln["unknown"]]}]}}
    return v, frozenset({cause} - {""})


def cases(n, seed):
    rng = np.random.default_rng(seed)
    return [(w.features(v), cause, 1.0) for v, cause in (verdict(rng) for _ in range(n))]


def test_the_flat_arrays_give_the_loss_of_the_posterior():
    some = cases(20, 1)
    for theta in (w.START, w.START + 0.3 * np.sin(np.arange(len(w.START)))):
        plain = np.mean([-np.log(max(w.posterior(f, theta).get(c, 0.0), w.LEAST)) for f, c, _ in some])
        penalty = 0.5 * np.sum(((theta - w.START) / w.WIDTH) ** 2) / len(some)
        assert abs(w.Stacked(some).loss(theta) - plain - penalty) < 1e-12


def test_probabilities_fitted_are_as_often_right_as_they_say():
    theta = w.fit(cases(300, 2))
    top = [max(w.posterior(f, theta).items(), key=lambda kv: kv[1]) + (c,) for f, c, _ in cases(400, 3)]
    said, right = np.mean([p for _, p, _ in top]), np.mean([h == c for h, _, c in top])
    assert abs(said - right) < 0.05 and right > 0.6, (said, right)


def test_sets_hold_the_cause_as_often_as_asked():
    theta = w.fit(cases(300, 4))
    level = w.level(cases(300, 5), theta)
    held = [c in w.credible(w.posterior(f, theta), level) for f, c, _ in cases(400, 6)]
    assert np.mean(held) > 0.91, np.mean(held)


def test_names_that_nobody_parts_are_one_cause():
    assert w.canonical(["lowpass_lag"]) == w.canonical(["channel_skew"]) == frozenset({"channel_skew"})
    assert w.canonical(["return_spring", "clipping"]) == frozenset({"gravity", "clipping"})
    assert w.cause({"missing": ["unknown:hum"]}) == w.UNKNOWN and w.cause({"missing": []}) == w.NOTHING


def test_what_predicts_better_counts_more_and_what_predicts_worse_or_rests_at_a_bound_counts_less():
    v, _ = verdict(np.random.default_rng(7))
    plain = w.posterior(w.features(v), w.START)[frozenset({"gravity"})]
    v["evidence"]["structures"][1]["heldout_nrmse"] = 0.002
    assert w.posterior(w.features(v), w.START)[frozenset({"gravity"})] > plain
    v["evidence"]["structures"][1]["heldout_nrmse"] = 0.02
    worse = w.posterior(w.features(v), w.START)[frozenset({"gravity"})]
    v["evidence"]["structures"][1]["at_bound"] = True
    assert w.posterior(w.features(v), w.START)[frozenset({"gravity"})] < worse < plain


def test_every_parameter_more_has_its_weight():
    v, _ = verdict(np.random.default_rng(8))
    of = lambda weight: w.posterior(w.features(v), w.START + np.array([weight * (k == "parameter") for k in w.PARAMETERS]))[frozenset({"gravity"})]
    assert of(-1.0) < of(0.0)


def test_every_group_counts_by_its_share_whatever_was_drawn_of_it():
    of = lambda group, n, names: [("case", None, frozenset(names), group)] * n
    drawn = of("mix", 8, ["gravity"]) + of("mix", 2, ["adhesion", "gravity"]) + of("strangers", 3, ["unknown"]) + of("sealed", 5, ["unknown"])
    weights = [weight for _, _, weight in c.with_weights(drawn)]
    assert abs(np.mean(weights) - 1.0) < 1e-12
    sums = {"mix": sum(weights[:8]), "pairs": sum(weights[8:10]), "strangers": sum(weights[10:])}
    for group, total in sums.items():
        assert abs(total / sums["mix"] - c.SHARES[group] / c.SHARES["mix"]) < 1e-12, (group, sums)


def table(**changed):
    return np.array([changed.get(k, v[0]) for k, v in w.PARAMETERS.items()])


def test_a_small_discrepancy_of_each_recordings_own_beside_a_name_counts_for_it():
    v, _ = verdict(np.random.default_rng(8))
    v["evidence"]["unknown"] = [{"beside": ["gravity"], "place": "", "ln_evidence": [60.0] * 4}]
    gravity = lambda own_known: w.posterior(w.features(v), table(own_known=own_known))[frozenset({"gravity"})]
    assert gravity(0.0) > 0.2 and gravity(0.0) > 2 * gravity(-60.0), (gravity(0.0), gravity(-60.0))


def test_instruments_that_explain_very_much_are_likelier_an_unknown_cause():
    t = dict(zip(w.PARAMETERS, w.START), disturbed=-0.5)

    def unknown(explained):
        v, _ = verdict(np.random.default_rng(7))
        for s in v["evidence"]["structures"]:
            s["ln_evidence_drifting"] = [x + explained for x in s["ln_evidence"]]
        f = w.features(v)
        assert w.disturbed(f[2])[w.NOTHING] == np.log1p(max(explained, 0.0))
        return [w.posterior(f, np.array(list(theta.values())))[w.UNKNOWN] for theta in (t, {**t, "disturbed": 0.0})]

    assert unknown(5000.0)[0] > 3 * unknown(5000.0)[1]
    assert abs(np.subtract(*unknown(-10.0))) < 1e-12


def test_a_flat_top_speaks_for_clipping():
    v, _ = verdict(np.random.default_rng(9))
    other = dict(v["evidence"]["structures"][1], mechanisms=["clipping"])
    v["evidence"]["structures"].append(other)

    def odds(flat):
        v["evidence"]["flat"] = flat
        p = w.posterior(w.features(v), table(flat=2.0))
        return p[frozenset({"clipping"})] / p[frozenset({"gravity"})]

    assert abs(odds(0.0) - 1.0) < 1e-9 and abs(odds(9.0) - np.exp(2.0)) < 1e-6


def test_a_large_discrepancy_that_leaves_much_is_likelier_of_an_unknown_cause():
    v, _ = verdict(np.random.default_rng(11))
    structure = v["evidence"]["structures"][1]
    structure["ln_evidence"] = [None] * 5 + [60.0]

    def unknown(overdispersion):
        structure["overdispersion"] = overdispersion
        return w.posterior(w.features(v), table(large=0.0, large_known=0.0, large_left=1.0, large_known_left=-1.0))[w.UNKNOWN]

    assert unknown(1.0) < unknown(2.0) < unknown(8.0), (unknown(1.0), unknown(2.0), unknown(8.0))


def test_what_is_part_of_an_explanation_that_works_is_likelier_than_what_is_not():
    v, _ = verdict(np.random.default_rng(12))
    of = v["evidence"]["structures"]
    rival = dict(of[1], mechanisms=["adhesion"])
    pair = dict(of[1], mechanisms=["gravity", "viscous_damping"], ln_evidence=[x + 19.0 for x in of[1]["ln_evidence"]])
    of += [rival, pair]

    def odds(completed):
        p = w.posterior(w.features(v), table(completed=completed))
        return p[w.canonical(["gravity"])] / p[w.canonical(["adhesion"])]

    assert abs(odds(0.0) - 1.0) < 1e-9 and abs(odds(0.5) - np.sqrt(20.0)) < 1e-6, (odds(0.0), odds(0.5))


def test_what_is_a_reason_for_doubt_never_speaks_for_a_name():
    theta = dict(zip(w.PARAMETERS, w.fit(cases(100, 10))))
    assert all((lower is None or theta[k] >= lower) and (upper is None or theta[k] <= upper) for k, (lower, upper) in w.BOUNDS.items())
