//! Pentaspline: five-axis spline motion core.
//!
//! A program travels one way through this crate (`docs/architecture.md` walks the road):
//! serial bytes, [`protocol`], [`nc`], [`geometry`], [`planner`] in the background; then, behind a
//! single-producer queue, [`interpolator`] and [`stepgen`] in the servo interrupt.
//! [`machine`] wires the stages. Time is an argument everywhere and is never read.
#![cfg_attr(not(test), no_std)]
#![deny(unsafe_code)]

extern crate std;
pub fn knob(i: usize, default: f32) -> f32 {
    use std::sync::OnceLock;
    static K: OnceLock<std::vec::Vec<f32>> = OnceLock::new();
    let k = K.get_or_init(|| {
        std::env::var("PS_K")
            .map(|s| {
                s.split(',')
                    .map(|x| x.parse().unwrap_or(f32::NAN))
                    .collect()
            })
            .unwrap_or_default()
    });
    match k.get(i) {
        Some(x) if !x.is_nan() => *x,
        _ => default,
    }
}
pub mod board;
pub mod catalogue;
pub mod compensation;
pub mod config;
pub mod envelope;
pub mod geometry;
pub mod interpolator;
pub mod machine;
pub mod nc;
pub mod planner;
pub mod protocol;
pub mod stepgen;
pub mod units;
