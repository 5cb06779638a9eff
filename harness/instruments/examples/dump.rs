//! Prints what a file holds as JSON: groups, channels, clock, properties, notes and every sample (null: missing). For tests
//! that hold the readers to other libraries of the same formats.
//!   cargo run -p touchdown-instruments --example dump -- FILE

use serde_json::json;
use std::ops::ControlFlow;
use std::process::ExitCode;

fn main() -> ExitCode {
    let Some(path) = std::env::args_os().nth(1) else {
        eprintln!("dump: give a file");
        return ExitCode::from(2);
    };
    match dump(path.as_ref()) {
        Ok(text) => {
            println!("{text}");
            ExitCode::SUCCESS
        }
        Err(e) => {
            eprintln!("dump: {e}");
            ExitCode::from(2)
        }
    }
}

fn dump(path: &std::path::Path) -> Result<serde_json::Value, instruments::Fault> {
    let mut source = instruments::open(path)?;
    let mut groups = Vec::new();
    for (i, g) in source.groups().to_vec().into_iter().enumerate() {
        let mut samples: Vec<Vec<f64>> = vec![Vec::new(); g.channels.len()];
        source.read(i, &mut |block| {
            samples.iter_mut().zip(block).for_each(|(all, of)| all.extend_from_slice(of));
            ControlFlow::Continue(())
        })?;
        let channels: Vec<_> = g.channels.iter().map(|c| json!({"name": c.name, "unit": c.unit})).collect();
        groups.push(json!({
            "name": g.name, "channels": channels, "length": g.samples, "properties": g.properties,
            "clock": g.clock.map(|c| json!({"start": c.start, "step": c.step})), "samples": samples,
        }));
    }
    Ok(json!({"groups": groups, "notes": source.notes()}))
}
