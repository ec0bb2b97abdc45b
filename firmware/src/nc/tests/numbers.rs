//! The decimal reader against exact rational arithmetic on the printed text.

use crate::nc::number::{Decimal, NumberError};
use proptest::prelude::*;

fn read(text: &str) -> (Result<Decimal, NumberError>, usize) {
    let mut at = 0;
    let decimal = Decimal::read(text.as_bytes(), &mut at);
    (decimal, at)
}

/// `numerator * 10^power == printed value` from the parts of the text, by `i128` alone.
fn rational(negative: bool, whole: &str, fraction: &str, exponent: i32) -> (i128, i32) {
    let digits: i128 = format!("0{whole}{fraction}").parse().unwrap();
    (
        if negative { -digits } else { digits },
        exponent - i32::try_from(fraction.len()).unwrap(),
    )
}

/// True if `result` is `value * factor * 10^digits` rounded to nearest, half away from zero.
fn is_nearest(result: i64, (numerator, power): (i128, i32), factor: i128, digits: i32) -> bool {
    let (mut left, mut right) = (i128::from(result), numerator * factor);
    match power + digits {
        scale @ 0.. => right *= 10i128.pow(scale.unsigned_abs()),
        scale => left *= 10i128.pow(scale.unsigned_abs()),
    }
    let unit = 10i128.pow((-(power + digits)).max(0).unsigned_abs());
    let error = (left - right) * right.signum();
    // the magnitude may be too large by half a unit (ties go away from zero), too small by less
    2 * error <= unit && 2 * error > -unit
}

proptest! {
    #[test]
    fn decimals_are_the_nearest_nano_of_the_printed_rational(
        negative: bool,
        whole in "[0-9]{0,6}",
        fraction in "[0-9]{0,10}",
        exponent in -3i32..=3,
        with_exponent: bool,
    ) {
        prop_assume!(!(whole.is_empty() && fraction.is_empty()));
        let sign = if negative { "-" } else { "" };
        let exponent = if with_exponent { exponent } else { 0 };
        let tail = if with_exponent { format!("E{exponent}") } else { String::new() };
        let text = format!("{sign}{whole}.{fraction}{tail}");
        let (decimal, end) = read(&text);
        let decimal = decimal.unwrap();
        prop_assert_eq!(end, text.len());
        let value = rational(negative, &whole, &fraction, exponent);
        prop_assert!(is_nearest(decimal.scaled(1, 6).unwrap(), value, 1, 6));
        prop_assert!(is_nearest(decimal.scaled(254, 5).unwrap(), value, 254, 5));
        prop_assert!(is_nearest(decimal.scaled(1, 3).unwrap(), value, 1, 3));
        let exact: f64 = text.parse().unwrap();
        prop_assert!((f64::from(decimal.to_f32()) - exact).abs() <= 2.0 * f64::from(f32::EPSILON) * exact.abs());
        let whole_value = exact.trunc() == exact && exact.abs() < 1e9;
        prop_assert_eq!(decimal.whole(), whole_value.then_some(exact as i64));
    }

    #[test]
    fn integers_of_any_size_are_exact(value: i64) {
        let text = value.to_string();
        let (decimal, end) = read(&text);
        prop_assert_eq!(end, text.len());
        prop_assert_eq!(decimal.unwrap().whole(), Some(value));
        prop_assert_eq!(read(&format!("{text}.000")).0.ok().and_then(Decimal::whole), (text.trim_start_matches('-').len() <= 19).then_some(value));
    }
}

#[test]
fn halves_round_away_from_zero() {
    for (text, nano) in [
        ("0.0000005", 1),
        ("-0.0000005", -1),
        ("0.00000049999999999", 0),
        ("1.0000015", 1_000_002),
        ("-0", 0),
        ("5E-7", 1),
        ("4.9E-7", 0),
        ("1E-30", 0),
        ("1E-9999999999", 0),
        ("0E99", 0),
        ("12.", 12_000_000),
        ("+.5", 500_000),
    ] {
        assert_eq!(read(text).0.unwrap().scaled(1, 6), Some(nano), "{text}");
    }
    // 1/254 of a half nanometre: 0.00000005 inch is 1.27 nm
    assert_eq!(read("0.00000005").0.unwrap().scaled(254, 5), Some(1));
    assert_eq!(read("1").0.unwrap().scaled(254, 5), Some(25_400_000));
    assert_eq!(
        read("0.3937007874015748031").0.unwrap().scaled(254, 5),
        Some(10_000_000)
    );
}

#[test]
fn what_does_not_fit_is_said_and_not_wrapped() {
    for text in [
        "9223372036855",
        "1E13",
        "1E30",
        "1E9999999",
        "9999999999999999999",
    ] {
        assert_eq!(read(text).0.unwrap().scaled(1, 6), None, "{text}");
    }
    assert_eq!(
        read("9223372036854.775807").0.unwrap().scaled(1, 6),
        Some(i64::MAX)
    );
    assert_eq!(read("9223372036854775808").0.unwrap().whole(), None);
    assert_eq!(read("1E30").0.unwrap().whole(), None);
}

#[test]
fn digits_beyond_nineteen_are_refused_unless_they_are_zeros_of_a_fraction() {
    assert_eq!(
        read("1.0000000000000000000000000").0.unwrap().scaled(1, 6),
        Some(1_000_000)
    );
    assert_eq!(
        read("0.000000000000000000000000012")
            .0
            .unwrap()
            .scaled(1, 6),
        Some(0)
    );
    assert_eq!(
        read("000000000000000000000000012").0.unwrap().scaled(1, 0),
        Some(12)
    );
    assert_eq!(
        read("1.00000000000000000000000001").0,
        Err(NumberError::TooLong)
    );
    assert_eq!(read("12345678901234567890").0, Err(NumberError::TooLong));
    assert_eq!(read("10000000000000000000").0, Err(NumberError::TooLong));
}

#[test]
fn an_e_without_a_number_begins_the_next_word() {
    for (text, end) in [
        ("1ETAN", 1),
        ("1E+", 1),
        ("1e-x", 1),
        ("1E2ETAN", 3),
        ("1.5e-3Y", 6),
        ("1.E1", 4),
    ] {
        assert_eq!(read(text).1, end, "{text}");
    }
}

#[test]
fn signs_and_points_alone_are_no_number() {
    for text in ["", "-", "+", ".", "-.", "--1", "+-1", "x"] {
        assert_eq!(read(text), (Err(NumberError::NoDigits), 0), "{text}");
    }
}
