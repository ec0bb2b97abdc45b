//! The study as one HTML file that loads nothing from elsewhere.
//!
//! In: [`Row`]s. Out: the text of the page, in the style of the run report; the charts are drawn here, as SVG.

use std::fmt::Write as _;

use super::contour::{CONTROL_DEGREES, HOLLOW_MM};
use super::knots::{Distribution, KnotSet, FINISHING};
use super::programs::{Method, METHODS, TOOL_RADIUS_MM};
use super::table::{agreeing, feed_text};
use super::thesis::{Verdict, FLOOR_MM, LIMIT_MM, SIZES_KB};
use super::{mae, Row};

const STYLE: &str = include_str!("../report/report.css");
const OWN_STYLE: &str = "
.charts { display: grid; grid-template-columns: repeat(auto-fit, minmax(320px, 1fr)); gap: 12px; }
.charts figure { margin: 0; }
.charts figcaption { color: var(--muted); font-size: 13px; text-align: center; }
svg { width: 100%; height: auto; }
svg text { fill: var(--muted); font-size: 9px; text-anchor: middle; }
.ring { fill: none; stroke: var(--rule); }
.zero { fill: none; stroke: var(--muted); }
.curve { fill: none; stroke-width: 1.2; stroke-linejoin: round; }
.differs { color: var(--warn); font-weight: 600; }
.legend span { margin-right: 18px; }
td.text { white-space: normal; }
";

/// Radius of the ring that stands for no error, in units of the drawing.
const RING: f64 = 78.0;
/// Units of the drawing the largest error of a chart takes.
const SWING: f64 = 48.0;

/// The whole page; `machine` is the name of the machine.
#[must_use]
pub fn html(rows: &[Row], machine: &str) -> String {
    let mut out = String::with_capacity(200_000);
    // Writing to a string does not fail: results are dropped throughout.
    let _ = write!(
        out,
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <meta name=\"color-scheme\" content=\"light dark\">\n<title>Thesis study</title>\n\
         <link rel=\"icon\" href=\"data:,\">\n<style>{STYLE}{OWN_STYLE}</style>\n</head>\n<body>\n<main>\n\
         <header><h1>24 finishing programs, run again</h1>\n\
         <p>r(&theta;) = 18 + 4 cos 2&theta; cos 6&theta; mm, cutter radius 2 mm, F1530, on {}</p>{}</header>\n",
        escaped(machine),
        facts(rows),
    );
    out.push_str(&suitability(rows, Distribution::Polar));
    out.push_str(&suitability(rows, Distribution::Equidistant));
    out.push_str(&charts(rows));
    out.push_str(&times(rows));
    out.push_str(&sizes(rows));
    out.push_str(&findings(rows));
    out.push_str("</main>\n</body>\n</html>\n");
    out
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
}

fn facts(rows: &[Row]) -> String {
    let worst = |errors: &dyn Fn(&Row) -> f64| rows.iter().map(errors).fold(0.0, f64::max);
    let driven = worst(&|row| (mae(&row.machined) - mae(&row.geometry)).abs());
    format!(
        "<dl class=\"facts\"><div><dt>Verdicts that agree</dt><dd>{} of {}</dd></div>\
         <div><dt>Limit of the thesis</dt><dd>{LIMIT_MM} mm</dd></div>\
         <div><dt>Floor of its measuring</dt><dd>{FLOOR_MM} mm</dd></div>\
         <div><dt>Largest difference machined to geometry</dt><dd>{driven:.4} mm</dd></div></dl>",
        agreeing(rows),
        rows.len(),
    )
}

