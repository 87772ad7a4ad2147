//! Sets of times: disjoint closed intervals, single moments among them.

/// Disjoint intervals in ascending order.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Windows {
    intervals: Vec<(f64, f64)>,
}

impl Windows {
    pub(super) fn clear(&mut self) {
        self.intervals.clear();
    }

    /// The earliest time.
    pub(super) fn first(&self) -> Option<f64> {
        self.intervals.first().map(|&(low, _)| low)
    }

    /// Adds an interval.
    pub(super) fn add(&mut self, mut low: f64, mut high: f64) {
        match self.intervals.last_mut() {
            Some(last) if last.0 <= low => {
                // Most intervals come in order.
                if low <= last.1 {
                    last.1 = last.1.max(high);
                } else {
                    self.intervals.push((low, high));
                }
                return;
            }
            None => {
                self.intervals.push((low, high));
                return;
            }
            Some(_) => {}
        }
        let start = self.intervals.partition_point(|one| one.1 < low);
        let end = self.intervals.partition_point(|one| one.0 <= high);
        for one in &self.intervals[start..end] {
            low = low.min(one.0);
            high = high.max(one.1);
        }
        self.intervals.splice(start..end, [(low, high)]);
    }

    /// How long all of them are together.
    pub(super) fn length(&self) -> f64 {
        self.intervals.iter().map(|(low, high)| high - low).sum()
    }

    /// How many intervals there are.
    pub(super) fn count(&self) -> usize {
        self.intervals.len()
    }

    /// The start of the interval with this number.
    pub(super) fn start_of(&self, interval: usize) -> f64 {
        self.intervals[interval].0
    }

    /// The time at which this much of the set has passed; infinity if it is shorter.
    pub(super) fn after(&self, mut passed: f64) -> f64 {
        for &(low, high) in &self.intervals {
            if passed <= high - low {
                return low + passed;
            }
            passed -= high - low;
        }
        f64::INFINITY
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::float_cmp, reason = "these are exact")]

    use super::Windows;

    fn windows(intervals: &[(f64, f64)]) -> Windows {
        let mut windows = Windows::default();
        for &(low, high) in intervals {
            windows.add(low, high);
        }
        windows
    }

    #[test]
    fn intervals_that_touch_are_one() {
        let joined = windows(&[(4.0, 5.0), (0.0, 1.0), (3.0, 3.0), (0.5, 2.0), (2.0, 2.5)]);
        assert_eq!(joined.intervals, [(0.0, 2.5), (3.0, 3.0), (4.0, 5.0)]);
        assert_eq!(windows(&[(2.0, 3.0), (1.0, 4.0)]).intervals, [(1.0, 4.0)]);
    }

    #[test]
    fn time_inside_skips_the_gaps() {
        let windows = windows(&[(1.0, 2.0), (5.0, 7.0)]);
        assert_eq!(windows.length(), 3.0);
        assert_eq!(windows.after(0.5), 1.5);
        assert_eq!(windows.after(2.0), 6.0);
        assert_eq!(windows.after(3.5), f64::INFINITY);
    }
}
