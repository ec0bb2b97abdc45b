//! Safety inputs: limit switches, emergency stop, drives ready.
//!
//! In: the levels of [`INPUTS`] pins, once per servo tick. Out: the input that opened, once it has been
//! open for [`DEBOUNCE_TICKS`] ticks in a row. Every input is a closed contact to ground with a pull-up, so
//! a broken wire reads as open and stops the machine.

use embedded_hal::digital::InputPin;

use crate::units::AXES;

/// One limit per axis (both ends in series), emergency stop, drives ready.
pub const INPUTS: usize = AXES + 2;

/// Ticks an input must be open. At 5 kHz 0.6 ms: longer than a spark, shorter than a servo's reaction.
pub const DEBOUNCE_TICKS: u8 = 3;

/// What stopped the machine.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cause {
    /// A limit switch of this axis (index in configuration order).
    Limit(usize),
    /// The emergency stop.
    EmergencyStop,
    /// The enable input: the drives are not ready.
    NotReady,
}

/// Debounced safety inputs, in the order limits, emergency stop, drives ready.
pub struct Guard<P> {
    inputs: [P; INPUTS],
    open_ticks: [u8; INPUTS],
}

impl<P: InputPin> Guard<P> {
    /// Watches `inputs`: [`AXES`] limits, emergency stop, drives ready.
    pub const fn new(inputs: [P; INPUTS]) -> Self {
        Self {
            inputs,
            open_ticks: [0; INPUTS],
        }
    }

    /// Looks at all inputs once. Returns what is open, the emergency stop first.
    ///
    /// A pin that cannot be read counts as open.
    pub fn sample(&mut self) -> Option<Cause> {
        let mut cause = None;
        for (i, (pin, ticks)) in self.inputs.iter_mut().zip(&mut self.open_ticks).enumerate() {
            if pin.is_low().unwrap_or(false) {
                *ticks = 0;
                continue;
            }
            *ticks = ticks.saturating_add(1);
            if *ticks < DEBOUNCE_TICKS {
                continue;
            }
            match i {
                AXES => cause = Some(Cause::EmergencyStop),
                i if i < AXES => cause = cause.or(Some(Cause::Limit(i))),
                _ => cause = cause.or(Some(Cause::NotReady)),
            }
        }
        cause
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::cell::Cell;
    use core::convert::Infallible;
    use embedded_hal::digital::{ErrorKind, ErrorType};

    #[derive(Clone, Copy)]
    struct Wire<'a>(&'a Cell<bool>);

    impl ErrorType for Wire<'_> {
        type Error = Infallible;
    }

    impl InputPin for Wire<'_> {
        fn is_high(&mut self) -> Result<bool, Infallible> {
            Ok(self.0.get())
        }
        fn is_low(&mut self) -> Result<bool, Infallible> {
            Ok(!self.0.get())
        }
    }

    struct Dead;

    #[derive(Debug)]
    struct Unreadable;

    impl embedded_hal::digital::Error for Unreadable {
        fn kind(&self) -> ErrorKind {
            ErrorKind::Other
        }
    }

    impl ErrorType for Dead {
        type Error = Unreadable;
    }

    impl InputPin for Dead {
        fn is_high(&mut self) -> Result<bool, Unreadable> {
            Err(Unreadable)
        }
        fn is_low(&mut self) -> Result<bool, Unreadable> {
            Err(Unreadable)
        }
    }

    #[test]
    fn each_input_stops_the_machine_when_it_stays_open() {
        for i in 0..INPUTS {
            let levels: [Cell<bool>; INPUTS] = Default::default();
            let mut guard = Guard::new(core::array::from_fn(|k| Wire(&levels[k])));
            assert_eq!(guard.sample(), None);
            levels[i].set(true);
            assert_eq!([guard.sample(), guard.sample()], [None, None]);
            let want = match i {
                0..=4 => Cause::Limit(i),
                5 => Cause::EmergencyStop,
                _ => Cause::NotReady,
            };
            assert_eq!(guard.sample(), Some(want));
            levels[i].set(false);
            assert_eq!(guard.sample(), None);
        }
    }

    #[test]
    fn a_spark_shorter_than_the_debounce_stops_nothing() {
        let levels: [Cell<bool>; INPUTS] = Default::default();
        let mut guard = Guard::new(core::array::from_fn(|k| Wire(&levels[k])));
        for _ in 0..100 {
            levels[2].set(true);
            assert_eq!(guard.sample(), None);
            assert_eq!(guard.sample(), None);
            levels[2].set(false);
            assert_eq!(guard.sample(), None);
        }
    }

    #[test]
    fn the_emergency_stop_is_named_before_any_limit() {
        let levels: [Cell<bool>; INPUTS] = core::array::from_fn(|_| Cell::new(true));
        let mut guard = Guard::new(core::array::from_fn(|k| Wire(&levels[k])));
        let last = (0..DEBOUNCE_TICKS).map(|_| guard.sample()).last();
        assert_eq!(last, Some(Some(Cause::EmergencyStop)));
    }

    #[test]
    fn an_unreadable_pin_counts_as_open() {
        let mut guard = Guard::new([(); INPUTS].map(|()| Dead));
        let last = (0..DEBOUNCE_TICKS).map(|_| guard.sample()).last();
        assert_eq!(last, Some(Some(Cause::EmergencyStop)));
    }
}
