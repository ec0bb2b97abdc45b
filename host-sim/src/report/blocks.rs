//! The block table: what each block of the program took.
//!
//! In: the ticks of the run. Out: one row per stretch of ticks with the same text line, at most [`MAX_ROWS`].

use super::TickRecord;

/// Rows kept; further blocks are only counted.
pub const MAX_ROWS: usize = 5000;

/// One block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BlockRow {
    /// Text line, counted from 1.
    pub line: u32,
    /// Start, s.
    pub start_s: f64,
    /// Duration, s.
    pub duration_s: f64,
    /// Way of the linear axes, mm.
    pub length_mm: f64,
    /// Way of the rotary axes, degrees.
    pub length_deg: f64,
    /// Smallest feed, mm/s.
    pub min_feed: f64,
    /// Largest feed, mm/s.
    pub max_feed: f64,
}

/// Rows in the order of execution.
#[derive(Clone, Debug, Default)]
pub struct BlockTable {
    rows: Vec<BlockRow>,
    count: usize,
    current: u32,
}

impl BlockTable {
    /// Takes the next tick in; `period_s` is its length, `linear_mm` and `rotary_deg` the way since the tick before.
    pub fn push(&mut self, record: &TickRecord, period_s: f64, linear_mm: f64, rotary_deg: f64) {
        let starts = record.block != self.current;
        self.current = record.block;
        if record.block == 0 {
            return;
        }
        if starts {
            self.count += 1;
            if self.count <= MAX_ROWS {
                self.rows.push(BlockRow {
                    line: record.block,
                    start_s: record.t_s,
                    duration_s: 0.0,
                    length_mm: 0.0,
                    length_deg: 0.0,
                    min_feed: f64::INFINITY,
                    max_feed: 0.0,
                });
            }
        }
        if self.count > MAX_ROWS {
            return;
        }
        if let Some(row) = self.rows.last_mut() {
            row.duration_s += period_s;
            row.length_mm += linear_mm;
            row.length_deg += rotary_deg;
            row.min_feed = row.min_feed.min(record.feed_mm_s);
            row.max_feed = row.max_feed.max(record.feed_mm_s);
        }
    }

    /// Rows kept.
    pub fn rows(&self) -> &[BlockRow] {
        &self.rows
    }

    /// Blocks seen, kept or not.
    pub fn count(&self) -> usize {
        self.count
    }
}
