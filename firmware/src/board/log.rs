//! Log lines: through defmt over RTT with the feature `defmt`, nothing without it.
//!
//! The one place that names defmt, so that no other module depends on the feature.

#[cfg(feature = "defmt")]
use defmt_rtt as _;

/// Logs what a person at the debugger wants to know. Arguments as for `defmt::info!`.
#[macro_export]
macro_rules! log_info {
    ($($arg:tt)*) => {
        $crate::board::log::__log!(info, $($arg)*)
    };
}

/// Logs what went wrong. Arguments as for `defmt::warn!`.
#[macro_export]
macro_rules! log_warn {
    ($($arg:tt)*) => {
        $crate::board::log::__log!(warn, $($arg)*)
    };
}

#[cfg(feature = "defmt")]
#[doc(hidden)]
pub use defmt as __defmt;

#[doc(hidden)]
#[macro_export]
#[cfg(feature = "defmt")]
macro_rules! __log {
    ($level:ident, $($arg:tt)*) => {
        $crate::board::log::__defmt::$level!($($arg)*)
    };
}

#[doc(hidden)]
#[macro_export]
#[cfg(not(feature = "defmt"))]
macro_rules! __log {
    ($level:ident, $text:literal $(, $arg:expr)* $(,)?) => {{
        $(let _ = &$arg;)*
    }};
}

#[doc(hidden)]
pub use crate::__log;

#[cfg(feature = "defmt")]
defmt::timestamp!("{=u32}", crate::board::servo_timer::ticks());
