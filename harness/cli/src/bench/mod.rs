//! What things cost: our element beside an FMU that does nothing and beside the law called directly, our power beside
//! the platform's, the harness beside fmpy, a base fit beside the same in scipy, a diagnosis beside its limits.
//! Everything compared is measured in turn in the same run, in CPU time, so that a busy machine slows both sides alike.

pub mod calls;
mod clock;
pub mod diagnosis;
pub mod fit;
pub mod pow;
mod python;
mod scenario;
pub mod table;

pub use clock::{cpu_seconds, taken, wall_seconds, Taken};
pub use python::{Python, FMPY_SIDE};
pub use scenario::{drop_test, DropTest};

use anyhow::{bail, Context, Result};
use host::{Fmu, Instance};
use std::hint::black_box;
use std::io::Write;
use std::path::{Path, PathBuf};

const EMPTY: &str = include_str!("empty.c");
const EMPTY_DESCRIPTION: &str = r#"<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Empty" guid="{empty}">
  <CoSimulation modelIdentifier="empty" canHandleVariableCommunicationStepSize="true"/>
  <ModelVariables>
    <ScalarVariable name="penetration" valueReference="0" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="velocity" valueReference="1" causality="input"><Real start="0"/></ScalarVariable>
    <ScalarVariable name="force" valueReference="2" causality="output"><Real/></ScalarVariable>
  </ModelVariables>
  <ModelStructure><Outputs><Unknown index="3" dependencies="1 2"/></Outputs></ModelStructure>
</fmiModelDescription>
"#;

/// Least, middle and greatest of several rounds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spread {
    /// Least.
    pub min: f64,
    /// Median.
    pub median: f64,
    /// Greatest.
    pub max: f64,
}

impl Spread {
    /// Of figures; NaN of none.
    pub fn of(figures: impl IntoIterator<Item = f64>) -> Spread {
        let mut f: Vec<f64> = figures.into_iter().collect();
        f.sort_by(f64::total_cmp);
        let n = f.len();
        if n == 0 {
            return Spread { min: f64::NAN, median: f64::NAN, max: f64::NAN };
        }
        Spread { min: f[0], median: 0.5 * (f[(n - 1) / 2] + f[n / 2]), max: f[n - 1] }
    }
}

/// Two sides measured in turn: a round each.
#[derive(Clone, Debug, Default)]
pub struct Pair {
    /// (ours, theirs), the same unit.
    pub rounds: Vec<(f64, f64)>,
}

impl Pair {
    /// Ours.
    pub fn ours(&self) -> Spread {
        Spread::of(self.rounds.iter().map(|r| r.0))
    }

    /// Theirs.
    pub fn theirs(&self) -> Spread {
        Spread::of(self.rounds.iter().map(|r| r.1))
    }

    /// Ours over theirs, round by round.
    pub fn ratio(&self) -> Spread {
        Spread::of(self.rounds.iter().map(|r| r.0 / r.1))
    }

    /// Theirs over ours, round by round.
    pub fn gain(&self) -> Spread {
        Spread::of(self.rounds.iter().map(|r| r.1 / r.0))
    }
}

/// Packs the element into `folder`. Returns the file.
///
/// # Errors
/// As [`pack::into_folder`].
pub fn our_fmu(folder: &Path) -> Result<PathBuf> {
    pack::into_folder(folder, &[])
}

/// Compiles and packs the FMU that does nothing. Returns the file.
///
/// # Errors
/// No C compiler called cc, or the folder cannot be written.
pub fn empty_fmu(folder: &Path) -> Result<PathBuf> {
    let (source, library, out) = (folder.join("empty.c"), folder.join("empty.so"), folder.join("empty.fmu"));
    std::fs::write(&source, EMPTY)?;
    let done = std::process::Command::new("cc")
        .args(["-std=c99", "-O2", "-shared", "-fPIC", "-o"])
        .args([&library, &source])
        .output()
        .context("no C compiler called cc: install one (Debian: gcc)")?;
    if !done.status.success() {
        bail!("cc does not compile the empty FMU: {}", String::from_utf8_lossy(&done.stderr));
    }
    let mut zip = zip::ZipWriter::new(std::fs::File::create(&out)?);
    let files = [
        ("modelDescription.xml", EMPTY_DESCRIPTION.as_bytes().to_vec()),
        ("binaries/linux64/empty.so", std::fs::read(&library)?),
    ];
    for (name, bytes) in &files {
        zip.start_file(*name, zip::write::SimpleFileOptions::default())?;
        zip.write_all(bytes)?;
    }
    zip.finish()?;
    Ok(out)
}

