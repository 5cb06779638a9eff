//! fixtures/machine.c as FMUs that are not ours, and recordings of the machine that they leave an effect out of.

use rand::{RngExt, SeedableRng};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;
use tempfile::TempDir;

/// The library compiled with definitions, once a process.
fn library(defines: &[&str]) -> PathBuf {
    static BUILT: Mutex<Option<TempDir>> = Mutex::new(None);
    let mut built = BUILT.lock().unwrap_or_else(std::sync::PoisonError::into_inner);
    let out = built.get_or_insert_with(|| TempDir::new().unwrap()).path().join(format!("{}.so", defines.join("_")));
    if !out.exists() {
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fixtures/machine.c");
        let done = Command::new("cc")
            .args(["-std=gnu99", "-O2", "-Wall", "-Wextra", "-shared", "-fPIC", "-o"])
            .args([&out, &source])
            .args(defines.iter().map(|d| format!("-D{d}")))
            .arg("-lm")
            .output()
            .expect("a C compiler called cc");
        assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    }
    out
}

const UNITS: &str = r#"<UnitDefinitions>
    <Unit name="m"><BaseUnit m="1"/></Unit><Unit name="m/s"><BaseUnit m="1" s="-1"/></Unit>
    <Unit name="m/s2"><BaseUnit m="1" s="-2"/></Unit><Unit name="kg"><BaseUnit kg="1"/></Unit>
    <Unit name="N"><BaseUnit kg="1" m="1" s="-2"/></Unit><Unit name="N/m"><BaseUnit kg="1" s="-2"/></Unit>
  </UnitDefinitions>"#;

/// A variable: name, reference, causality, unit (none where empty), start (none where empty).
type Variable = (&'static str, u32, &'static str, &'static str, &'static str);

const INPUTS: [Variable; 2] = [("force_a", 0, "input", "N", "0"), ("force_b", 1, "input", "N", "0")];
const MOTION: [Variable; 6] = [
    ("x_a", 2, "output", "m", ""),
    ("v_a", 3, "output", "m/s", ""),
    ("a_a", 4, "output", "m/s2", ""),
    ("x_b", 5, "output", "m", ""),
    ("v_b", 6, "output", "m/s", ""),
    ("a_b", 7, "output", "m/s2", ""),
];
const STOPS: [Variable; 8] = [
    ("stop_a", 8, "output", "N", ""),
    ("stop_b", 9, "output", "N", ""),
    ("k_a", 19, "parameter", "", "0"),
    ("p_a", 20, "parameter", "", "1.2"),
    ("r_a", 21, "parameter", "", "0"),
    ("k_b", 22, "parameter", "", "0"),
    ("p_b", 23, "parameter", "", "1.4"),
    ("r_b", 24, "parameter", "", "0"),
];
const BODIES: [Variable; 6] = [
    ("mass_a", 10, "parameter", "kg", "0.4"),
    ("mass_b", 11, "parameter", "kg", "0.3"),
    ("preload", 12, "parameter", "N", "100"),
    ("coupling", 15, "parameter", "N/m", "3000"),
    ("from", 25, "parameter", "", "0"),
    ("to", 26, "parameter", "", "-1"),
];
const STOP: [Variable; 6] = [
    ("depth", 0, "input", "m", "0"),
    ("speed", 1, "input", "m/s", "0"),
    ("push", 2, "output", "N", ""),
    ("k", 3, "parameter", "", "1e7"),
    ("p", 4, "parameter", "", "1.2"),
    ("r", 5, "parameter", "", "0"),
];

fn description(name: &str, flags: &str, variables: &[Variable], has_behaviour: bool) -> String {
    let variability = |c: &str| if c == "parameter" { " variability=\"tunable\"" } else { "" };
    let mut all = String::new();
    for (name, reference, causality, unit, start) in variables {
        let of = |key: &str, value: &str| if value.is_empty() { String::new() } else { format!(" {key}=\"{value}\"") };
        all += &format!(
            "<ScalarVariable name=\"{name}\" valueReference=\"{reference}\" causality=\"{causality}\"{}><Real{}{}/></ScalarVariable>\n",
            variability(causality),
            of("unit", unit),
            of("start", start)
        );
    }
    if has_behaviour {
        all +=
            "<ScalarVariable name=\"behaviour\" valueReference=\"0\" causality=\"parameter\" variability=\"tunable\">\
                <Integer start=\"0\"/></ScalarVariable>\n";
    }
    let outputs = variables.iter().enumerate().filter(|(_, v)| v.2 == "output");
    let outputs: String = outputs.map(|(i, _)| format!("<Unknown index=\"{}\"/>", i + 1)).collect();
    format!(
        "<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n\
         <fmiModelDescription fmiVersion=\"2.0\" modelName=\"{name}\" guid=\"{{{name}}}\" numberOfEventIndicators=\"0\">\n\
         <CoSimulation modelIdentifier=\"{name}\" canHandleVariableCommunicationStepSize=\"true\" {flags}/>\n{UNITS}\n\
         <ModelVariables>{all}</ModelVariables>\n\
         <ModelStructure><Outputs>{outputs}</Outputs></ModelStructure>\n</fmiModelDescription>\n"
    )
}

