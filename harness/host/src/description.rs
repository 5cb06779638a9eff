//! modelDescription.xml, as far as a host needs it.
//!
//! Read here with quick-xml, not with the schema of the crate `fmi`: that one refuses a file for any attribute it does
//! not know, which vendors' files have, and it cannot distinguish an output without a list of dependencies (FMI 2.0: depends
//! on everything) from one with an empty list (depends on nothing).

use super::archive;
use super::units::Named;
use super::xml::{self, Walk};
use crate::value::Value;
use quick_xml::events::{BytesStart, Event};
use record::words;
use std::collections::{BTreeMap, HashMap};
use std::path::Path;
use std::str::FromStr;

macro_rules! words {
    ($(#[$doc:meta])* $name:ident { $($(#[$vdoc:meta])* $variant:ident = $word:literal,)* }) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum $name { $($(#[$vdoc])* $variant,)* }
        impl FromStr for $name {
            type Err = String;
            fn from_str(s: &str) -> Result<Self, String> {
                match s {
                    $($word => Ok($name::$variant),)*
                    _ => Err(format!("\"{s}\" is none of {}", [$($word),*].join(", "))),
                }
            }
        }
    };
}

words! {
    /// Causality of a variable (FMI 2.0 section 2.2.7).
    Causality {
        /// Fixed or tunable by the user.
        Parameter = "parameter",
        /// Computed from parameters.
        CalculatedParameter = "calculatedParameter",
        /// Set by the host.
        Input = "input",
        /// Read by the host.
        Output = "output",
        /// The model's own.
        Local = "local",
        /// Time.
        Independent = "independent",
    }
}

words! {
    /// Variability of a variable (FMI 2.0 section 2.2.7).
    Variability {
        /// Never changes.
        Constant = "constant",
        /// Fixed after initialization.
        Fixed = "fixed",
        /// Constant between external changes.
        Tunable = "tunable",
        /// Constant between events.
        Discrete = "discrete",
        /// Anything.
        Continuous = "continuous",
    }
}

words! {
    /// Type of a variable.
    Kind {
        /// fmi2Real.
        Real = "Real",
        /// fmi2Integer.
        Integer = "Integer",
        /// fmi2Boolean.
        Boolean = "Boolean",
        /// fmi2String.
        String = "String",
        /// fmi2Integer with names.
        Enumeration = "Enumeration",
    }
}

/// Start value of a variable.
#[derive(Clone, Debug, PartialEq)]
pub enum Start {
    /// Of a Real, in the variable's unit.
    Real(f64),
    /// Of an Integer or Enumeration.
    Integer(i32),
    /// Of a Boolean.
    Boolean(bool),
    /// Of a String.
    String(String),
}

/// A variable.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Name, unique.
    pub name: String,
    /// Handle for the C functions; aliases share one.
    pub value_reference: u32,
    /// Causality; local where not given.
    pub causality: Causality,
    /// Variability; continuous where not given.
    pub variability: Variability,
    /// Type.
    pub kind: Kind,
    /// Start value, where given.
    pub start: Option<Start>,
    /// Name of the unit, its own or its type's.
    pub unit: Option<String>,
    /// Whether the unit's offset counts for nothing: the value is a difference (FMI 2.0 section 2.2.3).
    pub relative: bool,
    /// Least and largest value of a number, where the variable or its type gives them.
    pub bounds: (Option<f64>, Option<f64>),
    /// Size to expect of a Real, where the variable or its type gives it.
    pub nominal: Option<f64>,
    /// Name of its type, where it has one.
    pub declared_type: Option<String>,
    /// The items of an Enumeration: name, number.
    pub items: Vec<(String, i32)>,
    /// The exporter's words.
    pub description: String,
}

impl Variable {
    /// Number of an item by its name.
    ///
    /// # Errors
    /// The variable has no items; none of that name: names the nearest, and those there are.
    pub fn item(&self, name: &str) -> Result<i32, String> {
        if self.items.is_empty() {
            return Err(format!("{} is of type {:?} and cannot be {name:?}", self.name, self.kind));
        }
        let names: Vec<&str> = self.items.iter().map(|i| i.0.as_str()).collect();
        Ok(self.items[words::place(&self.name, name, &names)?].1)
    }
}

