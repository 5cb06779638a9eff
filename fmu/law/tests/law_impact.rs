//! The exact impact against 50-digit answers, against slow integrations of the law itself, and the other
//! families with exact answers.

use law::impact::{impact, Impact};
use law::reference::{linear_spring_dashpot, walton_braun};
use law::{Memory, Parameters};

fn close(what: &str, a: f64, b: f64, tol: f64) {
    let gap = (a - b).abs();
    assert!(gap <= tol * b.abs(), "{what}: {a:.17e} against {b:.17e}: {:.1e}", gap / b.abs());
}

/// (d, p, [deepest, restitution, peak force, duration, energy lost, impulse]) for m = v0 = k = 1, computed with
/// mpmath 1.3 at 50 digits from the equations by its own quadrature and root finders.
#[allow(clippy::excessive_precision, clippy::type_complexity, clippy::approx_constant)]
const GOLDEN: [(f64, f64, [f64; 6]); 18] = [
    (0.0, 1.5, [1.0933620739432781, 1.0, 1.1432626298183159, 3.2180654597190431, 0.0, 2.0]),
    (
        1e-09,
        1.0,
        [
            9.9999999966666667e-1,
            9.9999999933333333e-1,
            9.9999999966666667e-1,
            3.1415926535897932,
            6.66666666e-10,
            1.9999999993333333,
        ],
    ),
    (
        1e-06,
        2.79,
        [
            1.1837165982802376,
            9.9999933333377778e-1,
            1.6008888778119748,
            3.140501247390079,
            6.6666600000062222e-7,
            1.9999993333337778,
        ],
    ),
    (
        0.001,
        1.5,
        [
            1.093070670975209,
            9.9933377745210843e-1,
            1.1428060824210315,
            3.2182800641194985,
            6.6600062164990992e-4,
            1.9993337774521084,
        ],
    ),
    (
        0.05,
        4.0,
        [
            1.1933045254269272,
            9.677385785309325e-1,
            2.0292390961911277,
            3.0418644055626736,
            3.17410218114651e-2,
            1.9677385785309325,
        ],
    ),
    (
        0.3,
        1.0,
        [
            9.1452155715444939e-1,
            8.3286979226560167e-1,
            9.4761342599031027e-1,
            3.151453316738738,
            1.5316395456572676e-1,
            1.8328697922656017,
        ],
    ),
    (
        0.49,
        1.5,
        [
            9.7963108076595856e-1,
            7.5227348333383408e-1,
            1.0387993841016401,
            3.3356483967463827,
            2.1704230313638983e-1,
            1.7522734833338341,
        ],
    ),
    (
        0.51,
        2.2,
        [
            1.0598251467586209,
            7.4463247910237508e-1,
            1.2130012049205767,
            3.4051416860386692,
            2.2276123553292547e-1,
            1.7446324791023751,
        ],
    ),
    (
        0.99,
        1.96,
        [
            9.6923839349471979e-1,
            5.9614711037883495e-1,
            1.1273636032904859,
            3.58001671918451,
            3.2230431139348259e-1,
            1.5961471103788349,
        ],
    ),
    (
        1.01,
        3.0,
        [
            1.0515890786606689,
            5.9112022623769763e-1,
            1.3774802514463048,
            3.6492515926748903,
            3.2528843906634658e-1,
            1.5911202262376976,
        ],
    ),
    (
        2.0,
        4.0,
        [
            1.0241517919166886,
            0.41071968606103945,
            1.5988337558434701,
            4.2424236749408644,
            0.4156546697409606,
            1.4107196860610394,
        ],
    ),
    (
        5.0,
        1.5,
        [
            6.3460979124335751e-1,
            0.19698024528051889,
            1.3325895033664595,
            4.7978629204156173,
            0.48059939148461331,
            1.1969802452805189,
        ],
    ),
    (
        12.0,
        1.0,
        [
            3.6199774866048053e-1,
            0.083330884571186262,
            2.02444306251397,
            5.4018797830337675,
            0.49652798183829182,
            1.0833308845711863,
        ],
    ),
    (
        20.0,
        2.5,
        [
            5.7974062849781969e-1,
            0.049999999203831142,
            1.8677669156741189,
            12.880613319426046,
            0.49875000003980844,
            1.0499999992038311,
        ],
    ),
    (
        35.0,
        4.0,
        [
            6.6312941209192022e-1,
            2.8571428571428333e-2,
            2.187798267051802,
            2.4496629935904031e+1,
            4.9959183673469388e-1,
            1.0285714285714283,
        ],
    ),
    (50.0, 1.0, [1.9197536168430713e-1, 2.0e-2, 3.9174980875568597, 1.0240252114698176e+1, 4.998e-1, 1.02]),
    (50.0, 1.5, [2.9198490557860209e-1, 2.0e-2, 2.9236893859877895, 1.5448082540041721e+1, 4.998e-1, 1.02]),
    (50.0, 4.0, [6.2070636595514472e-1, 2.0e-2, 2.3351358960076152, 3.2272604941693939e+1, 4.998e-1, 1.02]),
];

