//! Options on somebody else's FMUs.

use crate::print;
use crate::progress::interruption;
use crate::tasks::isolation;
use anyhow::Result;
use host::Isolation;

#[derive(clap::Args)]
pub struct Fmus {
    /// Run somebody else's FMU inside this process: faster, but its crash ends the command
    #[arg(long, conflicts_with_all = ["fmu_seconds", "fmu_memory"])]
    in_process: bool,
    /// Longest time of one call of somebody else's FMU, s
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, allow_negative_numbers = true)]
    fmu_seconds: f64,
    /// Most memory of somebody else's FMU, MB; no limit unless given
    #[arg(long, value_name = "MB")]
    fmu_memory: Option<u64>,
}

impl Fmus {
    /// The options as they are typed.
    pub fn arguments(&self) -> Vec<String> {
        if self.in_process {
            return vec!["--in-process".into()];
        }
        let mut all = vec!["--fmu-seconds".into(), self.fmu_seconds.to_string()];
        all.extend(self.fmu_memory.iter().flat_map(|mb| ["--fmu-memory".to_string(), mb.to_string()]));
        all
    }

    /// Where FMUs run.
    ///
    /// # Errors
    /// A time or a memory of none.
    pub fn isolation(&self) -> Result<Isolation> {
        let isolation = isolation(self.in_process, self.fmu_seconds, self.fmu_memory, interruption())?;
        if !self.in_process && !Isolation::is_possible() {
            print::warning("somebody else's FMUs run inside this process here: only Linux has processes for them");
        }
        Ok(isolation)
    }
}
