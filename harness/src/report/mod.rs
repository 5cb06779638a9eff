//! Self-contained HTML pages and SVG charts.

mod chart;
mod page;

pub use chart::{Chart, Style};
pub use page::Page;