/// Steps of `h` s through one impact and the next: a penetration that comes and goes, in contact half the time.
#[derive(Clone, Debug)]
pub struct Walk {
    /// Step, s.
    pub h: f64,
    inputs: Vec<[f64; 2]>,
}

impl Default for Walk {
    fn default() -> Self {
        let (h, depth) = (1e-5, 1e-4);
        let omega = 2.0 * std::f64::consts::PI / (500.0 * h);
        let at = |n: i32| {
            let phase = omega * h * f64::from(n);
            [depth * phase.sin(), depth * omega * phase.cos()]
        };
        Walk { h, inputs: (0..500).map(at).collect() }
    }
}

impl Walk {
    /// Points in contact: (penetration m, velocity m/s).
    pub fn touching(&self) -> Vec<(f64, f64)> {
        self.inputs[1..250].iter().map(|p| (p[0], p[1])).collect()
    }
}

/// Which part of the walk is stepped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Inputs {
    /// One point in contact, inputs set once: fmi2DoStep and fmi2GetReal alone.
    Held,
    /// Points in contact only, set before every step.
    Contact,
    /// All of it, set before every step.
    Moving,
}

/// An instance that walks.
pub struct Walker {
    instance: Instance,
    references: [u32; 3],
    walk: Walk,
    done: u64,
}

impl Walker {
    /// An instance of `fmu`, with those parameters, ready to step.
    ///
    /// # Errors
    /// No penetration, velocity, force or parameter of that name, or the FMU refuses.
    pub fn new(fmu: &Fmu, parameters: &[(&str, f64)]) -> Result<Walker> {
        let find = |name: &str| {
            let v = fmu.description().variable(name);
            v.map(|v| v.value_reference).with_context(|| format!("{} has no {name}", fmu.path().display()))
        };
        let references = [find("penetration")?, find("velocity")?, find("force")?];
        let mut instance = fmu.instantiate("bench", false)?;
        for (name, value) in parameters {
            instance.set_real(&[find(name)?], &[*value])?;
        }
        instance.setup_experiment(None, 0.0, None)?;
        instance.enter_initialization()?;
        instance.exit_initialization()?;
        Ok(Walker { instance, references, walk: Walk::default(), done: 0 })
    }

    /// Nanoseconds of CPU time a step over `steps` steps.
    ///
    /// # Errors
    /// Where the FMU refuses.
    pub fn walk(&mut self, steps: usize, inputs: Inputs) -> Result<f64> {
        self.walk_by(cpu_seconds, steps, inputs)
    }

    /// As [`Walker::walk`], by a clock in seconds.
    ///
    /// # Errors
    /// Where the FMU refuses.
    pub fn walk_by(&mut self, clock: fn() -> f64, steps: usize, inputs: Inputs) -> Result<f64> {
        let [x, v, f] = self.references;
        let h = self.walk.h;
        // the first half of the walk is in contact; its very first point only touches
        let points = match inputs {
            Inputs::Held => &self.walk.inputs[100..101],
            Inputs::Contact => &self.walk.inputs[1..250],
            Inputs::Moving => &self.walk.inputs[..],
        };
        self.instance.set_real(&[x, v], &points[0])?;
        let mut sum = 0.0;
        let mut point = 0;
        let start = clock();
        for _ in 0..steps {
            if inputs != Inputs::Held {
                self.instance.set_real(&[x, v], &points[point])?;
                point += 1;
                if point == points.len() {
                    point = 0;
                }
            }
            self.instance.do_step(self.done as f64 * h, h)?;
            self.done += 1;
            sum += self.instance.real(f)?;
        }
        let ns = (clock() - start) * 1e9 / steps as f64;
        black_box(sum);
        Ok(ns)
    }
}

/// Laws measured: name, exponent.
pub const LAWS: [(&str, f64); 2] = [("p = 1.5", 1.5), ("p = 2.79", 2.79)];