#[test]
fn the_impact_is_exact_to_1e_12_from_no_damping_to_fifty_and_from_p_1_to_4() {
    for (d, p, g) in GOLDEN {
        let i = impact(1.0, 1.0, 1.0, p, d).unwrap();
        let at = |name: &str| format!("{name} at d {d} p {p}");
        close(&at("deepest"), i.deepest, g[0], 1e-12);
        close(&at("restitution"), i.restitution, g[1], 1e-12);
        close(&at("peak force"), i.peak_force, g[2], 1e-12);
        close(&at("duration"), i.duration, g[3], 1e-12);
        close(&at("energy lost"), i.energy_lost, g[4], 1e-12);
        close(&at("impulse"), i.impulse, g[5], 1e-12);
    }
}

#[test]
fn mass_speed_and_stiffness_only_scale_the_impact() {
    for (d, p, g) in GOLDEN {
        let (m, v0, k) = (0.37, 2.9, 4.1e7);
        let i = impact(m, v0, k, p, d * k / v0).unwrap();
        let length = (m * v0 * v0 / k).powf(1.0 / (p + 1.0));
        close("deepest", i.deepest, length * g[0], 2e-12);
        close("duration", i.duration, length / v0 * g[3], 2e-12);
        close("peak force", i.peak_force, m * v0 * v0 / length * g[2], 2e-12);
        close("energy lost", i.energy_lost, m * v0 * v0 * g[4], 2e-12);
        close("impulse", i.impulse, m * v0 * g[5], 2e-12);
    }
}

/// Integrates m x'' = -F with the law's own force and memory by the classical Runge-Kutta rule in `n` steps a
/// `duration`, until the body is out or, if `until_free`, until the force has come to nothing on the way.
fn integrate(p: &Parameters, m: f64, v0: f64, duration: f64, n: u32, until_free: bool) -> (Impact, Memory) {
    let h = duration / f64::from(n);
    let (mut x, mut v, mut t) = (0.0f64, v0, 0.0);
    let mut mem = Memory::default();
    let (mut deepest, mut peak) = (0.0f64, 0.0f64);
    // the virgin contact's right limit at touch, where a dashpot already pushes
    let a = |mem: &Memory, x: f64, v: f64| -p.force(mem, x.max(1e-300), v) / m;
    for step in 0..20 * n {
        let (a1, b1) = (v, a(&mem, x, v));
        let (a2, b2) = (v + 0.5 * h * b1, a(&mem, x + 0.5 * h * a1, v + 0.5 * h * b1));
        let (a3, b3) = (v + 0.5 * h * b2, a(&mem, x + 0.5 * h * a2, v + 0.5 * h * b2));
        let (a4, b4) = (v + h * b3, a(&mem, x + h * a3, v + h * b3));
        let nx = x + h / 6.0 * (a1 + 2.0 * a2 + 2.0 * a3 + a4);
        let nv = v + h / 6.0 * (b1 + 2.0 * b2 + 2.0 * b3 + b4);
        let next = p.advance(&mem, x, v, nx, nv, h);
        if step > 0 && nv < 0.0 && (nx <= 0.0 || until_free && p.force(&mem, nx, nv) <= 0.0) {
            // leaving the surface is found on the straight line through the last two values
            let s = if nx <= 0.0 { x / (x - nx) } else { 1.0 };
            let e = -nv / v0;
            let i = Impact {
                deepest,
                restitution: e,
                peak_force: peak,
                duration: t + s * h,
                energy_lost: 0.5 * m * v0 * v0 * (1.0 - e * e),
                impulse: m * v0 * (1.0 + e),
            };
            return (i, next);
        }
        mem = next;
        x = nx;
        v = nv;
        t += h;
        deepest = deepest.max(x);
        peak = peak.max(p.force(&mem, x, v));
    }
    panic!("the body never left");
}