/// A unit by its SI base units: SI value = factor * value + offset.
#[derive(Clone, Debug, PartialEq)]
pub struct Unit {
    /// Exponents of kg, m, s, A, K, mol, cd, rad.
    pub exponents: [i32; 8],
    /// Factor to SI.
    pub factor: f64,
    /// Offset to SI.
    pub offset: f64,
}

impl Unit {
    /// The unit that the attributes of a BaseUnit define.
    ///
    /// # Errors
    /// An attribute that is no number; a factor of 0.
    pub(super) fn of(attributes: &mut BTreeMap<String, String>) -> Result<Unit, String> {
        let mut number = |key: &str| -> Result<Option<f64>, String> {
            let Some(text) = attributes.remove(key) else { return Ok(None) };
            text.trim().parse().map(Some).map_err(|e| format!("{key}=\"{text}\": {e}"))
        };
        let mut u = Unit { exponents: [0; 8], factor: 1.0, offset: 0.0 };
        for (exponent, base) in u.exponents.iter_mut().zip(["kg", "m", "s", "A", "K", "mol", "cd", "rad"]) {
            let given = number(base)?.unwrap_or(0.0);
            if given.fract() != 0.0 || given.abs() > 1e3 {
                return Err(format!("{base}=\"{given}\": an exponent is a whole number"));
            }
            *exponent = given as i32;
        }
        u.factor = number("factor")?.unwrap_or(1.0);
        u.offset = number("offset")?.unwrap_or(0.0);
        if u.factor == 0.0 || !u.factor.is_finite() || !u.offset.is_finite() {
            return Err("the factor of a unit is 0, or its numbers are not finite".into());
        }
        Ok(u)
    }
}

/// Attributes of the CoSimulation element; false and 0 where not given.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Capabilities {
    /// Name of the binary.
    pub model_identifier: String,
    /// Steps may differ in size.
    pub can_handle_variable_communication_step_size: bool,
    /// fmi2SetRealInputDerivatives works.
    pub can_interpolate_inputs: bool,
    /// Highest order of fmi2GetRealOutputDerivatives.
    pub max_output_derivative_order: u32,
    /// fmi2DoStep may answer fmi2Pending.
    pub can_run_asynchronuously: bool,
    /// No second instance in a process.
    pub can_be_instantiated_only_once_per_process: bool,
    /// The FMU allocates by itself.
    pub can_not_use_memory_management_functions: bool,
    /// State can be saved and restored.
    pub can_get_and_set_fmu_state: bool,
    /// Saved state can be written to bytes.
    pub can_serialize_fmu_state: bool,
    /// fmi2GetDirectionalDerivative works.
    pub provides_directional_derivative: bool,
    /// The FMU is a shell around a tool that must be installed.
    pub needs_execution_tool: bool,
}

#[derive(Clone, Debug, PartialEq)]
struct Output {
    variable: usize,
    /// Indices of what it depends on; None: not given.
    dependencies: Option<Vec<usize>>,
}

/// What modelDescription.xml says.
#[derive(Clone, Debug, Default)]
pub struct Description {
    /// fmiVersion.
    pub fmi_version: String,
    /// modelName.
    pub model_name: String,
    /// GUID, which the binary checks.
    pub guid: String,
    /// The exporter's words.
    pub description: String,
    /// Tool that wrote the file.
    pub generation_tool: String,
    /// Co-simulation; None where the FMU has none.
    pub co_simulation: Option<Capabilities>,
    /// Whether the FMU has model exchange.
    pub model_exchange: bool,
    /// Variables in the order of the file.
    pub variables: Vec<Variable>,
    /// Log categories.
    pub log_categories: Vec<String>,
    /// Preferred step of the default experiment, s.
    pub step_size: Option<f64>,
    /// Start of the default experiment, s.
    pub start_time: Option<f64>,
    /// End of the default experiment, s.
    pub stop_time: Option<f64>,
    /// Relative tolerance of the default experiment.
    pub tolerance: Option<f64>,
    /// Units by name, those that are given by their base units.
    pub units: HashMap<String, Unit>,
    by_name: HashMap<String, usize>,
    outputs: Vec<Output>,
}

/// Attributes of one element.
struct Attributes(BTreeMap<String, String>);

impl Attributes {
    fn of(e: &BytesStart) -> Result<Self, String> {
        Ok(Attributes(xml::attributes(e)?))
    }

