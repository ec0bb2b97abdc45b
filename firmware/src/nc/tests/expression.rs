//! Expressions against `f64` arithmetic of the standard library, and against hostile text.

use crate::nc::expression::{
    compare, evaluate, parameter_index, ExpressionError, ExpressionError::*, Fault,
};
use crate::nc::parameters::{Parameters, PARAMETERS};
use proptest::prelude::*;

/// R0 = 0, R1 = 1.5, R2 = 2.5, ..
fn parameters() -> Parameters {
    let mut parameters = Parameters::new();
    for index in 1..PARAMETERS {
        assert!(parameters.set(index, index as f64 + 0.5));
    }
    parameters
}

/// Value and the text left over.
fn value(text: &str) -> Result<(f64, &str), Fault> {
    let mut at = 0;
    let value = evaluate(text.as_bytes(), &mut at, &parameters())?;
    Ok((value, &text[at..]))
}

fn fault(text: &str) -> (ExpressionError, &str) {
    let fault = value(text).unwrap_err();
    (fault.kind, &text[fault.at..][..fault.length])
}

fn truth(text: &str) -> Result<bool, ExpressionError> {
    let mut at = 0;
    compare(text.as_bytes(), &mut at, &parameters()).map_err(|fault| fault.kind)
}

fn near(text: &str, expected: f64) {
    let (value, rest) = value(text).unwrap();
    let error = (value - expected).abs();
    assert!(
        error <= 4.0 * f64::EPSILON * expected.abs().max(1e-3) && rest.is_empty(),
        "{text}: {value:e} instead of {expected:e}, left {rest:?}"
    );
}

#[test]
fn operators_bind_as_on_the_840d() {
    for (text, expected) in [
        ("2+3*4", 14.0),
        ("2*3+4", 10.0),
        ("(2+3)*4", 20.0),
        ("2-3-4", -5.0),
        ("24/4/2", 3.0),
        ("7DIV4.1*2", 2.0),
        ("7 MOD 4 + 1", 4.0),
        ("-7MOD4", -3.0),
        ("-7DIV4", -1.0),
        ("-2*-3", 6.0),
        ("--2-+-3", 5.0),
        ("-(1+2)*3", -9.0),
        ("R2+3*R1", 7.0),
        ("R[R[1]+0.5]", 2.5),
        ("R[0.1*3*10-1]", 2.5),
        ("r99", 99.5),
        (" R [ 1 + 1 ] * 2 ", 5.0),
        ("2-POT(3)-1", -8.0),
    ] {
        near(text, expected);
    }
}

#[test]
fn numbers_have_exponents_of_both_spellings() {
    for (text, expected) in [
        ("1.5EX-3", 1.5e-3),
        ("2ex4", 2.0e4),
        ("2E+4", 2.0e4),
        ("1.25E-2", 1.25e-2),
        (".5", 0.5),
        ("5.", 5.0),
        ("123456789012345", 123_456_789_012_345.0),
        ("0.1", 0.1),
        ("1EX300*1EX-300", 1.0),
        ("0EX999", 0.0),
    ] {
        near(text, expected);
    }
}

#[test]
fn an_expression_ends_before_the_first_byte_that_cannot_continue_it() {
    for (text, expected, rest) in [
        ("R2+3X5", 5.5, "X5"),
        ("1.5EXP(1)", 1.5, "EXP(1)"),
        ("1ETAN", 1.0, "ETAN"),
        ("2DX", 2.0, "DX"),
        ("3;text", 3.0, ";text"),
        ("3 (text)", 3.0, "(text)"),
        ("R1R2", 1.5, "R2"),
        ("1)", 1.0, ")"),
        ("1==2", 1.0, "==2"),
    ] {
        assert_eq!(value(text), Ok((expected, rest)), "{text}");
    }
}

