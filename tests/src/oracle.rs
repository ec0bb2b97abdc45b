//! What a program asks for, found another way than the core finds it: `f64`, whole splines at once, dense linear
//! algebra, the Cox-de Boor recursion.
//!
//! [`read::blocks`] reads the text, [`path::path`] makes curves of it, [`spline`] holds the formulas.
//! Nothing here uses the core but for its axis count.

pub mod path;
pub mod read;
pub mod spline;
