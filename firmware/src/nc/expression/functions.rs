//! The functions of an expression: numbers come in, a number or the reason why there is none goes out.

use super::ExpressionError;
use core::f64::consts::PI;

/// Largest angle: its distance to a multiple of 90 degrees is still known to 1e-4 degree.
const ANGLE_MAX: f64 = 1.0e12;

/// What a name stands for.
#[derive(Clone, Copy)]
pub(super) enum Function {
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Atan2,
    Sqrt,
    Abs,
    Square,
    Round,
    Trunc,
    Ln,
    Exp,
}

/// Names of the functions.
pub(super) static FUNCTIONS: [(&[u8], Function); 14] = [
    (b"SIN", Function::Sin),
    (b"COS", Function::Cos),
    (b"TAN", Function::Tan),
    (b"ASIN", Function::Asin),
    (b"ACOS", Function::Acos),
    (b"ATAN2", Function::Atan2),
    (b"ATAN", Function::Atan),
    (b"SQRT", Function::Sqrt),
    (b"ABS", Function::Abs),
    (b"POT", Function::Square),
    (b"ROUND", Function::Round),
    (b"TRUNC", Function::Trunc),
    (b"LN", Function::Ln),
    (b"EXP", Function::Exp),
];

/// Value of `function` at `x`, angles in degrees; `second` counts for `ATAN2` only. May be infinite.
///
/// # Errors
/// Outside its domain; division by zero.
pub(super) fn apply(function: Function, x: f64, second: f64) -> Result<f64, ExpressionError> {
    let within = |good: bool| {
        if good {
            Ok(())
        } else {
            Err(ExpressionError::Domain)
        }
    };
    Ok(match function {
        Function::Sin => sine(x, 0)?,
        Function::Cos => sine(x, 1)?,
        Function::Tan => {
            let cosine = sine(x, 1)?;
            if cosine == 0.0 {
                return Err(ExpressionError::DivisionByZero);
            }
            sine(x, 0)? / cosine
        }
        Function::Asin => {
            within(x.abs() <= 1.0)?;
            direction(x, libm::sqrt((1.0 - x) * (1.0 + x)))
        }
        Function::Acos => {
            within(x.abs() <= 1.0)?;
            direction(libm::sqrt((1.0 - x) * (1.0 + x)), x)
        }
        Function::Atan => direction(x, 1.0),
        Function::Atan2 => {
            within(x != 0.0 || second != 0.0)?;
            direction(x, second)
        }
        Function::Sqrt => {
            within(x >= 0.0)?;
            libm::sqrt(x)
        }
        Function::Abs => x.abs(),
        Function::Square => x * x,
        Function::Round => libm::round(x),
        Function::Trunc => libm::trunc(x),
        Function::Ln => {
            within(x > 0.0)?;
            libm::log(x)
        }
        Function::Exp => libm::exp(x),
    })
}

/// Sine of `degrees + 90 * quarters`. The angle is folded into +-45 degrees before it becomes radians, so multiples
/// of 90 degrees are exact. Taylor series: beyond the eighth term both are below 1e-17 there.
fn sine(degrees: f64, quarters: u8) -> Result<f64, ExpressionError> {
    if !(degrees.abs() <= ANGLE_MAX) {
        return Err(ExpressionError::Domain);
    }
    let turn = libm::round(degrees / 90.0);
    let x = (degrees - 90.0 * turn) * (PI / 180.0);
    // ANGLE_MAX / 90 fits
    let quadrant = (turn as i64).wrapping_add(i64::from(quarters)) & 3;
    let even = quadrant & 1 != 0;
    let mut sum = 1.0;
    for term in (1..=8).rev() {
        let n = f64::from(2 * term);
        let factors = if even { n * (n - 1.0) } else { n * (n + 1.0) };
        sum = 1.0 - x * x / factors * sum;
    }
    let value = if even { sum } else { x * sum };
    Ok(if quadrant >= 2 { -value } else { value })
}

/// Direction of the vector (x, y) in degrees, -180 to 180; through the one arc tangent, exact on the axes.
fn direction(y: f64, x: f64) -> f64 {
    let (ay, ax) = (y.abs(), x.abs());
    let degrees = 180.0 / PI;
    let first = if ay <= ax {
        if ax == 0.0 {
            0.0
        } else {
            libm::atan(ay / ax) * degrees
        }
    } else {
        90.0 - libm::atan(ax / ay) * degrees
    };
    let upper = if x < 0.0 { 180.0 - first } else { first };
    if y < 0.0 {
        -upper
    } else {
        upper
    }
}
