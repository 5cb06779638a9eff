//! Self-contained HTML pages and SVG charts.

mod chart;
mod page;
pub mod run;

pub use chart::{Chart, Style};
pub use page::Page;
