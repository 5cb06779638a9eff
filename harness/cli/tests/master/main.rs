//! Masters against closed forms: with slaves written here, and with our own FMUs through system files and archives.

mod fmus;
mod foreign;
mod slaves;
mod toys;
