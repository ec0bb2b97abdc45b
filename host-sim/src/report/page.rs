//! Assembles the page: template, style, script, plotting library and the data as JSON.
//!
//! In: [`ReportData`]. Out: the text of one HTML file that loads nothing from elsewhere. The plotting library
//! (plotly.js, MIT) comes out of the `plotly` crate, which carries it as a string.

use pentaspline::units::AXES;
use serde_json::{json, Value};

use super::envelope::Envelope;
use super::polyline::Polyline;
use super::{BlockTable, ReportData};

const TEMPLATE: &str = include_str!("template.html");
const STYLE: &str = include_str!("report.css");
const SCRIPT: &str = include_str!("report.js");

/// The whole page.
pub fn html(data: &ReportData) -> String {
    // No text of the data can end the element it stands in.
    let payload = payload(data).to_string().replace('<', "\\u003c");
    let library = plotting_library();
    let mut page = String::with_capacity(library.len() + payload.len() + 65_536);
    let mut rest = TEMPLATE;
    while let Some((before, after)) = rest.split_once("<!--@") {
        let (name, after) = after.split_once("-->").unwrap_or((after, ""));
        page.push_str(before);
        page.push_str(match name {
            "style" => STYLE,
            "script" => SCRIPT,
            "library" => &library,
            "data" => &payload,
            _ => "",
        });
        rest = after;
    }
    page.push_str(rest);
    page
}

/// The source of plotly.js: the first of the two scripts the crate offers (the second typesets formulas).
fn plotting_library() -> String {
    let sources = plotly::Plot::offline_js_sources();
    let first = sources.split("</script>").next().unwrap_or_default();
    first
        .split_once('>')
        .map_or("", |(_, text)| text)
        .to_owned()
}

fn payload(data: &ReportData) -> Value {
    let per_axis = |curves: &[Envelope; AXES]| -> Value {
        // A curve that never leaves zero is not drawn.
        let curve = |c: &Envelope| (c.peak() > 0.0).then(|| rounded(&c.points()));
        curves.iter().map(curve).collect()
    };
    let mut contour = data.contour.clone();
    contour.widen(data.time.width());
    json!({
        "program": data.program,
        "machine": data.machine,
        "digest": data.digest,
        "warnings": data.warnings,
        "facts": data.facts,
        "duration": data.ticks as f64 / data.servo_hz,
        "ticks": data.ticks,
        "servoHz": data.servo_hz,
        "length": data.length_mm,
        "ticksPerBucket": data.time.width(),
        "axes": (0..AXES).map(|a| axis(data, a)).collect::<Value>(),
        "space": data.space().map(|a| a.map(|a| data.axes[a].name.clone())),
        "t": times(&data.time),
        "feed": rounded(&data.feed.points()),
        "peakFeed": data.feed.peak(),
        "velocity": per_axis(&data.velocity),
        "acceleration": per_axis(&data.acceleration),
        "jerk": per_axis(&data.jerk),
        "following": per_axis(&data.following),
        "contour": rounded(&contour.points()),
        "peakContour": data.contour.peak(),
        "commanded": path(&data.commanded_path),
        "actual": path(&data.actual_path),
        "blocks": blocks(&data.blocks, &data.lines),
        "blockCount": data.blocks.count(),
    })
}

fn axis(data: &ReportData, a: usize) -> Value {
    let info = &data.axes[a];
    json!({
        "name": info.name,
        "linear": info.linear,
        "limits": [info.v_limit, info.a_limit, info.j_limit],
        "peaks": [data.velocity[a].peak(), data.acceleration[a].peak(), data.jerk[a].peak()],
        "following": data.following[a].peak(),
        "moves": data.velocity[a].peak() > 0.0,
    })
}

/// Abscissae of [`Envelope::points`]: a quarter and three quarters into each bucket.
fn times(time: &Envelope) -> Value {
    let micro = |t: f64| (t * 1e6).round() / 1e6;
    let mut t = Vec::new();
    for bucket in time.buckets() {
        if time.width() == 1 {
            t.push(micro(bucket.min));
        } else {
            let span = bucket.max - bucket.min;
            t.push(micro(bucket.min + 0.25 * span));
            t.push(micro(bucket.min + 0.75 * span));
        }
    }
    json!(t)
}

fn path(path: &Polyline) -> Value {
    // 0.1 um is finer than any step.
    let fine = |v: f64| (v * 1e4).round() / 1e4 + 0.0;
    let column = |k: usize| path.points().map(|p| fine(p.at[k])).collect::<Vec<_>>();
    json!({
        "x": column(0),
        "y": column(1),
        "z": column(2),
        "feed": rounded(&path.points().map(|p| p.feed).collect::<Vec<_>>()),
        "line": path.points().map(|p| p.line).collect::<Vec<_>>(),
    })
}

fn blocks(table: &BlockTable, lines: &[String]) -> Value {
    let row = |row: &super::blocks::BlockRow| {
        let index = (row.line as usize).wrapping_sub(1);
        let text = lines.get(index).map_or("", |text| text.trim());
        json!([
            row.line,
            text,
            significant(row.start_s, 7),
            significant(row.duration_s, 5),
            significant(row.length_mm, 6),
            significant(row.length_deg, 6),
            significant(row.min_feed, 5),
            significant(row.max_feed, 5),
        ])
    };
    table.rows().iter().map(row).collect()
}

fn rounded(values: &[f64]) -> Value {
    values.iter().map(|&v| significant(v, 5)).collect()
}

/// `value` with `digits` significant digits; JSON prints the shortest text that gives it back. What JSON cannot
/// print becomes 0.
fn significant(value: f64, digits: usize) -> f64 {
    let text = format!("{value:.*e}", digits.saturating_sub(1));
    let short: f64 = text.parse().unwrap_or(0.0);
    if short.is_finite() {
        short + 0.0
    } else {
        0.0
    }
}