/// Parameters of a law measured.
pub fn parameters(exponent: f64) -> [(&'static str, f64); 3] {
    [("stiffness", 1e8), ("exponent", exponent), ("hysteresis_damping", 3e7)]
}

/// Our step beside an empty FMU's, ns, `rounds` times in turn; `done` is called after each.
///
/// # Errors
/// Where an FMU refuses.
pub fn against_empty(
    ours: &Fmu,
    empty: &Fmu,
    exponent: f64,
    inputs: Inputs,
    rounds: usize,
    steps: usize,
    mut done: impl FnMut(),
) -> Result<Pair> {
    let mut ours = Walker::new(ours, &parameters(exponent))?;
    let mut empty = Walker::new(empty, &[])?;
    ours.walk(steps / 10, inputs)?;
    empty.walk(steps / 10, inputs)?;
    let mut pair = Pair::default();
    for _ in 0..rounds {
        pair.rounds.push((ours.walk(steps, inputs)?, empty.walk(steps, inputs)?));
        done();
    }
    Ok(pair)
}

/// A step of an FMU in a process of its own beside one in ours, ns of the wall, `rounds` times in turn.
///
/// # Errors
/// Where the FMU refuses, or its process does.
pub fn apart_against_here(apart: &Fmu, here: &Fmu, rounds: usize, steps: usize) -> Result<Pair> {
    let (mut apart, mut here) = (Walker::new(apart, &[])?, Walker::new(here, &[])?);
    let mut pair = Pair::default();
    for round in 0..=rounds {
        let ns = |w: &mut Walker| w.walk_by(wall_seconds, steps, Inputs::Moving);
        let both = (ns(&mut apart)?, ns(&mut here)?);
        if round > 0 {
            pair.rounds.push(both);
        }
    }
    Ok(pair)
}

/// Our stepping loop beside fmpy's, ns a step, `rounds` times in turn: (its loop of setReal, doStep, getReal; its
/// simulate_fmu).
///
/// # Errors
/// Where an FMU or Python refuses.
pub fn against_fmpy(ours: &Fmu, python: &mut Python, rounds: usize, mut done: impl FnMut()) -> Result<(Pair, Pair)> {
    const OURS: usize = 200_000;
    const THEIRS: usize = 5_000;
    let mut walker = Walker::new(ours, &parameters(1.5))?;
    let (mut looped, mut simulated) = (Pair::default(), Pair::default());
    for _ in 0..rounds {
        let ns = walker.walk(OURS, Inputs::Moving)?;
        looped.rounds.push((ns, python.ask(&format!("loop {THEIRS}"))?[0] * 1e9));
        simulated.rounds.push((ns, python.ask(&format!("simulate {THEIRS}"))?[0] * 1e9));
        done();
    }
    Ok((looped, simulated))
}

/// Our doStep and getReal beside an empty FMU's, both through fmpy, ns, `rounds` times in turn.
///
/// # Errors
/// Where Python refuses.
pub fn against_empty_in_fmpy(python: &mut Python, rounds: usize) -> Result<Pair> {
    const STEPS: usize = 5_000;
    let mut pair = Pair::default();
    for _ in 0..rounds {
        let ours = python.ask(&format!("step {STEPS}"))?[0] * 1e9;
        pair.rounds.push((ours, python.ask(&format!("empty {STEPS}"))?[0] * 1e9));
    }
    Ok(pair)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_spread_is_least_middle_and_greatest() {
        assert_eq!(Spread::of([3.0, 1.0, 2.0]), Spread { min: 1.0, median: 2.0, max: 3.0 });
        assert_eq!(Spread::of([4.0, 1.0, 2.0, 3.0]).median, 2.5);
        assert!(Spread::of([]).median.is_nan());
        let p = Pair { rounds: vec![(2.0, 4.0), (1.0, 5.0)] };
        assert_eq!((p.ratio().min, p.gain().max), (0.2, 5.0));
    }

    #[test]
    fn the_empty_fmu_hands_back_what_it_was_given() {
        let dir = tempfile::TempDir::new().unwrap();
        let fmu = Fmu::open(&empty_fmu(dir.path()).unwrap()).unwrap();
        let mut w = Walker::new(&fmu, &[]).unwrap();
        assert!(w.walk(3, Inputs::Contact).unwrap() > 0.0);
        assert_eq!(w.instance.real(2).unwrap(), w.walk.inputs[3][0]);
        assert!(Walker::new(&fmu, &[("stiffness", 1.0)]).is_err());
    }

    #[test]
    fn the_walk_is_a_motion() {
        let w = Walk::default();
        for n in 1..w.inputs.len() {
            let [x0, v0] = w.inputs[n - 1];
            let [x1, v1] = w.inputs[n];
            assert!(((x1 - x0) / w.h - 0.5 * (v0 + v1)).abs() < 1e-4 * 0.13);
        }
        assert!(w.inputs[1..250].iter().all(|p| p[0] > 0.0));
    }
}
