//! One function of the crate on numbers from the standard input, for comparison with other implementations:
//!
//! ```text
//! signal cfc RATE CLASS < VALUES              filtered values
//! signal srs RATE Q FREQUENCY... < VALUES     maximax, positive, negative at each frequency
//! signal rate < REFERENCE,SIGNAL              corridor, phase, magnitude, slope, overall, grade
//! ```

use std::io::Read;
use std::process::ExitCode;

fn numbers(words: &[String]) -> Result<Vec<f64>, String> {
    words.iter().map(|w| w.parse().map_err(|_| format!("{w:?} is no number; give numbers"))).collect()
}

/// Rows of numbers from the standard input, as columns.
fn columns(count: usize) -> Result<Vec<Vec<f64>>, String> {
    let mut text = String::new();
    std::io::stdin().read_to_string(&mut text).map_err(|e| e.to_string())?;
    let mut columns = vec![Vec::new(); count];
    for line in text.lines() {
        let row = numbers(&line.split(',').map(str::to_string).collect::<Vec<_>>())?;
        if row.len() != count {
            return Err(format!("{line:?} has not {count} numbers; separate them by commas"));
        }
        columns.iter_mut().zip(row).for_each(|(c, v)| c.push(v));
    }
    Ok(columns)
}

fn lines(rows: impl Iterator<Item = Vec<f64>>) -> String {
    rows.map(|r| r.iter().map(|v| format!("{v:e}")).collect::<Vec<_>>().join(",") + "\n").collect()
}

fn answer(words: &[String]) -> Result<String, String> {
    let usage = || "signal cfc RATE CLASS, srs RATE Q FREQUENCY..., or rate".to_string();
    let (verb, rest) = words.split_first().ok_or_else(usage)?;
    let given = numbers(rest)?;
    match (verb.as_str(), given.as_slice()) {
        ("cfc", [rate, class]) => {
            let y = assess::cfc::filter(&columns(1)?[0], *rate, *class).map_err(|e| e.to_string())?;
            Ok(lines(y.into_iter().map(|v| vec![v])))
        }
        ("srs", [rate, q, frequencies @ ..]) => {
            let s = assess::srs::spectrum(&columns(1)?[0], *rate, frequencies, *q).map_err(|e| e.to_string())?;
            Ok(lines((0..s.frequency.len()).map(|i| vec![s.maximax[i], s.positive[i], s.negative[i]])))
        }
        ("rate", []) => {
            let c = columns(2)?;
            let r = assess::rating::rate(&c[0], &c[1]).map_err(|e| e.to_string())?;
            let scores = [r.corridor, r.phase, r.magnitude, r.slope, r.overall];
            Ok(lines(scores.into_iter().map(|v| vec![v])) + r.grade.name() + "\n")
        }
        _ => Err(usage()),
    }
}

fn main() -> ExitCode {
    match answer(&std::env::args().skip(1).collect::<Vec<_>>()) {
        Ok(text) => {
            print!("{text}");
            ExitCode::SUCCESS
        }
        Err(e) => {
            eprintln!("signal: {e}");
            ExitCode::from(2)
        }
    }
}
