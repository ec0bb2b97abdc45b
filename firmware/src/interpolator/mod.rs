//! interpolator (see docs/architecture.md).
