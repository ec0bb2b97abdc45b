//! The edge of the core: machine built into an image, safety inputs, trace port, and the hardware.
//!
//! Whatever needs no register compiles, and is tested, on the host. The modules behind `target_os = "none"`
//! touch hardware; they move bytes, words and levels, and hold no motion arithmetic.

pub mod guard;
pub mod ring;
pub mod trace;

#[cfg(all(target_os = "none", feature = "stm32f4"))]
pub mod copy;
#[cfg(all(target_os = "none", feature = "stm32f4", feature = "qemu"))]
#[path = "emulated.rs"]
pub mod hardware;
#[cfg(all(target_os = "none", feature = "stm32f4", not(feature = "qemu")))]
pub mod hardware;
#[cfg(all(target_os = "none", feature = "stm32f4"))]
pub mod log;
#[cfg(all(target_os = "none", feature = "stm32f4", not(feature = "qemu")))]
pub mod pins;
#[cfg(all(target_os = "none", feature = "stm32f4"))]
pub mod servo_timer;
#[cfg(all(target_os = "none", feature = "stm32f4"))]
pub mod stack;
#[cfg(all(target_os = "none", feature = "stm32f4", not(feature = "qemu")))]
pub mod step_dma;
#[cfg(all(target_os = "none", feature = "stm32f4"))]
pub mod stop;
#[cfg(all(target_os = "none", feature = "stm32f4"))]
pub mod usart;

use crate::config::Config;

/// The machine this build was made for: `machines/mcv1210.toml`, or the file that the environment variable
/// `PENTASPLINE_MACHINE` named at build time (relative to the top of the workspace).
pub static MACHINE: Config = include!(concat!(env!("OUT_DIR"), "/machine.rs"));
