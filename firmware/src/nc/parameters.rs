//! The R parameters of a program: numbers come in and go out by index, nothing else is touched.

/// Arithmetic parameters: `R0` to `R99`.
pub const PARAMETERS: usize = 100;

/// `R0` to `R99`, all 0 at the start of a program. Not `Copy`: 800 bytes.
#[derive(Clone, Debug, PartialEq)]
pub struct Parameters([f64; PARAMETERS]);

impl Parameters {
    /// All zero.
    #[must_use]
    pub const fn new() -> Self {
        Self([0.0; PARAMETERS])
    }

    /// Value of `R<index>`; `None` beyond [`PARAMETERS`].
    #[must_use]
    pub fn get(&self, index: usize) -> Option<f64> {
        self.0.get(index).copied()
    }

    /// Sets `R<index>`; false, and nothing is changed, beyond [`PARAMETERS`] or if `value` is not finite.
    pub fn set(&mut self, index: usize, value: f64) -> bool {
        match self.0.get_mut(index) {
            Some(entry) if value.is_finite() => {
                *entry = value;
                true
            }
            _ => false,
        }
    }
}

impl Default for Parameters {
    fn default() -> Self {
        Self::new()
    }
}
