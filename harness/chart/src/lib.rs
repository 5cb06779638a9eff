//! Self-contained HTML pages and SVG charts.

mod axis;
mod card;
mod cells;
mod chart;
mod heat;
mod line;
mod number;
mod page;

pub use axis::{interval, quantity};
pub use card::{Card, Chance, Effects};
pub use cells::{Cell, Cells, Shares};
pub use chart::{Chart, Style};
pub use heat::Heat;
pub use number::dashed;
pub use page::{card, lead, linked, picture, Page};
