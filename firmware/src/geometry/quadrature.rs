//! Gauss-Legendre rules for lengths of curves: abscissae and weights on [0, 1] (Abramowitz and Stegun, table 25.4).

/// Four points: exact up to degree 7.
pub(super) const GAUSS_4: [(f32, f32); 4] = [
    (0.069_431_84, 0.173_927_43),
    (0.330_009_5, 0.326_072_57),
    (0.669_990_5, 0.326_072_57),
    (0.930_568_16, 0.173_927_43),
];

/// Five points: exact up to degree 9.
pub(super) const GAUSS_5: [(f32, f32); 5] = [
    (0.046_910_077, 0.118_463_44),
    (0.230_765_34, 0.239_314_34),
    (0.5, 0.284_444_45),
    (0.769_234_66, 0.239_314_34),
    (0.953_089_9, 0.118_463_44),
];
