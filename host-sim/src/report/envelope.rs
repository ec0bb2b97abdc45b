//! A curve of any length in bounded memory: minimum and maximum per bucket of ticks.
//!
//! In: one value per tick. Out: at most [`MAX_BUCKETS`] buckets of 2^k ticks each. When they are used up,
//! neighbours merge; so every extreme value stays, however short it was.

/// Buckets of one curve; two points are drawn for each.
pub const MAX_BUCKETS: usize = 2000;

/// Extremes over one stretch of ticks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bucket {
    /// Smallest value.
    pub min: f64,
    /// Largest value.
    pub max: f64,
    /// The maximum came before the minimum.
    pub falling: bool,
}

impl Bucket {
    fn merged(self, later: Self) -> Self {
        let (min_late, max_late) = (later.min < self.min, later.max > self.max);
        Self {
            min: self.min.min(later.min),
            max: self.max.max(later.max),
            falling: match (min_late, max_late) {
                (false, false) => self.falling,
                (true, true) => later.falling,
                (min_late, _) => min_late,
            },
        }
    }
}

/// Envelope of one curve.
#[derive(Clone, Debug)]
pub struct Envelope {
    buckets: Vec<Bucket>,
    /// Ticks per bucket, a power of two.
    width: u64,
    /// Ticks in the last bucket; 0 or `width` if it is complete.
    filled: u64,
    peak: f64,
}

impl Envelope {
    /// Empty curve.
    pub fn new() -> Self {
        Self {
            buckets: Vec::new(),
            width: 1,
            filled: 0,
            peak: 0.0,
        }
    }

    /// Takes the next value in. A value that is not a number counts as 0.
    pub fn push(&mut self, value: f64) {
        let value = if value.is_finite() { value } else { 0.0 };
        self.peak = self.peak.max(value.abs());
        let new = Bucket {
            min: value,
            max: value,
            falling: false,
        };
        match self.buckets.last_mut() {
            Some(last) if self.filled < self.width => {
                *last = last.merged(new);
                self.filled += 1;
            }
            _ => {
                if self.buckets.len() == MAX_BUCKETS {
                    self.halve();
                }
                self.buckets.push(new);
                self.filled = 1;
            }
        }
    }

    /// Merges neighbours until a bucket holds at least `width` ticks.
    pub fn widen(&mut self, width: u64) {
        while self.width < width {
            self.halve();
        }
    }

    fn halve(&mut self) {
        let pairs = self.buckets.chunks(2);
        let even = self.buckets.len().is_multiple_of(2);
        self.filled += if even { self.width } else { 0 };
        self.buckets = pairs
            .map(|pair| match *pair {
                [first, second] => first.merged(second),
                _ => pair[0],
            })
            .collect();
        self.width *= 2;
    }

    /// Buckets in order.
    pub fn buckets(&self) -> &[Bucket] {
        &self.buckets
    }

    /// Ticks per bucket.
    pub fn width(&self) -> u64 {
        self.width
    }

    /// Largest magnitude of all values.
    pub fn peak(&self) -> f64 {
        self.peak
    }

    /// Values to draw: one per bucket of a single tick, else its two extremes in the order they came.
    pub fn points(&self) -> Vec<f64> {
        if self.width == 1 {
            return self.buckets.iter().map(|b| b.min).collect();
        }
        let pair = |b: &Bucket| {
            if b.falling {
                [b.max, b.min]
            } else {
                [b.min, b.max]
            }
        };
        self.buckets.iter().flat_map(pair).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_peak_is_lost_and_every_bucket_holds_its_own_ticks() {
        let value = |i: usize| {
            let spike = if i % 7919 == 5 { 100.0 } else { 0.0 };
            (i as f64 * 0.37).sin() + spike * if i.is_multiple_of(2) { 1.0 } else { -1.0 }
        };
        for count in [0, 1, 1999, 2000, 2001, 4001, 77_777] {
            let mut envelope = Envelope::new();
            (0..count).for_each(|i| envelope.push(value(i)));
            let width = envelope.width() as usize;
            assert!(envelope.buckets().len() <= MAX_BUCKETS);
            assert_eq!(envelope.buckets().len(), count.div_ceil(width));
            for (b, bucket) in envelope.buckets().iter().enumerate() {
                let ticks = b * width..((b + 1) * width).min(count);
                let argmin = ticks.clone().min_by(|&i, &j| value(i).total_cmp(&value(j)));
                let argmax = ticks.rev().max_by(|&i, &j| value(i).total_cmp(&value(j)));
                let (argmin, argmax) = (argmin.unwrap(), argmax.unwrap());
                assert_eq!((bucket.min, bucket.max), (value(argmin), value(argmax)));
                assert_eq!(bucket.falling, argmax < argmin, "bucket {b} of {count}");
            }
        }
    }

    #[test]
    fn a_curve_that_lags_can_be_brought_to_the_same_buckets() {
        let (mut long, mut short) = (Envelope::new(), Envelope::new());
        (0..2001).for_each(|i| long.push(f64::from(i)));
        (0..1990).for_each(|i| short.push(f64::from(i)));
        short.widen(long.width());
        assert_eq!(short.buckets()[..995], long.buckets()[..995]);
        (1990..2001).for_each(|i| short.push(f64::from(i)));
        assert_eq!(short.buckets(), long.buckets());
    }
}
