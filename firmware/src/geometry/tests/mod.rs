//! Laws of the geometry stage, checked against [`oracle`]: other algorithms, in `f64`, over whole splines at once.

mod akima;
mod bspline;
mod builder;
mod circle;
mod cubic;
mod feed;
mod fit;
mod g6;
mod oracle;
mod polynomial;
mod rational;
mod support;
mod thesis;
mod tool_vector;
mod travel;
