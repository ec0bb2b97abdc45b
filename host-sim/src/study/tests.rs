use std::sync::OnceLock;

use super::*;

/// Mean absolute geometric error in mm of A, B, C and straight lines on the same knots, found by an independent
/// calculation on closed curves; rows in the order of [`FINISHING`].
const GEOMETRY: [[f64; 4]; 6] = [
    [0.0006, 0.0076, 0.0007, 0.0026],
    [0.0326, 0.179, 0.0052, 0.0596],
    [0.626, 1.073, 0.353, 0.640],
    [0.0005, 0.0088, 0.0003, 0.0028],
    [0.0022, 0.0362, 0.0003, 0.0139],
    [0.0274, 0.305, 0.0320, 0.107],
];

/// The 24 rows, run once for all tests.
fn measured() -> &'static [Row] {
    static ROWS: OnceLock<Vec<Row>> = OnceLock::new();
    ROWS.get_or_init(|| run(&Machine::built_in().unwrap(), 2, &|| ()).unwrap())
}

#[test]
fn the_24_rows_agree_with_the_independent_geometry_and_23_printed_verdicts() {
    let rows = measured();
    assert_eq!(rows.len(), 24);
    for (row, expected) in rows.iter().zip(GEOMETRY.as_flattened()) {
        let coarse = row.set.distinct() == 24;
        let tolerance = if coarse { 0.02 } else { 0.003 };
        let found = mae(&row.geometry);
        let name = format!("{:?} {:?}", row.method, row.set);
        assert!(
            (found - expected).abs() < tolerance,
            "{name}: {found} instead of {expected}"
        );
    }
    let differing: Vec<_> = rows
        .iter()
        .filter(|row| row.verdict() != row.printed.verdict)
        .map(|row| (row.method, row.set))
        .collect();
    assert_eq!(differing, [(Method::B, FINISHING[0])]);
}

#[test]
fn the_cutter_never_digs_in_and_leaves_material_only_where_it_does_not_reach() {
    for row in measured() {
        let name = format!("{:?} {:?}", row.method, row.set);
        // Inner corners of polygons that are control points; the A-spline on the widest knots is tighter than the cutter.
        let reach = match (row.method, row.set.distinct()) {
            (Method::Linear, _) => 0.15,
            (Method::A, 24) => 0.03,
            _ => 0.002,
        };
        for i in 0..11 {
            let off = row.commanded[i] - row.geometry[i];
            // All control points have x <= 0 <= y.
            let left = if i == 0 { off } else { -off };
            let point = i + 1;
            assert!(
                left > -0.001 && left < reach,
                "{name}, point {point}: {left}"
            );
        }
        let driven = mae(&row.machined) - mae(&row.commanded);
        assert!(driven.abs() < 0.01, "{name}: {driven}");
    }
}

#[test]
fn no_program_is_faster_than_its_feed_allows() {
    // Three turns of the contour at 1530 mm/min.
    let least = 3.0 * contour::PRINTED_LENGTH_MM / (1530.0 / 60.0);
    for row in measured() {
        let name = format!("{:?} {:?}", row.method, row.set);
        // A B-spline on coarse knots cuts the lobes off.
        let share = if row.method == Method::B { 0.8 } else { 0.95 };
        assert!(row.time_s > share * least, "{name}: {}", row.time_s);
        assert!(row.time_s < 120.0, "{name}: {}", row.time_s);
        assert!(row.min_feed_mm_min < 1.6 * 1530.0, "{name}");
        if row.method == Method::Linear {
            assert_eq!(row.min_feed_mm_min.round(), 0.0, "corners stop: {name}");
        }
    }
}

#[test]
fn the_json_file_has_24_objects_with_the_fixed_keys_first() {
    let rows = measured();
    let text = table::json(rows).unwrap();
    let value: serde_json::Value = serde_json::from_str(&text).unwrap();
    let array = value.as_array().unwrap();
    assert_eq!(array.len(), 24);
    let fixed = [
        "method",
        "distribution",
        "knots",
        "mae_geometry_mm",
        "mae_machined_mm",
        "mae_thesis_mm",
        "verdict",
        "verdict_thesis",
        "time_s",
        "time_thesis_s",
        "min_feed_mm_min",
    ];
    let mut at = 0;
    for key in fixed {
        at += text[at..].find(&format!("\"{key}\":")).unwrap();
    }
    for object in array {
        for key in fixed {
            let value = &object[key];
            assert!(value.is_string() || value.is_number(), "{key}: {value}");
        }
        assert!(["A", "B", "C", "linear"].contains(&object["method"].as_str().unwrap()));
        assert!(["OK", "NOT"].contains(&object["verdict"].as_str().unwrap()));
    }
    let page = page::html(rows, "<machine>");
    assert!(page.contains("&lt;machine&gt;") && !page.contains("http"));
    assert_eq!(page.matches("<svg").count(), 6);
}