    fn text(&mut self, key: &str) -> String {
        self.0.remove(key).unwrap_or_default()
    }

    fn need(&mut self, key: &str) -> Result<String, String> {
        self.0.remove(key).ok_or_else(|| format!("attribute {key} is missing"))
    }

    fn get<T: FromStr>(&mut self, key: &str) -> Result<Option<T>, String>
    where
        T::Err: std::fmt::Display,
    {
        match self.0.remove(key) {
            None => Ok(None),
            Some(s) => s.trim().parse().map(Some).map_err(|e| format!("{key}=\"{s}\": {e}")),
        }
    }

    fn flag(&mut self, key: &str) -> Result<bool, String> {
        Ok(self.get::<Flag>(key)?.is_some_and(|f| f.0))
    }
}

/// xs:boolean.
struct Flag(bool);

impl FromStr for Flag {
    type Err = String;
    fn from_str(s: &str) -> Result<Self, String> {
        match s {
            "true" | "1" => Ok(Flag(true)),
            "false" | "0" => Ok(Flag(false)),
            _ => Err("neither true nor false".into()),
        }
    }
}

/// The text of a file in UTF-8, with or without a mark, or in ISO 8859-1 where its head says so.
fn decode(bytes: &[u8]) -> Result<String, String> {
    let bytes = bytes.strip_prefix(&[0xef, 0xbb, 0xbf]).unwrap_or(bytes);
    match std::str::from_utf8(bytes) {
        Ok(s) => Ok(s.to_string()),
        Err(e) => {
            let head = String::from_utf8_lossy(&bytes[..bytes.len().min(200)]).to_ascii_lowercase();
            if head.contains("iso-8859-1") || head.contains("windows-1252") {
                return Ok(bytes.iter().map(|&b| char::from(b)).collect());
            }
            let line = 1 + bytes[..e.valid_up_to()].iter().filter(|&&b| b == b'\n').count();
            Err(format!("modelDescription.xml:{line}: not UTF-8; save it in UTF-8"))
        }
    }
}

/// What a declared type gives to variables that do not say otherwise.
#[derive(Clone, Default)]
struct SimpleType {
    unit: Option<String>,
    relative: bool,
    bounds: (Option<f64>, Option<f64>),
    nominal: Option<f64>,
    items: Vec<(String, i32)>,
}

impl SimpleType {
    /// The attributes that types and variables share; what is not given is as `base` has it. A bound or a size that is no
    /// number is none.
    fn of(a: &mut Attributes, base: SimpleType) -> Result<SimpleType, String> {
        Ok(SimpleType {
            unit: a.0.remove("unit").or(base.unit),
            relative: a.get::<Flag>("relativeQuantity")?.map_or(base.relative, |f| f.0),
            bounds: (
                a.get("min").unwrap_or_default().or(base.bounds.0),
                a.get("max").unwrap_or_default().or(base.bounds.1),
            ),
            nominal: a.get("nominal").unwrap_or_default().or(base.nominal),
            items: base.items,
        })
    }
}

#[derive(Default)]
struct Reading {
    d: Description,
    unit: Option<String>,
    simple_type: Option<String>,
    types: HashMap<String, SimpleType>,
    pending: Option<Variable>,
    dependencies: Vec<(i64, Option<String>)>,
}

