//! NI's scalings of a channel: a chain of steps from the raw numbers to the values in the channel's unit.

use super::object::Object;
use super::strain::{Bridge, Strain};
use std::collections::HashMap;

/// The input source that means the raw data.
const RAW: f64 = u32::MAX as f64;
/// Steps behind each other, at most.
const DEPTH: usize = 64;
/// Entries of a table or a polynomial, at most.
const ENTRIES: f64 = 1e6;

/// Why a channel cannot be scaled.
pub(super) struct Unscaled(pub(super) String);

/// Where a step takes its numbers from.
#[derive(Clone, Copy, Debug)]
enum Input {
    Raw,
    /// A DAQmx scaler's raw numbers.
    Scaler(u32),
    /// An earlier step.
    Step(usize),
}

#[derive(Clone, Debug)]
enum Step {
    Linear {
        slope: f64,
        intercept: f64,
        of: Input,
    },
    Polynomial {
        coefficients: Vec<f64>,
        of: Input,
    },
    /// Linear between the points, constant beyond them.
    Table {
        from: Vec<f64>,
        to: Vec<f64>,
        of: Input,
    },
    Strain {
        strain: Strain,
        of: Input,
    },
    Add(Input, Input),
    Subtract {
        less: Input,
        of: Input,
    },
}

/// The steps of a channel, each after the ones it needs, and which result is the channel's.
#[derive(Clone, Debug)]
pub(super) struct Plan {
    steps: Vec<Step>,
    result: Input,
}

/// The scalings of a channel: its own, else its group's, else the file's.
pub(super) fn plan(channel: &Object, parents: &[Option<&Object>]) -> Result<Plan, Unscaled> {
    let owners = std::iter::once(channel).chain(parents.iter().flatten().copied());
    for owner in owners {
        let count = count(owner);
        if count < 1.0 || owner.text("NI_Scaling_Status") == Some("scaled") {
            continue;
        }
        let mut resolver = Resolver { owner, channel, steps: Vec::new(), known: HashMap::new() };
        let result = resolver.resolve(count - 1.0, 0)?;
        return Ok(Plan { steps: resolver.steps, result });
    }
    Ok(Plan { steps: Vec::new(), result: Input::Raw })
}

/// Number of scalings of an object.
fn count(owner: &Object) -> f64 {
    let place = |n: &str| n.strip_prefix("NI_Scale[")?.strip_suffix("]_Scale_Type")?.parse::<u32>().ok();
    let from_types = || owner.property_names().filter_map(place).max().map_or(0.0, |i| f64::from(i) + 1.0);
    owner.number("NI_Number_Of_Scales").unwrap_or_else(from_types)
}

struct Resolver<'a> {
    owner: &'a Object,
    channel: &'a Object,
    steps: Vec<Step>,
    /// Scalings resolved already: the bits of their number, and the input that gives their result.
    known: HashMap<u64, Input>,
}

