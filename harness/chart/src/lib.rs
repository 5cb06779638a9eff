//! Self-contained HTML pages and SVG charts.

mod chart;
mod heat;
mod page;

pub use chart::{Chart, Style};
pub use heat::Heat;
pub use page::{lead, picture, Page};