/// Table 3.14.1 or 3.14.2 with our columns beside the printed ones.
fn suitability(rows: &[Row], distribution: Distribution) -> String {
    let (title, spacing) = match distribution {
        Distribution::Polar => (
            "Suitability, polar distribution (Table 3.14.1)",
            "Angle between knots, &deg;",
        ),
        Distribution::Equidistant => (
            "Suitability, equidistant distribution (Table 3.14.2)",
            "Distance between knots, mm",
        ),
    };
    let mut out = format!(
        "<section><h2>{title}</h2><p>Mean absolute error over the eleven control points of Table 3.10.1 on the middle turn, mm. \
         Geometry is the programmed curve, commanded and machined the edge the cutter leaves. Ours is suitable where \
         geometry + {FLOOR_MM} mm stays below {LIMIT_MM} mm.</p>\n<table><thead><tr><th class=\"text\">Method</th><th>Knots</th>\
         <th>{spacing}</th><th>Thesis, measured</th><th>Geometry</th><th>Commanded</th><th>Machined</th>\
         <th>Thesis</th><th>Ours</th></tr></thead><tbody>\n",
    );
    for row in rows
        .iter()
        .filter(|row| row.set.distribution == distribution)
    {
        let (ours, printed) = (row.verdict(), row.printed.verdict);
        let class = if ours == printed {
            ""
        } else {
            " class=\"differs\""
        };
        let _ = writeln!(
            out,
            "<tr><td class=\"text\">{}</td><td>{}</td><td>{}</td><td>{:.3}</td><td>{:.4}</td><td>{:.4}</td>\
             <td>{:.4}</td><td>{}</td><td{class}>{}</td></tr>",
            row.method.title(),
            row.set.printed_count(),
            spacing_of(&row.set),
            row.printed.mae_mm,
            mae(&row.geometry),
            mae(&row.commanded),
            mae(&row.machined),
            printed.name(),
            ours.name(),
        );
    }
    out.push_str("</tbody></table></section>\n");
    out
}

/// Fourth column of Tables 3.14, as printed: degrees, or the length of the contour over the knots counted.
fn spacing_of(set: &KnotSet) -> String {
    match set.distribution {
        Distribution::Polar => set.parameter.to_string(),
        Distribution::Equidistant => {
            let mm = super::contour::PRINTED_LENGTH_MM / f64::from(set.printed_count());
            format!("{mm:.5}")
        }
    }
}

/// Colour of a method on the charts.
fn colour(method: Method) -> &'static str {
    match method {
        Method::A => "var(--axis-0)",
        Method::B => "var(--axis-3)",
        Method::C => "var(--axis-1)",
        Method::Linear => "var(--axis-2)",
    }
}

/// Six polar charts, one per knot set (figures of sections 3.12.3.1 and 3.12.4.1).
fn charts(rows: &[Row]) -> String {
    let mut out = String::from(
        "<section><h2>Error along the contour</h2><p>Lines: normal error of the programmed curve over &theta;, largest per degree, \
         enlarged about the ring of no error; outwards is too large. Dots: error of the machined edge at the control points, \
         measured as in the thesis and counted positive outwards; the numbers are those of its charts.</p>\n<p class=\"legend\">",
    );
    for method in METHODS {
        let _ = write!(
            out,
            "<span><i class=\"swatch\" style=\"background:{}\"></i>{}</span>",
            colour(method),
            method.title(),
        );
    }
    out.push_str("</p>\n<div class=\"charts\">\n");
    for set in FINISHING {
        let of_set: Vec<&Row> = rows.iter().filter(|row| row.set == set).collect();
        out.push_str(&chart(&set, &of_set));
    }
    out.push_str("</div></section>\n");
    out
}

