//! Self-contained HTML pages and SVG charts.

mod axis;
mod card;
mod cells;
mod chart;
mod heat;
mod line;
mod number;
mod page;
mod points;
mod table;

pub use axis::{interval, quantity};
pub use card::{Card, Chance, Effects};
pub use cells::{Cell, Cells, Shares};
pub use chart::{alike, Chart, Style};
pub use heat::Heat;
pub use number::dashed;
pub use page::{card, lead, linked, picture, Page};
pub use table::Datum;
