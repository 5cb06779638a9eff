//! Missing laws as functions: what a force depends on is a class, its shape is learned, and sets of classes are weighed.
//!
//! Where the motion is imposed the force is a sum of functions of depth, speed and what came before, and nothing has to be
//! integrated: each class is a family of shapes whose coefficients are not negative ([`classes`]), all of a set are found
//! together by linear least squares ([`fit`]), and every set has an evidence ([`weigh`]). A name is then what the class of
//! the likeliest sets says, whatever shape it has (laws discovered from a library: Flaschel, Kumar and De Lorenzis 2021;
//! discrepancy beside it: Kennedy and O'Hagan 2001).

pub mod classes;
pub mod fit;
mod gains;
pub mod law;
mod order;
pub mod press;
pub mod weigh;

pub use classes::{comes_back_instead, Class, ALL, GROWS, PARTED_BY_RATES};
pub use gains::factor;
pub use law::Law;
pub use press::{highest, Press, Recording};
pub use weigh::{learn, learn_to_predict, Learned, Numbers, Set};