fn chart(set: &KnotSet, rows: &[&Row]) -> String {
    let all = rows
        .iter()
        .flat_map(|row| row.by_degree.iter().chain(&row.machined));
    let peak = all
        .fold(0.0_f64, |peak, error| peak.max(error.abs()))
        .max(1e-6);
    let scale = SWING / peak;
    let place = |degrees: f64, error: f64| {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let r = RING + scale * error;
        (r * cos, -r * sin)
    };
    let mut out = String::from("<figure><svg viewBox=\"-140 -140 280 280\" role=\"img\">");
    for (class, r) in [
        ("ring", RING - SWING),
        ("zero", RING),
        ("ring", RING + SWING),
    ] {
        let _ = write!(out, "<circle class=\"{class}\" r=\"{r}\"/>");
    }
    for row in rows {
        let points: Vec<String> = (0..360)
            .map(|degree| {
                let (x, y) = place(f64::from(degree) + 0.5, row.by_degree[degree as usize]);
                format!("{x:.1},{y:.1}")
            })
            .collect();
        let _ = write!(
            out,
            "<polygon class=\"curve\" stroke=\"{}\" points=\"{}\"/>",
            colour(row.method),
            points.join(" "),
        );
        for (i, degrees) in CONTROL_DEGREES.iter().enumerate() {
            // All control points have x <= 0 <= y: outwards is up at the first, left at the others.
            let outwards = if i == 0 {
                row.machined[i]
            } else {
                -row.machined[i]
            };
            let (x, y) = place(*degrees, outwards);
            let fill = colour(row.method);
            let _ = write!(
                out,
                "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"1.8\" fill=\"{fill}\"/>"
            );
        }
    }
    for (i, degrees) in CONTROL_DEGREES.iter().enumerate() {
        let (sin, cos) = degrees.to_radians().sin_cos();
        let (x, y) = (133.0 * cos, 3.0 - 133.0 * sin);
        let _ = write!(out, "<text x=\"{x:.1}\" y=\"{y:.1}\">{}</text>", i + 1);
    }
    let _ = write!(
        out,
        "<text x=\"0\" y=\"3\">rings &plusmn;{peak:.3} mm</text>"
    );
    let _ = writeln!(
        out,
        "</svg><figcaption>{}, {} knots</figcaption></figure>",
        set.distribution.name(),
        set.printed_count(),
    );
    out
}

/// Table 3.13.1 with ours beside it.
fn times(rows: &[Row]) -> String {
    let mut out = String::from(
        "<section><h2>Machining time and smallest real feed (Table 3.13.1)</h2><p>Ours: time in motion from the first move \
         behind M0 and G4 to the end of the program, dwell not counted; smallest feed of the cutter&rsquo;s centre over the \
         middle turn. The thesis does not say when its watch was started. Three turns of 136.19 mm at 1530 mm/min are \
         16.0 s; approach and way home come on top.</p>\n<table><thead><tr><th class=\"text\">Method</th>\
         <th class=\"text\">Distribution</th><th>Knots</th><th>Time, thesis, s</th><th>Time, ours, s</th>\
         <th>Smallest feed, thesis, mm/min</th><th>Smallest feed, ours, mm/min</th></tr></thead><tbody>\n",
    );
    for row in rows {
        let _ = writeln!(
            out,
            "<tr><td class=\"text\">{}</td><td class=\"text\">{}</td><td>{}</td><td>{:.2}</td><td>{:.2}</td><td>{}</td><td>{:.0}</td></tr>",
            row.method.title(),
            row.set.distribution.name(),
            row.set.printed_count(),
            row.printed.time_s,
            row.time_s,
            feed_text(row.printed.feed),
            row.min_feed_mm_min,
        );
    }
    out.push_str("</tbody></table></section>\n");
    out
}

/// Sizes of the sub-programs.
fn sizes(rows: &[Row]) -> String {
    let mut out = String::from(
        "<section><h2>Size of the finishing sub-programs</h2><p>Bytes of our files; the thesis prints two sizes, in kB, \
         in section 3.14.</p>\n<table><thead><tr><th class=\"text\">Knots</th>",
    );
    for method in METHODS {
        let _ = write!(out, "<th>{}</th>", method.title());
    }
    out.push_str("</tr></thead><tbody>\n");
    for set in FINISHING {
        let knots = set.printed_count();
        let _ = write!(
            out,
            "<tr><td class=\"text\">{} {knots}</td>",
            set.distribution.name()
        );
        for row in rows.iter().filter(|row| row.set == set) {
            let printed = SIZES_KB
                .iter()
                .find(|(method, count, _)| (*method, *count) == (row.method, knots))
                .map_or(String::new(), |(_, _, kb)| {
                    format!(" <small>(thesis {kb} kB)</small>")
                });
            let _ = write!(out, "<td>{}{printed}</td>", row.file_bytes);
        }
        out.push_str("</tr>\n");
    }
    out.push_str("</tbody></table></section>\n");
    out
}

