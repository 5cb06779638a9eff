//! A campaign made by the harness's own simulation with seeded noise: to try the diagnosis on, and to test it with.

use crate::chain::readings;
use crate::simulate::{simulate, Local, Setup};
use mechanisms::load_history::LoadHistory;
use mechanisms::physics::{Physics, GRAVITY};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::Path;

/// What the made campaign holds.
#[derive(Clone, Copy, Debug)]
pub struct Recipe {
    /// The physics the recordings follow.
    pub physics: Physics,
    /// Noise of force (N), acceleration (m/s^2) and penetration (m), standard deviations.
    pub noise: [f64; 3],
    /// Seed of noise, offsets and speeds.
    pub seed: u64,
    /// Whether the speeds given are those at touch, as the format has it; else those at the first sample.
    pub speed_at_touch: bool,
    /// Samples of a recording, and the time between them, s.
    pub samples: usize,
    pub interval: f64,
}

impl Default for Recipe {
    fn default() -> Self {
        let mut physics = Physics { mass: 0.5, gravity: GRAVITY, ..Physics::default() };
        physics.law.elastic.stiffness = 2.0e7;
        physics.law.elastic.exponent = 1.5;
        physics.law.hysteresis_damping.coefficient = 4.0e6;
        Recipe { physics, noise: [1.0, 2.0, 2e-6], seed: 1, speed_at_touch: false, samples: 700, interval: 1e-5 }
    }
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    // Box and Muller 1958
    let u: f64 = 1.0 - rng.random::<f64>();
    (-2.0 * u.ln()).sqrt() * (std::f64::consts::TAU * rng.random::<f64>()).cos()
}

/// Writes a drop-test campaign of five heights, two drops each, to `dir`. The simulation it declares holds gravity
/// and hysteresis damping, not calibrated.
///
/// # Errors
/// As the file system gives them.
pub fn write_campaign(dir: &Path, recipe: &Recipe) -> std::io::Result<()> {
    let mut rng = ChaCha8Rng::seed_from_u64(recipe.seed);
    let mut toml = String::from(
        "format = \"recordings/1\"\n\n[campaign]\nname = \"made by touchdown\"\nkind = \"drop-test\"\n\n[rig]\n",
    );
    toml += &format!(
        "moving_mass = {}   # kg\n\n[simulation]\nterms = [\"gravity\", \"hysteresis_damping\"]\n",
        recipe.physics.mass
    );
    let mut order = 0;
    for height in [0.005_f64, 0.01, 0.02, 0.04, 0.08] {
        for _ in 0..2 {
            order += 1;
            let nominal = (2.0 * GRAVITY * height).sqrt();
            let speed = nominal * (1.0 + 0.01 * normal(&mut rng));
            let start = 1e-3 * (0.8 + 0.4 * rng.random::<f64>());
            let time: Vec<f64> = (0..recipe.samples).map(|i| recipe.interval * i as f64).collect();
            let setup = Setup {
                history: LoadHistory::alike(f64::from(order) - 1.0),
                ..Setup::drop_test(time.clone(), 3e-4, speed, 2e-3)
            };
            let local = Local { start, speed, stiffness: 0.004 * normal(&mut rng), offset: 0.0 };
            let trace = simulate(&recipe.physics, &setup, &local);
            let y = readings(&recipe.physics, &trace, &time);
            let zero = [normal(&mut rng), normal(&mut rng), 2e-6 * normal(&mut rng)];
            let mut csv = String::from("time [s],force [N],acceleration [m/s^2],penetration [m]\n");
            for (i, t) in time.iter().enumerate() {
                csv += &format!("{t:.9e}");
                for c in 0..3 {
                    csv += &format!(",{:.6e}", y[c][i] + zero[c] + recipe.noise[c] * normal(&mut rng));
                }
                csv.push('\n');
            }
            let file = format!("r{order:02}.csv");
            output::write(&dir.join(&file), csv.as_bytes())?;
            toml += &format!(
                "\n[[recording]]\nfile = \"{file}\"\norder = {order}\ndrop_height = {height}   # m\nimpact_speed = {:.6}   # m/s\nimpact_speed_std = {:.6}   # m/s\n",
                if recipe.speed_at_touch { speed } else { trace.first_speed } * (1.0 + 0.004 * normal(&mut rng)),
                0.004 * nominal
            );
        }
    }
    output::write(&dir.join("campaign.toml"), toml.as_bytes())
}