#[test]
fn multiples_of_a_quarter_turn_are_exact() {
    for (text, expected) in [
        ("SIN(180)", 0.0),
        ("SIN(-90)", -1.0),
        ("COS(90)", 0.0),
        ("COS(-180)", -1.0),
        ("SIN(36000000090)", 1.0),
        ("TAN(180)", 0.0),
        ("ATAN2(0,-1)", 180.0),
        ("ATAN2(-1,0)", -90.0),
        ("ATAN2(0,3)", 0.0),
        ("ASIN(1)", 90.0),
        ("ACOS(-1)", 180.0),
        ("ACOS(0)", 90.0),
    ] {
        assert_eq!(value(text), Ok((expected, "")), "{text}");
    }
    assert_eq!(fault("TAN(90)"), (DivisionByZero, "TAN(90)"));
    assert_eq!(fault("1+TAN(-270)").0, DivisionByZero);
}

#[test]
fn functions_agree_with_the_standard_library() {
    for step in -800..=800 {
        let x = f64::from(step) * 0.4375;
        let unit = f64::from(step) / 800.0;
        let angle = x.to_radians();
        let bound = 1.0e-15 * (1.0 + angle.abs());
        for (text, expected, bound) in [
            (format!("SIN({x})"), angle.sin(), bound),
            (format!("COS({x})"), angle.cos(), bound),
            (format!("ASIN({unit})"), unit.asin().to_degrees(), 4.0e-14),
            (format!("ACOS({unit})"), unit.acos().to_degrees(), 8.0e-14),
            (format!("ATAN({x})"), x.atan().to_degrees(), 4.0e-14),
            (
                format!("ATAN2({x},{unit}-0.3001)"),
                x.atan2(unit - 0.3001).to_degrees(),
                8.0e-14,
            ),
            (format!("ABS({x})"), x.abs(), 0.0),
            (format!("POT({x})"), x * x, 0.0),
            (format!("SQRT({})", x.abs()), x.abs().sqrt(), 0.0),
            (format!("ROUND({x})"), x.round(), 0.0),
            (format!("TRUNC({x})"), x.trunc(), 0.0),
            (
                format!("EXP({unit}*5)"),
                (unit * 5.0).exp(),
                3.0e-16 * (unit * 5.0).exp(),
            ),
            (
                format!("LN({})", x.abs() + 0.01),
                (x.abs() + 0.01).ln(),
                2.0e-15,
            ),
        ] {
            let (value, rest) = value(&text).unwrap();
            assert!(
                (value - expected).abs() <= bound && rest.is_empty(),
                "{text}: {value:e} instead of {expected:e}"
            );
        }
        let tangent = angle.tan();
        if tangent.abs() < 1.0e3 {
            let (value, _) = value(&format!("TAN({x})")).unwrap();
            let slope = 1.0 + tangent * tangent;
            assert!((value - tangent).abs() <= bound * slope, "TAN({x})");
        }
    }
}

