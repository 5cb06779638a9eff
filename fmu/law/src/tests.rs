use super::*;

fn all() -> Parameters {
    let values = [
        ("stiffness", 2e8),
        ("exponent", 1.7),
        ("hysteresis_damping", 3e7),
        ("viscous_damping", 4.0),
        ("viscous_ramp", 2e-4),
        ("yield_penetration", 1e-4),
        ("plastic_ratio", 0.2),
        ("adhesion_force", 3.0),
        ("adhesion_range", 5e-5),
        ("relaxation_stiffness", 5e7),
        ("secondary_stiffness", 1e8),
        ("secondary_depth", 4e-4),
    ];
    Parameters::from_names(values).unwrap()
}

#[test]
fn the_power_law_and_its_damping_are_exact() {
    let p = Parameters::power_law(3.0, 2.0, 5.0);
    assert_eq!(p.force(&Memory::default(), 0.5, 2.0), 3.0 * 0.25 + 5.0 * 0.25 * 2.0);
    assert_eq!(p.force(&Memory::default(), 0.5, -2.0), 0.0);
    assert_eq!(p.force(&Memory::default(), -0.5, 2.0), 0.0);
}

#[test]
fn derivatives_agree_with_differences_of_the_force() {
    for (form, depth) in [(0, 0.0), (1, 0.0), (2, 0.0), (3, 0.0), (4, 0.0), (1, 2e-4), (3, 2e-4)] {
        let mut p = all();
        (p.adhesion.form, p.adhesion.depth) = (form, depth);
        let m = Memory { deepest: 9e-4, relaxation: [1.0, 2.0, 0.5], ..Memory::default() };
        for x in [5e-5, 2.5e-4, 6e-4, 8.9e-4] {
            for v in [-0.3, 0.4] {
                let (fx, fv) = p.derivatives(&m, x, v);
                let (hx, hv) = (1e-9, 1e-6);
                let dx = (p.force(&m, x + hx, v) - p.force(&m, x - hx, v)) / (2.0 * hx);
                let dv = (p.force(&m, x, v + hv) - p.force(&m, x, v - hv)) / (2.0 * hv);
                assert!((fx - dx).abs() < 1e-5 * (1.0 + dx.abs()), "{form} {x} {v}: {fx} {dx}");
                assert!((fv - dv).abs() < 1e-6 * (1.0 + dv.abs()), "{form} {x} {v}: {fv} {dv}");
            }
        }
    }
}

#[test]
fn never_pulls_without_adhesion_and_pulls_with_it() {
    let mut p = all();
    p.adhesion.force = 0.0;
    let m = Memory { deepest: 9e-4, ..Memory::default() };
    for i in 0..200 {
        let x = 1e-3 * f64::from(i) / 200.0 - 1e-4;
        assert!(p.force(&m, x, -3.0) >= 0.0);
    }
    let mut q = all();
    q.adhesion.form = 1;
    assert!(q.force(&m, -1e-5, -0.1) < -1.0);
}

#[test]
fn an_elastic_path_stores_all_and_gives_all_back() {
    let p = Parameters::power_law(2e6, 1.5, 0.0);
    let mut m = Memory::default();
    let n = 2000;
    let at = |i: i32| 1e-3 * (std::f64::consts::PI * f64::from(i) / f64::from(n)).sin();
    let mut top: f64 = 0.0;
    for i in 0..n {
        m = p.advance(&m, at(i), 0.0, at(i + 1), 0.0, 1e-5);
        top = top.max(m.stored);
    }
    assert!((top - 2e6 * 1e-3f64.powf(2.5) / 2.5).abs() < 1e-6 * top);
    assert!(m.stored.abs() < 1e-9 * top && m.dissipated().abs() < 1e-6 * top, "{m:?}");
}

#[test]
fn out_of_range_parameters_are_named() {
    let e = Parameters::from_names([("plastic_ratio", 1.5)]).unwrap().validate().unwrap_err();
    assert_eq!(e.name, "plastic_ratio");
    assert_eq!(e.to_string(), "plastic_ratio is 1.5: give 0 to below 1");
    assert!(Parameters::power_law(f64::NAN, 1.5, 0.0).validate().is_err());
    assert_eq!(Parameters::from_names([("plastic_ration", 0.5)]), None);
    assert!(Parameters::default().validate().is_ok() && all().validate().is_ok());
}
