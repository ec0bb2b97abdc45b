//! Laws of the compensation, against brute force: every position of the tool centre is held against a dense sampling of
//! the whole contour.

mod curves;
mod joints;
mod modes;
mod refusals;
pub(super) mod support;
