//! Laws and helpers shared by the whole-product tests.
