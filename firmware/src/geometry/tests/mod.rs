//! Laws of the geometry stage, checked against [`oracle`]: other algorithms, in `f64`, over whole splines at once.

mod akima;
mod bspline;
mod builder;
mod cubic;
mod g6;
mod oracle;
mod support;
mod thesis;
