//! Systems of FMUs of any kind: units, types, ends and tolerances in system files; SSP archives.

mod files;
mod relay;
mod ssp;
