//! What a diagnosis came to: its words on the terminal, its page, its files.

mod files;
mod page;
mod words;

pub use files::{check_folder, write};
pub use words::{sentence, summary};