const MASS: f64 = 0.7;
const SPEED: f64 = 1.3;
const STIFFNESS: f64 = 4e6;
const ENERGY: f64 = 0.5 * MASS * SPEED * SPEED;

#[test]
fn slow_integration_of_the_law_agrees_with_the_exact_impact_and_its_heat_with_the_energy_lost() {
    for (d, p) in [(0.0, 1.5), (0.3, 1.5), (2.0, 1.0), (0.77, 2.79), (5.0, 2.0)] {
        let mu = d * STIFFNESS / SPEED;
        let exact = impact(MASS, SPEED, STIFFNESS, p, mu).unwrap();
        let law = Parameters::power_law(STIFFNESS, p, mu);
        let (i, mem) = integrate(&law, MASS, SPEED, exact.duration, 50_000, false);
        let at = |name: &str| format!("{name} at d {d} p {p}");
        close(&at("deepest"), i.deepest, exact.deepest, 1e-8);
        close(&at("peak force"), i.peak_force, exact.peak_force, 1e-8);
        close(&at("restitution"), i.restitution, exact.restitution, 1e-7);
        close(&at("duration"), i.duration, exact.duration, 1e-4);
        close(&at("impulse"), i.impulse, exact.impulse, 1e-7);
        close(&at("heat and the rest"), ENERGY - mem.dissipated(), ENERGY - exact.energy_lost, 1e-6);
        assert_eq!(mem.stored, 0.0);
    }
}

#[test]
fn a_spring_and_dashpot_that_cannot_pull_leaves_as_schwager_and_poeschel_say() {
    for zeta in [0.0, 0.05, 0.3, 0.6, 0.9] {
        let c = 2.0 * zeta * (STIFFNESS * MASS).sqrt();
        let exact = linear_spring_dashpot(MASS, SPEED, STIFFNESS, c).unwrap();
        let mut law = Parameters::power_law(STIFFNESS, 1.0, 0.0);
        law.viscous_damping.coefficient = c;
        let (i, mem) = integrate(&law, MASS, SPEED, exact.duration, 50_000, true);
        let at = |name: &str| format!("{name} at zeta {zeta}");
        close(&at("deepest"), i.deepest, exact.deepest, 1e-8);
        close(&at("peak force"), i.peak_force, exact.peak_force, 1e-4);
        close(&at("restitution"), i.restitution, exact.restitution, 1e-7);
        close(&at("duration"), i.duration, exact.duration, 1e-4);
        close(&at("kinetic energy and work"), ENERGY - mem.work, ENERGY - exact.energy_lost, 1e-6);
    }
    assert!(linear_spring_dashpot(1.0, 1.0, 1.0, 2.0).is_none());
}

#[test]
fn walton_and_braun_leave_with_the_root_of_the_ratio_of_stiffnesses() {
    for ratio in [0.0, 0.2, 0.5, 0.9] {
        let exact = walton_braun(MASS, SPEED, STIFFNESS, ratio).unwrap();
        let mut law = Parameters::power_law(STIFFNESS, 1.0, 0.0);
        (law.plastic_indentation.ratio, law.plastic_indentation.form) = (ratio, 1);
        let (i, mem) = integrate(&law, MASS, SPEED, exact.duration, 50_000, true);
        let at = |name: &str| format!("{name} at ratio {ratio}");
        close(&at("deepest"), i.deepest, exact.deepest, 1e-8);
        close(&at("peak force"), i.peak_force, exact.peak_force, 1e-8);
        close(&at("restitution"), i.restitution, exact.restitution, 1e-6);
        close(&at("duration"), i.duration, exact.duration, 1e-4);
        close(&at("energy left"), ENERGY - mem.dissipated(), ENERGY - exact.energy_lost, 1e-6);
    }
    assert!(walton_braun(1.0, 1.0, 1.0, 1.0).is_none());
}
