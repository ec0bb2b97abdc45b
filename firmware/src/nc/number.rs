//! Decimal numbers as printed: digits of a word come in, an exact decimal goes out; from there to
//! integers of a chosen unit, rounded once, without floats.

/// `mantissa * 10^exponent`, negated if `negative`. Exact for everything the reader accepts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Decimal {
    /// Up to 19 significant digits.
    pub mantissa: u64,
    /// Power of ten.
    pub exponent: i16,
    /// A minus sign was printed.
    pub negative: bool,
}

/// Why no number could be read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum NumberError {
    /// No digit where a number must be.
    NoDigits,
    /// More than 19 significant digits.
    TooLong,
}

/// Below this, one more digit fits 19 digits (and `u64`).
const ROOM: u64 = 1_000_000_000_000_000_000;
/// Below this, one more digit fits `u32`: the loop most numbers never leave.
const ROOM_32: u32 = 429_496_729;
/// Largest exponent kept: far beyond any range check, far below overflow of `i16` sums.
const EXPONENT_MAX: i16 = 1000;

const POWERS: [u32; 10] = [
    1,
    10,
    100,
    1_000,
    10_000,
    100_000,
    1_000_000,
    10_000_000,
    100_000_000,
    1_000_000_000,
];

impl Decimal {
    /// No number, or zero.
    pub const ZERO: Self = Self {
        mantissa: 0,
        exponent: 0,
        negative: false,
    };

    /// Reads `[+-]digits[.digits][E[+-]digits]` from `text` at `*at` and moves `*at` behind it.
    ///
    /// Zeros behind the 19th significant digit of a fraction are dropped. An `E` counts as exponent only
    /// if a number follows: in `X1ETAN` it begins the next word.
    #[inline]
    pub fn read(text: &[u8], at: &mut usize) -> Result<Self, NumberError> {
        let mut i = *at;
        let mut negative = false;
        if let Some(sign @ (b'+' | b'-')) = text.get(i) {
            negative = *sign == b'-';
            i += 1;
        }
        let begin = i;
        let mut point = usize::MAX;
        let mut small: u32 = 0;
        let mut byte;
        loop {
            byte = text.get(i).copied().unwrap_or(b' ');
            let digit = byte.wrapping_sub(b'0');
            if digit < 10 && small < ROOM_32 {
                small = small * 10 + u32::from(digit);
            } else if byte == b'.' && point == usize::MAX {
                point = i;
            } else {
                break;
            }
            i += 1;
        }
        let mut mantissa = u64::from(small);
        let mut dropped = 0;
        if byte.is_ascii_digit() {
            (i, point, mantissa, dropped) = read_long(text, i, point, mantissa)?;
            byte = text.get(i).copied().unwrap_or(b' ');
        }
        let fraction = if point == usize::MAX {
            0
        } else {
            i - point - 1
        };
        let points = usize::from(point != usize::MAX);
        if i - begin == points {
            return Err(NumberError::NoDigits);
        }
        let mut exponent = -limited(fraction.saturating_sub(dropped));
        if byte | 0x20 == b'e' {
            if let Some((behind, printed)) = read_exponent(text, i + 1) {
                i = behind;
                exponent += printed;
            }
        }
        *at = i;
        Ok(Self {
            mantissa,
            exponent,
            negative,
        })
    }

    /// The number that `value` is to nine decimals; `None` if it is not finite or beyond 2^53.
    #[cold]
    pub fn from_f64(value: f64) -> Option<Self> {
        const WHOLE: f64 = 9_007_199_254_740_992.0;
        const SCALE: f64 = 1.0e9;
        let size = libm::fabs(value);
        if size.is_nan() || size > WHOLE {
            return None;
        }
        let whole = libm::floor(size) == size;
        let (scaled, exponent) = if whole || size * SCALE > WHOLE {
            (size, 0)
        } else {
            (size * SCALE, -9)
        };
        Some(Self {
            // within 2^53
            mantissa: libm::round(scaled) as u64,
            exponent,
            negative: value < 0.0,
        })
    }

    /// Nearest `f64`; exact to half a unit in the last place up to 15 digits and 22 decimals.
    #[cold]
    pub fn to_f64(self) -> f64 {
        let mut value = self.mantissa as f64;
        let mut left = self.exponent.unsigned_abs().min(400);
        while left > 0 {
            let step = left.min(22);
            let mut power = 1.0;
            for _ in 0..step {
                // exact up to 10^22
                power *= 10.0;
            }
            value = if self.exponent < 0 {
                value / power
            } else {
                value * power
            };
            left -= step;
        }
        if self.negative {
            -value
        } else {
            value
        }
    }

