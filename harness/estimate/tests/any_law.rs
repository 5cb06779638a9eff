//! Properties of any law, and of the fit to recordings of any law.

use estimate::fitted::Fitted;
use estimate::prepare::Prepared;
use law::{Memory, Parameters};
use plant::recipe::{write_campaign, Recipe};
use proptest::prelude::*;
use proptest::test_runner::{Config, RngSeed};

fn config(cases: u32) -> Config {
    Config { cases, rng_seed: RngSeed::Fixed(1), failure_persistence: None, ..Config::default() }
}

fn any_law(k: f64, p: f64, mu_d: f64) -> Parameters {
    let mut law = Parameters::default();
    law.elastic.stiffness = k;
    law.elastic.exponent = p;
    law.hysteresis_damping.coefficient = mu_d;
    law
}

proptest! {
    #![proptest_config(config(512))]

    #[test]
    fn the_force_is_k_x_to_the_p_and_grows_with_depth_and_speed(
        ln_k in 3.0..20.0f64, p in 1.0..3.0f64, share in 0.0..1.0f64, ln_x in -14.0..-4.0f64, v in 0.0..5.0f64,
    ) {
        let (k, x) = (ln_k.exp(), ln_x.exp());
        let law = any_law(k, p, share * k);
        let m = Memory::default();
        let at_rest = law.force(&m, x, 0.0);
        prop_assert!((at_rest / (k * x.powf(p)) - 1.0).abs() < 1e-12, "{at_rest}");
        let moving = law.force(&m, x, v);
        prop_assert!((moving / (k * x.powf(p) * (1.0 + share * v)) - 1.0).abs() < 1e-12, "{moving}");
        prop_assert!(law.force(&m, 1.01 * x, v) > moving);
        prop_assert_eq!(law.force(&m, -x, v), 0.0);
        let (stiffness, damping) = law.derivatives(&m, x, v);
        let h = 1e-5 * x;
        let slope = (law.force(&m, x + h, v) - law.force(&m, x - h, v)) / (2.0 * h);
        prop_assert!((stiffness / slope - 1.0).abs() < 1e-6, "{stiffness} {slope}");
        prop_assert!((damping - share * k * x.powf(p)).abs() <= 1e-9 * k * x.powf(p), "{damping}");
    }
}

proptest! {
    #![proptest_config(config(6))]

    #[test]
    fn a_fit_finds_the_law_that_the_recordings_follow(ln_k in 16.0..17.5f64, p in 1.35..1.65f64, seed in 0..1000u64) {
        let mut recipe = Recipe { seed, ..Recipe::default() };
        let share = 0.2;
        recipe.physics.law = any_law(ln_k.exp(), p, share * ln_k.exp());
        let dir = tempfile::tempdir().unwrap();
        write_campaign(dir.path(), &recipe).unwrap();
        let campaign = record::load(dir.path(), &mechanisms::terms()).unwrap();
        let prepared = Prepared::new(&campaign).unwrap();
        let fit = Fitted::base(&prepared.data, &prepared.structure, &prepared.guess);
        let found = fit.physics().law;
        let force = |law: &Parameters| law.force(&Memory::default(), 3e-4, 0.0);
        let ratio = force(&found) / force(&recipe.physics.law);
        prop_assert!((found.elastic.exponent - p).abs() < 0.03, "{} {p}", found.elastic.exponent);
        prop_assert!((ratio - 1.0).abs() < 0.03, "{ratio}");
    }
}