#[test]
fn what_has_no_result_is_refused_by_name_and_place() {
    for (text, expected) in [
        ("", (ValueExpected, "")),
        ("2+", (ValueExpected, "")),
        ("2*/3", (ValueExpected, "")),
        ("()", (ValueExpected, "")),
        ("R", (ValueExpected, "")),
        (".", (Number, ".")),
        ("2EX+", (Number, "2EX")),
        ("2EX1.5", (Number, "2EX1.5")),
        ("12345678901234567890", (Number, "12345678901234567890")),
        ("1+FOO(2)", (UnknownFunction, "FOO")),
        ("RX1", (UnknownFunction, "RX1")),
        ("2*$AA_IM[X]", (SystemVariable, "$AA_IM")),
        ("(1+2", (Punctuation, "")),
        ("R[1", (Punctuation, "")),
        ("SIN 30", (Punctuation, "")),
        ("SIN;", (Punctuation, "")),
        ("ATAN2(1)", (Punctuation, "")),
        ("R100", (Parameter, "R100")),
        ("1+R[-1]", (Parameter, "R[-1]")),
        ("R[1.5]", (Parameter, "R[1.5]")),
        ("R[R2/3]", (Parameter, "R[R2/3]")),
        (
            "R99999999999999999999999",
            (Parameter, "R99999999999999999999999"),
        ),
        ("1/0", (DivisionByZero, "/")),
        ("1 DIV(2-2)", (DivisionByZero, "DIV")),
        ("1MOD0", (DivisionByZero, "MOD")),
        ("SQRT(-1)", (Domain, "SQRT(-1)")),
        ("2*LN(0)", (Domain, "LN(0)")),
        ("ASIN(1.001)", (Domain, "ASIN(1.001)")),
        ("ATAN2(0,0)", (Domain, "ATAN2(0,0)")),
        ("SIN(1EX13)", (Domain, "SIN(1EX13)")),
        ("EXP(1000)", (TooLarge, "EXP(1000)")),
        ("POT(1EX200)", (TooLarge, "POT(1EX200)")),
        ("1EX200*1EX200", (TooLarge, "*")),
        ("1EX999", (TooLarge, "1EX999")),
        ("1EX200/1EX-200", (TooLarge, "/")),
        ("((((((((((((1))))))))))))", (Nesting, "")),
    ] {
        assert_eq!(fault(text), expected, "{text}");
    }
    near("((((((((((1))))))))))", 1.0);
}

#[test]
fn an_error_leaves_the_reading_place_where_it_was() {
    let mut at = 3;
    assert!(evaluate(b"X1=2+", &mut at, &Parameters::new()).is_err());
    assert!(compare(b"X1=2+", &mut at, &Parameters::new()).is_err());
    assert!(parameter_index(b"X1=2+", &mut at, &Parameters::new()).is_err());
    assert_eq!(at, 3);
    at = 99;
    assert!(evaluate(b"1", &mut at, &Parameters::new()).is_err());
}

#[test]
fn the_left_side_of_an_assignment_is_an_index() {
    for (text, index, rest) in [
        ("R5=1", 5, "=1"),
        ("r [ R1+.5 ] = 1", 2, "= 1"),
        ("R07", 7, ""),
    ] {
        let mut at = 0;
        let found = parameter_index(text.as_bytes(), &mut at, &parameters());
        assert_eq!((found, &text[at..]), (Ok(index), rest));
    }
}

#[test]
fn parameters_hold_finite_numbers_only() {
    let mut parameters = Parameters::new();
    assert!(!parameters.set(PARAMETERS, 1.0));
    assert!(!parameters.set(3, f64::NAN));
    assert_eq!(parameters, Parameters::new());
    assert_eq!(
        (parameters.get(3), parameters.get(PARAMETERS)),
        (Some(0.0), None)
    );
}

#[test]
fn conditions_compare_and_connect() {
    for (text, expected) in [
        ("R1<R2", Ok(true)),
        ("R1 >= 1.5", Ok(true)),
        ("R1<>1.5", Ok(false)),
        ("0.1+0.2==0.3", Ok(true)),
        ("0.1+0.2>0.3", Ok(false)),
        ("0.1+0.2<=0.3", Ok(true)),
        ("1.000000001>1", Ok(true)),
        ("0==0", Ok(true)),
        ("(1+2)*3==9", Ok(true)),
        ("((1+2)*3==9)", Ok(true)),
        ("(1<2)AND(2<1)", Ok(false)),
        ("(1<2) OR (2<1) AND (2<1)", Ok(true)),
        ("(1<2) XOR (2>1)", Ok(false)),
        ("(1<2) XOR (2>1) OR (1==1)", Ok(true)),
        ("NOT(1<2)", Ok(false)),
        ("NOT NOT (1<2)", Ok(true)),
        ("NOT((1>2)OR(3>4))", Ok(true)),
        ("R1", Err(ComparisonExpected)),
        ("(R1)", Err(ComparisonExpected)),
        ("R1=1", Err(ComparisonExpected)),
        ("R1==", Err(ValueExpected)),
        ("1<2 AND 2<3", Err(BareComparison)),
        ("NOT 1<2", Err(BareComparison)),
        ("(1<2", Err(Punctuation)),
        ("((((((((((((((1<2))))))))))))))", Err(Nesting)),
    ] {
        assert_eq!(truth(text), expected, "{text}");
    }
}