    /// `round(self * factor * 10^digits)`, half away from zero; `None` beyond `i64`.
    ///
    /// `factor` is 1 or 254 (inch: 25.4 is 254 tenths), so 128 bits always suffice.
    #[inline]
    pub fn scaled(self, factor: u8, digits: i16) -> Option<i64> {
        let power = self.exponent + digits;
        let magnitude = match (
            u32::try_from(self.mantissa),
            usize::try_from(power).ok().and_then(|p| POWERS.get(p)),
        ) {
            // 2^32 * 10^9 stays below 2^63
            (Ok(small), Some(scale)) if factor == 1 => {
                (u64::from(small) * u64::from(*scale)).cast_signed()
            }
            _ => self.scaled_slowly(factor, power)?,
        };
        Some(if self.negative { -magnitude } else { magnitude })
    }

    /// Magnitude only.
    #[cold]
    fn scaled_slowly(self, factor: u8, power: i16) -> Option<i64> {
        let product = u128::from(self.mantissa) * u128::from(factor);
        if product == 0 {
            return Some(0);
        }
        let scaled = match power {
            0..=18 => product.checked_mul(10u128.pow(u32::from(power.unsigned_abs())))?,
            // product < 2^72 < 10^22 / 2
            i16::MIN..=-22 => 0,
            -21..=-1 => {
                let unit = 10u128.pow(u32::from(power.unsigned_abs()));
                (product + unit / 2) / unit
            }
            _ => return None,
        };
        i64::try_from(scaled).ok()
    }

    /// The number if it is whole and fits `i64`.
    pub fn whole(self) -> Option<i64> {
        let mut mantissa = self.mantissa;
        let mut exponent = self.exponent;
        while exponent < 0 && mantissa.is_multiple_of(10) {
            if mantissa == 0 {
                return Some(0);
            }
            mantissa /= 10;
            exponent += 1;
        }
        if exponent < 0 {
            return None;
        }
        let power = 10i128.checked_pow(u32::from(exponent.unsigned_abs()))?;
        let magnitude = i128::from(mantissa).checked_mul(power)?;
        i64::try_from(if self.negative { -magnitude } else { magnitude }).ok()
    }

    /// The number if it is printed with digits only and does not exceed `max`: `G01`, `N120`.
    #[inline]
    pub fn index(self, max: u32) -> Option<u32> {
        let plain = self.exponent == 0 && !self.negative;
        u32::try_from(self.mantissa)
            .ok()
            .filter(|value| plain && *value <= max)
    }

    /// Nearest `f32`; exact to half a unit in the last place up to 7 digits and 10 decimals,
    /// else within two units.
    pub fn to_f32(self) -> f32 {
        let mut value = u32::try_from(self.mantissa)
            .map_or_else(|_| self.mantissa as f32, |small| small as f32);
        let mut left = self.exponent.unsigned_abs().min(64);
        while left > 0 {
            let step = left.min(9);
            let power = POWERS[usize::from(step)] as f32;
            value = if self.exponent < 0 {
                value / power
            } else {
                value * power
            };
            left -= step;
        }
        if self.negative {
            -value
        } else {
            value
        }
    }
}

/// Continues a number at `i` whose digits so far no longer fit `u32`.
/// Returns the index behind it, the place of the point, the mantissa and the count of dropped zeros.
#[cold]
fn read_long(
    text: &[u8],
    mut i: usize,
    mut point: usize,
    mut mantissa: u64,
) -> Result<(usize, usize, u64, usize), NumberError> {
    let mut dropped = 0;
    while let Some(byte) = text.get(i) {
        match byte {
            b'0'..=b'9' if mantissa < ROOM && dropped == 0 => {
                mantissa = mantissa * 10 + u64::from(byte - b'0')
            }
            b'0' if point != usize::MAX => dropped += 1,
            b'0'..=b'9' => return Err(NumberError::TooLong),
            b'.' if point == usize::MAX => point = i,
            _ => break,
        }
        i += 1;
    }
    Ok((i, point, mantissa, dropped))
}

/// Digits behind an `E` at `i - 1`: index behind them and their value; `None` if no number follows.
#[cold]
fn read_exponent(text: &[u8], mut i: usize) -> Option<(usize, i16)> {
    let negative = text.get(i) == Some(&b'-');
    if let Some(b'+' | b'-') = text.get(i) {
        i += 1;
    }
    let begin = i;
    let mut value: i16 = 0;
    while let Some(digit @ b'0'..=b'9') = text.get(i) {
        value = (value * 10 + i16::from(digit - b'0')).min(EXPONENT_MAX);
        i += 1;
    }
    (i > begin).then_some((i, if negative { -value } else { value }))
}

fn limited(count: usize) -> i16 {
    i16::try_from(count).map_or(EXPONENT_MAX, |count| count.min(EXPONENT_MAX))
}