fn write(path: &Path, name: &str, xml: &str, defines: &[&str]) {
    let mut zip = zip::ZipWriter::new(std::fs::File::create(path).unwrap());
    let so = std::fs::read(library(defines)).unwrap();
    for (name, bytes) in
        [("modelDescription.xml", xml.as_bytes()), (&format!("binaries/linux64/{name}.so") as &str, &so[..])]
    {
        zip.start_file(name, zip::write::SimpleFileOptions::default()).unwrap();
        zip.write_all(bytes).unwrap();
    }
    zip.finish().unwrap();
}

/// What the FMU of the bodies is to be.
#[derive(Clone, Copy)]
pub struct Bodies {
    /// Whether it takes forces.
    pub takes_forces: bool,
    /// What trips its behaviour, as fixtures/machine.c names it.
    pub tripped_by: &'static str,
    /// Whether it reports directional derivatives.
    pub gives_derivatives: bool,
}

impl Default for Bodies {
    fn default() -> Bodies {
        Bodies { takes_forces: true, tripped_by: "PRELOAD", gives_derivatives: false }
    }
}

impl Bodies {
    /// Writes bodies.fmu into a folder.
    pub fn write(self, folder: &Path) {
        let inputs = if self.takes_forces { &INPUTS[..] } else { &[] };
        let variables: Vec<Variable> = [inputs, &MOTION, &STOPS, &BODIES].concat();
        let by = format!("BY={}", self.tripped_by);
        let mut defines = vec!["BODIES", &by];
        let mut flags = "";
        if self.gives_derivatives {
            defines.push("DERIVATIVES");
            flags = "providesDirectionalDerivative=\"true\"";
        }
        write(&folder.join("bodies.fmu"), "bodies", &description("bodies", flags, &variables, true), &defines);
    }
}

/// Writes stop.fmu into a folder.
pub fn write_stop(folder: &Path) {
    write(&folder.join("stop.fmu"), "stop", &description("stop", "", &STOP, false), &["STOP"]);
}

/// An effect that no FMU here holds: more force of a stop, N, from its penetration m and the rate m/s.
pub type Effect = fn(f64, f64) -> f64;

/// The machine with its effects: stops k x^p (1 + r v), and more. Other code than that of the FMU.
pub struct Truth {
    pub stops: [[f64; 3]; 2],
    pub effects: [Option<Effect>; 2],
    /// What each channel reads of its truth: force of A, acceleration of B, penetration of A.
    pub read: [fn(f64) -> f64; 3],
}

pub const SAMPLES: usize = 225;
pub const INTERVAL: f64 = 4e-5;
/// Standard deviations of the noise of force N, acceleration m/s^2, penetration m.
pub const NOISE: [f64; 3] = [1.5, 8.0, 1e-6];

/// A stop's law as the FMUs have it.
pub const STOP_A: [f64; 3] = [1.2e7, 1.2, 0.1];
pub const STOP_B: [f64; 3] = [6.0e7, 1.4, 0.1];

impl Truth {
    pub fn new(effects: [Option<Effect>; 2]) -> Truth {
        Truth { stops: [STOP_A, STOP_B], effects, read: [|f| f, |a| a, |x| x] }
    }

    fn push(&self, i: usize, x: f64, v: f64) -> f64 {
        let [k, p, r] = self.stops[i];
        let bare = if x > 0.0 { (k * x.powf(p) * (1.0 + r * v)).max(0.0) } else { 0.0 };
        bare + self.effects[i].map_or(0.0, |e| e(x, v))
    }

    /// Accelerations and stop forces at a state.
    fn at(&self, preload: f64, [xa, va, xb, vb]: [f64; 4]) -> ([f64; 2], f64) {
        let link = 3000.0 * (xa - xb) + 2.0 * (va - vb);
        let (fa, fb) = (self.push(0, xa, va), self.push(1, xb, vb));
        let a = (preload + 2000.0 * (-3e-3 - xa) - link - fa) / 0.4;
        ([a, (0.75 * preload + link - fb) / 0.3], fa)
    }

    /// Recorded rows of force of A, acceleration of B, penetration of A, without noise (Runge and Kutta's steps of 0.5 us).
    pub fn rows(&self, preload: f64) -> Vec<[f64; 3]> {
        const WITHIN: usize = 80;
        let dt = INTERVAL / WITHIN as f64;
        let rate = |y: [f64; 4]| {
            let ([a, b], _) = self.at(preload, y);
            [y[1], a, y[3], b]
        };
        let along = |y: [f64; 4], d: [f64; 4], h: f64| [0, 1, 2, 3].map(|i| y[i] + h * d[i]);
        let mut y = [-3e-3, 0.0, -4e-3, 0.0];
        let mut rows = Vec::new();
        for _ in 0..SAMPLES {
            let ([_, b], fa) = self.at(preload, y);
            rows.push([self.read[0](fa), self.read[1](b), self.read[2](y[0])]);
            for _ in 0..WITHIN {
                let d1 = rate(y);
                let d2 = rate(along(y, d1, 0.5 * dt));
                let d3 = rate(along(y, d2, 0.5 * dt));
                let d4 = rate(along(y, d3, dt));
                y = [0, 1, 2, 3].map(|i| y[i] + dt / 6.0 * (d1[i] + 2.0 * d2[i] + 2.0 * d3[i] + d4[i]));
            }
        }
        rows
    }
}