impl Reading {
    fn element(&mut self, path: &[String], e: &BytesStart) -> Result<(), String> {
        let names: Vec<&str> = path.iter().map(String::as_str).collect();
        let mut a = Attributes::of(e)?;
        match names.as_slice() {
            ["fmiModelDescription"] => {
                self.d.fmi_version = a.need("fmiVersion")?;
                if !(self.d.fmi_version == "2.0" || self.d.fmi_version.starts_with("2.0.")) {
                    let version = &self.d.fmi_version;
                    return Err(format!("FMI {version}; this host runs FMI 2.0 co-simulation, export it as that"));
                }
                self.d.model_name = a.need("modelName")?;
                self.d.guid = a.need("guid")?;
                self.d.description = a.text("description");
                self.d.generation_tool = a.text("generationTool");
            }
            [first, ..] if *first != "fmiModelDescription" => {
                return Err(format!("the root element is {first}, not fmiModelDescription; this is no FMU"))
            }
            [_, "CoSimulation"] => self.d.co_simulation = Some(capabilities(&mut a)?),
            [_, "ModelExchange"] => self.d.model_exchange = true,
            [_, "DefaultExperiment"] => {
                self.d.step_size = a.get("stepSize")?;
                self.d.start_time = a.get("startTime")?;
                self.d.stop_time = a.get("stopTime")?;
                self.d.tolerance = a.get("tolerance")?;
            }
            [_, "LogCategories", "Category"] => self.d.log_categories.push(a.need("name")?),
            [_, "UnitDefinitions", "Unit"] => self.unit = Some(a.need("name")?),
            [_, "UnitDefinitions", "Unit", "BaseUnit"] => {
                let u = Unit::of(&mut a.0)?;
                if let Some(name) = self.unit.take() {
                    self.d.units.insert(name, u);
                }
            }
            [_, "TypeDefinitions", "SimpleType"] => self.simple_type = Some(a.need("name")?),
            [_, "TypeDefinitions", "SimpleType", "Enumeration", "Item"] => {
                let (item, value) = (a.need("name")?, a.get("value")?.ok_or("attribute value is missing")?);
                if let Some(name) = &self.simple_type {
                    self.types.entry(name.clone()).or_default().items.push((item, value));
                }
            }
            [_, "TypeDefinitions", "SimpleType", "Real" | "Integer" | "Enumeration"] => {
                if let Some(name) = &self.simple_type {
                    let declared = SimpleType::of(&mut a, SimpleType::default())?;
                    self.types.insert(name.clone(), declared);
                }
            }
            [_, "ModelVariables", "ScalarVariable"] => {
                self.pending = Some(Variable {
                    name: a.need("name")?,
                    value_reference: a.get("valueReference")?.ok_or("attribute valueReference is missing")?,
                    causality: a.get("causality")?.unwrap_or(Causality::Local),
                    variability: a.get("variability")?.unwrap_or(Variability::Continuous),
                    kind: Kind::Real,
                    start: None,
                    unit: None,
                    relative: false,
                    bounds: (None, None),
                    nominal: None,
                    declared_type: None,
                    items: Vec::new(),
                    description: a.text("description"),
                });
            }
            [_, "ModelVariables", "ScalarVariable", kind] => {
                let Ok(kind) = kind.parse::<Kind>() else { return Ok(()) };
                let Some(mut v) = self.pending.take() else { return Ok(()) };
                v.kind = kind;
                v.start = match kind {
                    Kind::Real => a.get("start")?.map(Start::Real),
                    Kind::Integer | Kind::Enumeration => a.get("start")?.map(Start::Integer),
                    Kind::Boolean => a.get::<Flag>("start")?.map(|f| Start::Boolean(f.0)),
                    Kind::String => a.0.remove("start").map(Start::String),
                };
                v.declared_type = a.0.remove("declaredType");
                let declared = v.declared_type.as_ref().and_then(|t| self.types.get(t)).cloned().unwrap_or_default();
                let own = SimpleType::of(&mut a, declared)?;
                (v.unit, v.relative, v.bounds, v.nominal, v.items) =
                    (own.unit, own.relative, own.bounds, own.nominal, own.items);
                if self.d.by_name.insert(v.name.clone(), self.d.variables.len()).is_some() {
                    return Err(format!("two variables are named {}", v.name));
                }
                self.d.variables.push(v);
            }
            [_, "ModelStructure", "Outputs", "Unknown"] => {
                let index = a.get("index")?.ok_or("attribute index is missing")?;
                self.dependencies.push((index, a.0.remove("dependencies")));
            }
            _ => {}
        }
        Ok(())
    }

    fn finish(mut self) -> Result<Description, String> {
        let count = self.d.variables.len() as i64;
        let index = |i: i64| {
            if (1..=count).contains(&i) {
                Ok(i as usize - 1)
            } else {
                Err(format!("modelDescription.xml: ModelStructure names variable {i}, there are {count}"))
            }
        };
        for (i, list) in self.dependencies {
            let dependencies = match list {
                None => None,
                Some(text) => {
                    let mut known = Vec::new();
                    for word in text.split_whitespace() {
                        let i = word.parse().map_err(|_| {
                            format!("modelDescription.xml: dependencies=\"{text}\": {word} is no index")
                        })?;
                        known.push(index(i)?);
                    }
                    Some(known)
                }
            };
            self.d.outputs.push(Output { variable: index(i)?, dependencies });
        }
        if self.d.model_name.is_empty() {
            return Err("modelDescription.xml: no element fmiModelDescription; this is no FMU".into());
        }
        Ok(self.d)
    }
}

