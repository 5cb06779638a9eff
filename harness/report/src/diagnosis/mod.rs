//! What a diagnosis came to: its words on the terminal, its page, its files.

mod card;
mod files;
mod handed;
mod index;
mod page;
mod pictures;
mod rating;
mod words;

pub use files::{check_folder, write, Foot};
pub use index::{answers, encoded, lead_of, write as write_index};
pub use words::{sentence, summary};
