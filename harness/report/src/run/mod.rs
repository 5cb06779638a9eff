//! What a scenario came to: its summary, its lines on the terminal, its page.

mod lines;
mod page;
mod summary;

pub use lines::{headline, lines};
pub use page::page;
pub use summary::{summary, ComparisonRow, Done, HeightRow, InterrupterSummary, RunSummary, SensorSummary, Summary};
