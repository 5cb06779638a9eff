//! Somebody else's FMU cannot take the command with it: FMUs in C that crash, hang, leave or lie, through `touchdown`.
#![cfg(target_os = "linux")]

mod archives;
mod fixture;
mod limits;
mod scenarios;
mod systems;