fn capabilities(a: &mut Attributes) -> Result<Capabilities, String> {
    Ok(Capabilities {
        model_identifier: a.need("modelIdentifier")?,
        can_handle_variable_communication_step_size: a.flag("canHandleVariableCommunicationStepSize")?,
        can_interpolate_inputs: a.flag("canInterpolateInputs")?,
        max_output_derivative_order: a.get("maxOutputDerivativeOrder")?.unwrap_or(0),
        can_run_asynchronuously: a.flag("canRunAsynchronuously")?,
        can_be_instantiated_only_once_per_process: a.flag("canBeInstantiatedOnlyOncePerProcess")?,
        can_not_use_memory_management_functions: a.flag("canNotUseMemoryManagementFunctions")?,
        can_get_and_set_fmu_state: a.flag("canGetAndSetFMUstate")?,
        can_serialize_fmu_state: a.flag("canSerializeFMUstate")?,
        provides_directional_derivative: a.flag("providesDirectionalDerivative")?,
        needs_execution_tool: a.flag("needsExecutionTool")?,
    })
}

impl Description {
    /// Reads the bytes of a modelDescription.xml. Elements and attributes it does not know are passed over.
    ///
    /// # Errors
    /// Names the line, what is wrong there and the cure.
    pub fn read(bytes: &[u8]) -> Result<Description, String> {
        let text = decode(bytes)?;
        let mut walk = Walk::new(&text);
        let mut reading = Reading::default();
        loop {
            let (event, line) = walk.event().map_err(|why| format!("modelDescription.xml:{why}"))?;
            match event {
                Event::Start(e) => {
                    let element = reading.element(walk.open(), &e);
                    element.map_err(|why| format!("modelDescription.xml:{line}: {why}"))?;
                }
                Event::Eof => return reading.finish(),
                _ => {}
            }
        }
    }

    /// Reads the description inside an FMU, without unpacking it.
    ///
    /// # Errors
    /// No archive, no description in it, or what is wrong with that one.
    pub(super) fn in_archive(path: &Path) -> Result<Description, String> {
        Description::read(&archive::entry(path, archive::FMU.needs)?)
    }

    /// The unit of a variable, and what it is where the file defines it; None of one without.
    pub(super) fn unit_of(&self, v: &Variable) -> Option<Named> {
        let name = v.unit.clone().filter(|u| !u.trim().is_empty())?;
        Some(Named { unit: self.units.get(&name).cloned(), name })
    }

    /// The variable of that name.
    pub fn variable(&self, name: &str) -> Option<&Variable> {
        self.by_name.get(name).map(|&i| &self.variables[i])
    }

    /// A value of the variable of that name, as a file gives it, in a number: a Boolean is 0 or 1, of an Enumeration
    /// the item's name may stand.
    ///
    /// # Errors
    /// A text for a variable that is not there or has no such item; names those there are.
    pub fn number(&self, name: &str, value: &Value) -> Result<f64, String> {
        match value {
            Value::Boolean(b) => Ok(f64::from(u8::from(*b))),
            Value::Integer(n) => Ok(*n as f64),
            Value::Real(x) => Ok(*x),
            Value::Text(t) => {
                let v = self.variable(name);
                let v = v.ok_or_else(|| words::not_known("parameter", name, &self.names(Causality::Parameter)))?;
                v.item(t).map(f64::from)
            }
        }
    }

    /// Names of the variables of one causality, in the order of the file.
    pub fn names(&self, causality: Causality) -> Vec<&str> {
        self.variables.iter().filter(|v| v.causality == causality).map(|v| v.name.as_str()).collect()
    }

    /// Whether `output` depends on `input` at a communication point (FMI 2.0 section 2.2.8): None where the file does
    /// not say, which FMI wants taken as yes.
    pub fn feedthrough(&self, output: &str, input: &str) -> Option<bool> {
        let (o, i) = (*self.by_name.get(output)?, *self.by_name.get(input)?);
        let known = self.outputs.iter().find(|u| u.variable == o)?.dependencies.as_ref()?;
        Some(known.contains(&i))
    }
}
