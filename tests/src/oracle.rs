//! What a program asks for, found another way than the core finds it: `f64`, whole splines at once, dense linear
//! algebra, the Cox-de Boor recursion.
//!
//! [`words`] and [`read`] (Sinumerik, Fanuc) or [`conversation`] (Heidenhain) read the text into [`item`]s, [`path`] makes
//! curves of them, [`shape`] and [`spline`] hold the formulas, [`cutter`] judges the path of a compensated tool.
//! Nothing here uses the core but for its axis count.

pub mod conversation;
pub mod cutter;
pub mod item;
mod modal;
pub mod path;
pub mod read;
pub mod shape;
pub mod spline;
pub mod words;