#[test]
fn a_condition_ends_before_its_jump() {
    let text = b"(R1==1.5) AND (R2>2) GOTOF END";
    let mut at = 0;
    assert_eq!(compare(text, &mut at, &parameters()), Ok(true));
    assert_eq!(&text[at..], b"GOTOF END");
}

/// A random sum of products and its value by the standard library.
fn tree() -> impl Strategy<Value = (String, f64)> {
    let leaf = (0u32..4000).prop_map(|n| {
        let value = f64::from(n) / 16.0;
        (format!("{value}"), value)
    });
    leaf.prop_recursive(5, 24, 2, |inner| {
        (inner.clone(), inner, 0..5).prop_map(|((a, x), (b, y), kind)| match kind {
            0 => (format!("({a} + {b})"), x + y),
            1 => (format!("({a}-{b})"), x - y),
            2 => (format!("({a}*{b})"), x * y),
            3 => (format!("ABS({a} - {b})"), (x - y).abs()),
            _ => (format!("(-({a})/(ABS({b})+1))"), -x / (y.abs() + 1.0)),
        })
    })
}

proptest! {
    #[test]
    fn sums_and_products_give_the_bits_of_the_standard_library((text, expected) in tree()) {
        let mut at = 0;
        match evaluate(text.as_bytes(), &mut at, &Parameters::new()) {
            Ok(value) => {
                prop_assert_eq!(value, expected);
                prop_assert_eq!(at, text.len());
            }
            Err(fault) => prop_assert_eq!(fault.kind, Nesting),
        }
    }

    #[test]
    fn decimals_are_the_nearest_number(mantissa in 0u64..1_000_000_000_000_000, decimals in 0usize..15) {
        let mut text = format!("{mantissa:0>16}");
        text.insert(16 - decimals, '.');
        let mut at = 0;
        let value = evaluate(text.as_bytes(), &mut at, &Parameters::new());
        prop_assert_eq!(value, Ok(text.parse::<f64>().unwrap()));
    }

    #[test]
    fn no_bytes_do_harm(text in prop::collection::vec(any::<u8>(), 0..200), at in 0usize..220) {
        let mut here = at;
        let result = evaluate(&text, &mut here, &Parameters::new());
        prop_assert!(result.is_err() || result.is_ok_and(f64::is_finite) && here <= text.len());
        let mut here = at;
        let _ = compare(&text, &mut here, &Parameters::new());
        let mut here = at;
        let _ = parameter_index(&text, &mut here, &Parameters::new());
    }

    #[test]
    fn no_soup_of_its_own_words_does_harm(
        words in prop::collection::vec(
            prop::sample::select(vec![
                "(", ")", "[", "]", "R", "1", "99", ".", "EX", "-", "+", "*", "/", "DIV", "MOD", "SIN(", "ATAN2(", ",",
                "EXP(", "LN(", "NOT", "(", "(", "AND", "==", "<", ">=", " ", "1EX300", "$X", "SQRT(", "TAN(", "POT(",
            ]),
            0..60,
        )
    ) {
        let text = words.concat();
        let parameters = parameters();
        let mut at = 0;
        match evaluate(text.as_bytes(), &mut at, &parameters) {
            Ok(value) => prop_assert!(value.is_finite() && at <= text.len()),
            Err(fault) => prop_assert!(fault.at + fault.length <= text.len()),
        }
        let mut at = 0;
        if let Err(fault) = compare(text.as_bytes(), &mut at, &parameters) {
            prop_assert!(fault.at + fault.length <= text.len());
        }
    }
}