impl Resolver<'_> {
    /// The input that gives the result of a scaling.
    fn resolve(&mut self, scale: f64, depth: usize) -> Result<Input, Unscaled> {
        if scale == RAW {
            return Ok(Input::Raw);
        }
        if let Some(input) = self.known.get(&scale.to_bits()) {
            return Ok(*input);
        }
        if depth > DEPTH {
            return Err(Unscaled("its scalings follow each other without end".to_string()));
        }
        let before = format!("NI_Scale[{scale}]_");
        let Some(kind) = self.owner.text(&format!("{before}Scale_Type")).map(str::to_string) else {
            // a DAQmx scaler's number stands in the index of the data, not in the properties
            let id = scale as u32;
            let there = self.channel.tracks.iter().any(|t| t.scaler == Some(id));
            let missing = || Unscaled(format!("its scaling {scale} has no type"));
            return there.then_some(Input::Scaler(id)).ok_or_else(missing);
        };
        let input = match kind.as_str() {
            "Linear" => {
                let of = self.input(&format!("{before}Linear_Input_Source"), depth)?;
                let slope = self.number(&format!("{before}Linear_Slope"))?;
                let intercept = self.number(&format!("{before}Linear_Y_Intercept"))?;
                self.push(Step::Linear { slope, intercept, of })
            }
            "Polynomial" => {
                let of = self.input(&format!("{before}Polynomial_Input_Source"), depth)?;
                let size = self.owner.number(&format!("{before}Polynomial_Coefficients_Size")).unwrap_or(4.0);
                let coefficients = self.list(&format!("{before}Polynomial_Coefficients"), size)?;
                self.push(Step::Polynomial { coefficients, of })
            }
            "Table" => {
                let table = self.table(&before, depth)?;
                self.push(table)
            }
            "Strain" => {
                let of = self.input(&format!("{before}Strain_Input_Source"), depth)?;
                let strain = self.strain(&format!("{before}Strain_"))?;
                self.push(Step::Strain { strain, of })
            }
            "Add" | "Subtract" => {
                let left = self.input(&format!("{before}{kind}_Left_Operand_Input_Source"), depth)?;
                let right = self.input(&format!("{before}{kind}_Right_Operand_Input_Source"), depth)?;
                // NI subtracts the left operand from the right one
                self.push(if kind == "Add" { Step::Add(left, right) } else { Step::Subtract { less: left, of: right } })
            }
            "AdvancedAPI" => self.input(&format!("{before}AdvancedAPI_Input_Source"), depth)?,
            _ => return Err(Unscaled(format!("its scaling {kind} is not read; save the scaled values"))),
        };
        self.known.insert(scale.to_bits(), input);
        Ok(input)
    }

    fn push(&mut self, step: Step) -> Input {
        self.steps.push(step);
        Input::Step(self.steps.len() - 1)
    }

    fn input(&mut self, name: &str, depth: usize) -> Result<Input, Unscaled> {
        self.resolve(self.owner.number(name).unwrap_or(RAW), depth + 1)
    }

    fn number(&self, name: &str) -> Result<f64, Unscaled> {
        self.owner.number(name).ok_or_else(|| Unscaled(format!("the property {name} of its scaling is missing")))
    }

    fn list(&self, name: &str, size: f64) -> Result<Vec<f64>, Unscaled> {
        if !(0.0..=ENTRIES).contains(&size) {
            return Err(Unscaled(format!("{name} of its scaling claims {size} entries")));
        }
        (0..size as usize).map(|i| self.number(&format!("{name}[{i}]"))).collect()
    }

    fn strain(&self, before: &str) -> Result<Strain, Unscaled> {
        let of = |name: &str| self.number(&format!("{before}{name}"));
        let number = of("Configuration")?;
        let bridge = Bridge::of(number).ok_or_else(|| Unscaled(format!("its strain bridge {number} is not known")))?;
        Ok(Strain {
            bridge,
            excitation: of("Voltage_Excitation")?,
            initial: of("Initial_Bridge_Voltage")?,
            gauge_factor: of("Gage_Factor")?,
            poisson: of("Poisson_Ratio")?,
            leads: of("Lead_Wire_Resistance")? / of("Gage_Resistance")?,
            gain: of("Bridge_Shunt_Calibration_Gain_Adjustment")?,
        })
    }

    fn table(&mut self, before: &str, depth: usize) -> Result<Step, Unscaled> {
        let of = self.input(&format!("{before}Table_Input_Source"), depth)?;
        let list = |name: &str| self.list(name, self.number(&format!("{name}_Size"))?);
        let mut from = list(&format!("{before}Table_Pre_Scaled_Values"))?;
        let mut to = list(&format!("{before}Table_Scaled_Values"))?;
        if from.windows(2).all(|w| w[0] > w[1]) {
            from.reverse();
            to.reverse();
        }
        if from.is_empty() || from.len() != to.len() || !from.windows(2).all(|w| w[0] < w[1]) {
            return Err(Unscaled("the table of its scaling does not rise or fall throughout".to_string()));
        }
        Ok(Step::Table { from, to, of })
    }
}

impl Plan {
    /// Whether the raw numbers are the channel's values.
    pub(super) fn is_raw(&self) -> bool {
        self.steps.is_empty()
    }

    /// The channel's values from the raw numbers of its scalers.
    pub(super) fn apply(&self, raw: Vec<(Option<u32>, Vec<f64>)>) -> Vec<f64> {
        let mut results: Vec<Vec<f64>> = Vec::with_capacity(self.steps.len());
        for step in &self.steps {
            let of = |input: &Input| take(input, &raw, &results);
            let out = match step {
                Step::Linear { slope, intercept, of: input } => {
                    of(input).iter().map(|x| x * slope + intercept).collect()
                }
                Step::Polynomial { coefficients, of: input } => {
                    of(input).iter().map(|x| coefficients.iter().rev().fold(0.0, |sum, c| sum * x + c)).collect()
                }
                Step::Table { from, to, of: input } => {
                    of(input).iter().map(|x| crate::shared::interpolate::linear(from, to, *x)).collect()
                }
                Step::Strain { strain, of: input } => of(input).iter().map(|x| strain.of(*x)).collect(),
                Step::Add(a, b) => of(a).iter().zip(of(b)).map(|(a, b)| a + b).collect(),
                Step::Subtract { less, of: input } => of(input).iter().zip(of(less)).map(|(a, b)| a - b).collect(),
            };
            results.push(out);
        }
        take(&self.result, &raw, &results).to_vec()
    }
}

/// The numbers of an input.
fn take<'a>(input: &Input, raw: &'a [(Option<u32>, Vec<f64>)], results: &'a [Vec<f64>]) -> &'a [f64] {
    match input {
        Input::Step(i) => &results[*i],
        Input::Scaler(id) => raw.iter().find(|(s, _)| *s == Some(*id)).map_or(&[], |(_, v)| v),
        Input::Raw => raw.first().map_or(&[], |(_, v)| v),
    }
}
