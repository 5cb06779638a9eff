//! Slaves with closed forms.

use anyhow::{bail, Result};
use host::master::{Abilities, Feed, Input, Output, Part, Slave};
use host::Kind;

/// What a toy is.
#[derive(Clone, Debug)]
pub enum Model {
    /// Output 0 = gain * input 0 + offset, at once.
    Gain(f64, f64),
    /// Output 0 = square of input 0, less a constant, at once.
    Square(f64),
    /// Output 0 = factor * input 0 to a power, at once; 0 below zero.
    Power(f64, f64),
    /// Output 0 grows at rate input 0; exact under a held or straight input.
    Integrator(f64),
}

/// A toy.
pub struct Toy {
    pub model: Model,
    pub able: Abilities,
    pub input: [f64; 2],
    saved: Vec<(Model, [f64; 2])>,
    pub times: Vec<(f64, f64)>,
}

impl Toy {
    pub fn new(model: Model) -> Toy {
        let able =
            Abilities { rollback: true, variable_step: true, input_orders: 1, output_rates: false, directional: false };
        Toy { model, able, input: [0.0; 2], saved: Vec::new(), times: Vec::new() }
    }

    pub fn part(self, name: &str, source: usize) -> Part {
        let through = !matches!(self.model, Model::Integrator(_));
        Part {
            name: name.into(),
            slave: Box::new(self),
            inputs: vec![Input::real("u", 0, Feed { source, factor: 1.0, offset: 0.0 })],
            outputs: vec![Output::real("y", 1, if through { vec![0] } else { vec![] })],
        }
    }

    fn output(&self) -> f64 {
        match self.model {
            Model::Gain(a, b) => a * self.input[0] + b,
            Model::Square(c) => self.input[0] * self.input[0] - c,
            Model::Power(k, p) => k * self.input[0].max(0.0).powf(p),
            Model::Integrator(x) => x,
        }
    }
}

impl Slave for Toy {
    fn abilities(&self) -> Abilities {
        self.able
    }

    fn set(&mut self, _: &[u32], values: &[f64]) -> Result<()> {
        self.input = [values[0], 0.0];
        Ok(())
    }

    fn set_rates(&mut self, _: &[u32], orders: &[i32], values: &[f64]) -> Result<()> {
        assert_eq!(orders[0], 1);
        self.input[1] = values[0];
        Ok(())
    }

    fn get(&mut self, _: &[u32], values: &mut [f64]) -> Result<()> {
        values[0] = self.output();
        Ok(())
    }

    fn rates(&mut self, _: &[u32], _: &mut [f64]) -> Result<()> {
        bail!("no rates")
    }

    fn directional(&mut self, _: &[u32], _: &[u32], _: &[f64], _: &mut [f64]) -> Result<()> {
        bail!("no derivatives")
    }

    fn step(&mut self, time: f64, h: f64) -> Result<()> {
        self.times.push((time, h));
        if let Model::Integrator(x) = &mut self.model {
            *x += h * (self.input[0] + 0.5 * h * self.input[1]);
        }
        self.input = [self.input[0] + h * self.input[1], 0.0];
        Ok(())
    }

    fn save(&mut self, slot: usize) -> Result<()> {
        let now = (self.model.clone(), self.input);
        if self.saved.len() <= slot {
            self.saved.resize(slot + 1, now.clone());
        }
        self.saved[slot] = now;
        Ok(())
    }

    fn restore(&mut self, slot: usize) -> Result<()> {
        (self.model, self.input) = self.saved[slot].clone();
        Ok(())
    }

    fn ready(&mut self) -> Result<()> {
        Ok(())
    }

    fn log(&self) -> Vec<String> {
        Vec::new()
    }

    fn read(&mut self, _: Kind, _: u32) -> Result<f64> {
        Ok(self.output())
    }
}