/// What agrees, what does not, and why.
fn findings(rows: &[Row]) -> String {
    let differing: Vec<String> = rows
        .iter()
        .filter(|row| row.verdict() != row.printed.verdict)
        .map(|row| {
            let (ours, printed) = (row.verdict().name(), row.printed.verdict.name());
            let (knots, title) = (row.set.printed_count(), row.method.title());
            let geometry = mae(&row.geometry);
            format!(
                "{} {knots} {title}: {ours} here, {printed} there (printed {:.3} mm, geometry {geometry:.4} mm)",
                row.set.distribution.name(),
                row.printed.mae_mm,
            )
        })
        .collect();
    let listed = match differing.as_slice() {
        [] => "none".to_owned(),
        some => some.join("; "),
    };
    let suitable = rows
        .iter()
        .filter(|row| row.verdict() == Verdict::Ok)
        .count();
    format!(
        "<section><h2>What agrees, what does not, and why</h2>\n\
         <p><b>Agrees.</b> {} of {} verdicts, {suitable} of them suitable; the order of the methods on coarse knots; the \
         growth of the error with the spacing. The printed errors are the geometric ones plus a floor of about {FLOOR_MM} mm, \
         which is the microscope, the clamping and the reader (section 3.12.5): where the geometry errs by less than a \
         micrometre, the printed errors are all the same. All programs run as printed, G42 with the printed leads.</p>\n\
         <p><b>Differs.</b> {listed}. The 24th row, polar 360 B-spline, is printed with 0.099 mm; knots one degree apart leave a \
         B-spline less than 0.01 mm from the contour, so that value has no geometric cause. On polar 72 the cutter, \
         outside, does not reach into the inner corners of the polygon, two of which are control points: the machined column \
         shows it, the geometry column cannot.</p>\n{}\
         <p><b>The contour.</b> Equations (30) and (31) print cos 6&theta; cos 4&theta;. The arc-length integral (33), the length \
         136.1895 mm, the control points and every listing belong to cos 2&theta; cos 6&theta;, which is used here.</p>\n\
         <p><b>Weights.</b> PW=3 at every point does not pull the B-spline to its points: equal weights cancel in a rational \
         spline, and the curve is that of weight 1.</p>\n\
         <p><b>Assumed.</b> Lead knots climb in proportion to their distance from the first point of the turn to \
         X13.856 Y-8.000 Z0.500, as the one printed lead knot does; the closing knot of a turn is the first of the next; \
         drives, corner step and the material the compensation may leave as in the machine file.</p></section>\n",
        agreeing(rows),
        rows.len(),
        longer(rows),
    )
}

/// Why the times and the smallest feeds are not the printed ones, with the numbers of this run.
fn longer(rows: &[Row]) -> String {
    let of = |method: Method| {
        let times = rows
            .iter()
            .filter(move |row| row.method == method)
            .map(|row| (row.time_s, row.printed.time_s));
        let (mut ours, mut printed) = ([f64::INFINITY, 0.0_f64], [f64::INFINITY, 0.0_f64]);
        for (time, print) in times {
            ours = [ours[0].min(time), ours[1].max(time)];
            printed = [printed[0].min(print), printed[1].max(print)];
        }
        format!(
            "{} {:.1} to {:.1} s, printed {:.1} to {:.1} s",
            method.title(),
            ours[0],
            ours[1],
            printed[0],
            printed[1],
        )
    };
    let stopped = rows.iter().filter(|row| row.min_feed_mm_min < 1.0).count();
    format!(
        "<p><b>Takes longer.</b> {}; {}; {}; {}. The planner keeps to the programmed path with a limited jerk, and nothing \
         is rounded: it comes to rest at every corner of a polygon (corner step 0 in the machine file) and where the \
         curvature jumps, which an A-spline does at every knot. Under G64 the 840D rounds such places off within tolerances of \
         its own. B- and C-splines have no such jumps, and their times are near the printed ones.</p>\n\
         <p><b>Stops.</b> In {stopped} of {} programs the smallest feed of the middle turn is 0. Eight times per turn the contour \
         is hollow with a radius of {:.2} mm, {:.2} mm more than the cutter: the centre runs around it on that little rest, \
         where every wave of the curvature is enlarged about fifty times, or the cutter does not reach at all and its \
         path has a corner. The printed feeds were read off a display.</p>\n",
        of(Method::A),
        of(Method::Linear),
        of(Method::B),
        of(Method::C),
        rows.len(),
        HOLLOW_MM,
        HOLLOW_MM - TOOL_RADIUS_MM,
    )
}