/// Preloads of the recordings, N.
pub const PRELOADS: [f64; 4] = [80.0, 92.0, 108.0, 125.0];

/// Stops of FMUs of their own, fed by the bodies and feeding them.
pub const STOPS_APART: &str = r#"name = "machine"
[[fmu]]
name = "bodies"
file = "bodies.fmu"
[fmu.set]
preload = 140.0
[[fmu]]
name = "pad_a"
file = "stop.fmu"
[fmu.set]
k = 1.2e7
p = 1.2
r = 0.1
[[fmu]]
name = "pad_b"
file = "stop.fmu"
[fmu.set]
k = 6.0e7
p = 1.4
r = 0.1
[[connect]]
from = "bodies.x_a"
to = "pad_a.depth"
[[connect]]
from = "bodies.v_a"
to = "pad_a.speed"
[[connect]]
from = "pad_a.push"
to = "bodies.force_a"
[[connect]]
from = "bodies.x_b"
to = "pad_b.depth"
[[connect]]
from = "bodies.v_b"
to = "pad_b.speed"
[[connect]]
from = "pad_b.push"
to = "bodies.force_b"
[master]
stop = 0.009
step = 1e-6
"#;

/// Stops inside the bodies' FMU.
pub const STOPS_INSIDE: &str = r#"name = "machine"
[[fmu]]
name = "bodies"
file = "bodies.fmu"
[fmu.set]
k_a = 1.2e7
r_a = 0.1
k_b = 6.0e7
r_b = 0.1
[master]
stop = 0.009
step = 1e-6
"#;

/// What of campaign.toml depends on where the stops are.
pub struct Described {
    /// Free variables with their tolerance.
    pub free: &'static [(&'static str, Option<f64>)],
    /// The output that the recorded force is.
    pub force: &'static str,
    /// Whether the bonds have an input that takes a force.
    pub takes_forces: bool,
}

pub const APART: Described = Described {
    free: &[("pad_a.k", None), ("pad_b.k", None), ("bodies.mass_a", Some(0.002)), ("bodies.mass_b", Some(0.002))],
    force: "pad_a.push",
    takes_forces: true,
};
pub const INSIDE: Described =
    Described { free: &[("bodies.k_a", None), ("bodies.k_b", None)], force: "bodies.stop_a", takes_forces: true };
pub const MONOLITH: Described = Described { takes_forces: false, ..INSIDE };

/// Writes recordings and campaign.toml of the machine into a folder that holds system.toml's FMUs.
pub fn campaign(folder: &Path, system: &str, of: &Described, truth: &Truth) {
    std::fs::write(folder.join("system.toml"), system).unwrap();
    let mut text = String::from(
        "format = \"recordings/1\"\n[campaign]\nname = \"machine\"\nkind = \"system\"\n[simulation]\nsystem = \"system.toml\"\n\
         terms = [\"hysteresis_damping\", \"return_spring\"]\n",
    );
    for (variable, tolerance) in of.free {
        text += &format!("[[simulation.free]]\nvariable = \"{variable}\"\n");
        if let Some(t) = tolerance {
            text += &format!("tolerance = {t}\n");
        }
    }
    for name in ["a", "b"] {
        let force = if of.takes_forces { format!("force = \"bodies.force_{name}\"\n") } else { String::new() };
        text += &format!(
            "[[simulation.bond]]\nname = \"stop {name}\"\nkind = \"contact\"\n{force}\
             penetration = \"bodies.x_{name}\"\nvelocity = \"bodies.v_{name}\"\n"
        );
    }
    text += &format!(
        "[simulation.channels]\nforce = \"{}\"\nacceleration = \"bodies.a_b\"\npenetration = \"bodies.x_a\"\n",
        of.force
    );
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(21);
    for (i, preload) in PRELOADS.into_iter().enumerate() {
        let mut csv = String::from("time [s],force [N],acceleration [m/s^2],penetration [m]\n");
        for (j, row) in truth.rows(preload).into_iter().enumerate() {
            // a sum of twelve is nearly normal
            let mut normal = || (0..12).map(|_| random.random::<f64>()).sum::<f64>() - 6.0;
            let [f, a, x] = [0, 1, 2].map(|c| row[c] + NOISE[c] * normal());
            csv += &format!("{:e},{f:e},{a:e},{x:e}\n", INTERVAL * j as f64);
        }
        std::fs::write(folder.join(format!("r{i}.csv")), csv).unwrap();
        text += &format!(
            "[[recording]]\nfile = \"r{i}.csv\"\norder = {i}\nspring_preload = {preload:?}\n\
             [recording.set]\n\"bodies.preload\" = {preload:?}\n"
        );
    }
    std::fs::write(folder.join("campaign.toml"), text).unwrap();
}
