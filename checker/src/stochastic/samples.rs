//! How values of runs are distributed, in memory that does not grow with the number of runs.
//!
//! Up to [`MOST_VALUES`] different values are kept as they are, each with how often it came: so a
//! number that takes few values, such as the length of a queue, is exact after any number of runs.
//! From then on values are counted in at most [`MOST_BINS`] bins. Bins are as wide as a power of
//! two and begin at a multiple of it; when a value lies outside, their width doubles, and two
//! neighbours become one. So the result depends on the values and their order alone, and bins are
//! never wider than the span of all values divided by a quarter of [`MOST_BINS`].
//!
//! Mean, least and greatest value are those of all values. Values that are no finite numbers only
//! count among the runs.

use std::collections::VecDeque;

/// The most different values that are kept as they are.
pub const MOST_VALUES: usize = 100_000;

/// The most bins.
pub const MOST_BINS: usize = 1 << 16;

/// The most values that wait until they are sorted in among the others.
const MOST_RECENT: usize = 1 << 16;

/// Values, as they come.
#[derive(Clone, Debug, Default)]
pub struct Samples {
    /// Different values in ascending order, each with how often it came.
    exact: Vec<(f64, u64)>,
    /// Values that are not in there yet.
    recent: Vec<f64>,
    /// What all values are counted in, when there are too many different ones.
    bins: Option<Bins>,
    count: u64,
    mean: f64,
    least: f64,
    greatest: f64,
}

/// How values are distributed.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Distribution {
    /// Values in ascending order, each with how often it came. With a resolution, they stand for
    /// all values within half of it.
    pub points: Vec<(f64, u64)>,
    /// How wide bins are; 0 if all values are exact.
    pub resolution: f64,
    /// How many values there are.
    pub count: u64,
    /// The mean of all values; 0 without values.
    pub mean: f64,
    /// The least value; 0 without values.
    pub least: f64,
    /// The greatest value; 0 without values.
    pub greatest: f64,
}

/// How many values lie in buckets of the same width, which exclude their ends but for the last one.
#[derive(Clone, Debug, PartialEq)]
pub struct Histogram {
    /// Where the first bucket begins.
    pub start: f64,
    /// How wide a bucket is.
    pub width: f64,
    /// How many values lie in each.
    pub counts: Vec<u64>,
}

impl Samples {
    /// Adds a value.
    pub fn push(&mut self, value: f64) {
        if !value.is_finite() {
            return;
        }
        // Both zeros are one value.
        let value = value + 0.0;
        self.count += 1;
        self.mean += (value - self.mean) / self.count as f64;
        if self.count == 1 {
            (self.least, self.greatest) = (value, value);
        }
        self.least = self.least.min(value);
        self.greatest = self.greatest.max(value);
        if let Some(bins) = &mut self.bins {
            bins.add(value, 1);
            return;
        }
        self.recent.push(value);
        if self.recent.len() >= MOST_RECENT {
            self.sort_in();
        }
    }

    /// Sorts recent values in among the others, and goes over to bins if there are too many.
    fn sort_in(&mut self) {
        let mut recent = std::mem::take(&mut self.recent);
        recent.sort_unstable_by(f64::total_cmp);
        let mut before = std::mem::take(&mut self.exact).into_iter().peekable();
        let mut merged: Vec<(f64, u64)> = Vec::with_capacity(before.len());
        let mut add = |value: f64, count: u64| match merged.last_mut() {
            Some(last) if last.0 >= value => last.1 += count,
            _ => merged.push((value, count)),
        };
        for value in recent.drain(..) {
            while let Some((least, count)) = before.next_if(|one| one.0 <= value) {
                add(least, count);
            }
            add(value, 1);
        }
        before.for_each(|(value, count)| add(value, count));
        self.recent = recent;
        self.exact = merged;
        if self.exact.len() > MOST_VALUES {
            let mut bins = Bins::over(self.least, self.greatest);
            for (value, count) in std::mem::take(&mut self.exact) {
                bins.add(value, count);
            }
            self.bins = Some(bins);
        }
    }

    /// How all values are distributed.
    pub fn distribution(mut self) -> Distribution {
        self.sort_in();
        let (points, resolution) = match self.bins {
            None => (self.exact, 0.0),
            Some(bins) => (bins.points(self.least, self.greatest), bins.width),
        };
        Distribution {
            points,
            resolution,
            count: self.count,
            mean: self.mean,
            least: self.least,
            greatest: self.greatest,
        }
    }
}

impl Distribution {
    /// The histogram whose number of buckets is the square root of the number of values, rounded
    /// up, as in UPPAAL; buckets for whole numbers are whole numbers wide. `None` without values.
    pub fn histogram(&self) -> Option<Histogram> {
        if self.count == 0 {
            return None;
        }
        let buckets = (self.count as f64).sqrt().ceil();
        let span = self.greatest - self.least;
        let is_whole =
            self.resolution == 0.0 && self.points.iter().all(|(value, _)| value.fract() == 0.0);
        let (width, buckets) = if is_whole {
            let width = ((span + 1.0) / buckets).ceil();
            (width, ((span + 1.0) / width).ceil())
        } else if span > 0.0 {
            (span / buckets, buckets)
        } else {
            (1.0, 1.0)
        };
        let mut counts = vec![0; buckets as usize];
        let last = counts.len() - 1;
        for &(value, count) in &self.points {
            let bucket = ((value - self.least) / width).floor() as usize;
            counts[bucket.min(last)] += count;
        }
        Some(Histogram {
            start: self.least,
            width,
            counts,
        })
    }
}

/// Counts of values in bins.
#[derive(Clone, Debug)]
struct Bins {
    /// How wide a bin is: a power of two.
    width: f64,
    /// The number of the first bin: where it begins, divided by the width.
    first: i64,
    /// At most [`MOST_BINS`].
    counts: VecDeque<u64>,
}

impl Bins {
    /// Bins of which at most half cover this span, whose ends differ.
    fn over(least: f64, greatest: f64) -> Bins {
        let wanted = (greatest / 2.0 - least / 2.0) / (MOST_BINS as f64 / 4.0);
        let mut bins = Bins {
            width: wanted.max(f64::MIN_POSITIVE).log2().ceil().exp2(),
            first: 0,
            counts: VecDeque::new(),
        };
        bins.first = bins.number(least);
        bins
    }

    /// The number of the bin of a value.
    fn number(&self, value: f64) -> i64 {
        (value / self.width).floor() as i64
    }

    fn add(&mut self, value: f64, count: u64) {
        let mut number = self.number(value);
        while self.span_with(number) > MOST_BINS as i64 {
            self.double();
            number = self.number(value);
        }
        while number < self.first {
            self.counts.push_front(0);
            self.first -= 1;
        }
        let index = (number - self.first) as usize;
        if index >= self.counts.len() {
            self.counts.resize(index + 1, 0);
        }
        self.counts[index] += count;
    }

    /// How many bins there would be with this one.
    fn span_with(&self, number: i64) -> i64 {
        let end = self.first + self.counts.len() as i64;
        let end = end.max(number.saturating_add(1));
        end.saturating_sub(self.first.min(number))
    }

    /// Makes bins twice as wide.
    fn double(&mut self) {
        let first = self.first.div_euclid(2);
        let mut counts = VecDeque::with_capacity(self.counts.len() / 2 + 1);
        for (number, count) in (self.first..).zip(&self.counts) {
            let index = (number.div_euclid(2) - first) as usize;
            if index >= counts.len() {
                counts.push_back(0);
            }
            counts[index] += count;
        }
        (self.width, self.first, self.counts) = (2.0 * self.width, first, counts);
    }

    /// The middles of the bins that have values, within the values that there are.
    fn points(&self, least: f64, greatest: f64) -> Vec<(f64, u64)> {
        let numbered = (self.first..).zip(&self.counts);
        let counted = numbered.filter(|(_, count)| **count > 0);
        let middle = |number: i64| (number as f64 + 0.5) * self.width;
        counted
            .map(|(number, count)| (middle(number).clamp(least, greatest), *count))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    #![expect(clippy::float_cmp, reason = "these are exact")]

    use super::{Distribution, MOST_BINS, MOST_VALUES, Samples};

    fn distribution(values: impl IntoIterator<Item = f64>) -> Distribution {
        let mut samples = Samples::default();
        values.into_iter().for_each(|value| samples.push(value));
        samples.distribution()
    }

    /// Numbers that come in no order, all different.
    fn scattered(count: u64) -> impl Iterator<Item = f64> {
        (0..count).map(move |i| (i * 7919 % count) as f64 / 1024.0 + 3.0)
    }

    #[test]
    fn few_values_are_exact_after_many_runs() {
        let found = distribution((0..1_000_000).map(|i| f64::from(i % 7)));
        assert_eq!(found.resolution, 0.0);
        assert_eq!(found.points.len(), 7);
        assert_eq!(found.points[0], (0.0, 142_858));
        assert_eq!(found.points[6], (6.0, 142_857));
        assert_eq!(
            (found.count, found.least, found.greatest),
            (1_000_000, 0.0, 6.0)
        );
        assert!((found.mean - 2.999_997).abs() < 1e-6, "{}", found.mean);
    }

    #[test]
    fn many_values_are_counted_in_bins_with_all_of_them() {
        let count = 3 * MOST_VALUES as u64 + 1;
        let found = distribution(scattered(count));
        let span = found.greatest - found.least;
        assert!(found.resolution > 0.0 && found.resolution <= 4.0 * span / MOST_BINS as f64);
        assert_eq!(found.points.iter().map(|one| one.1).sum::<u64>(), count);
        assert_eq!(
            (found.least, found.greatest),
            (3.0, 3.0 + (count - 1) as f64 / 1024.0)
        );
        // Each cumulative count is that of the exact values, up to one bin.
        let mut below = 0;
        for &(value, number) in &found.points {
            below += number;
            let exact = (value - 3.0) * 1024.0;
            let off = (below as f64 - exact).abs();
            assert!(off <= 1024.0 * found.resolution + 1.0, "{value}: {below}");
        }
    }

    #[test]
    fn bins_grow_to_values_of_any_size_on_both_sides() {
        let far = [1e300, -1e300, 5e-324, f64::MAX, f64::MIN];
        let found = distribution(scattered(200_000).chain(far));
        assert_eq!(found.count, 200_005);
        assert_eq!(found.points.iter().map(|one| one.1).sum::<u64>(), 200_005);
        assert_eq!((found.least, found.greatest), (f64::MIN, f64::MAX));
        assert!(found.points.is_sorted_by(|one, two| one.0 < two.0));
    }

    #[test]
    fn what_is_no_number_is_left_out() {
        let found = distribution([f64::NAN, 1.0, f64::INFINITY, 2.0]);
        assert_eq!(found.points, [(1.0, 1), (2.0, 1)]);
        assert_eq!((found.count, found.mean), (2, 1.5));
        assert_eq!(distribution([]).histogram(), None);
    }

    #[test]
    fn a_histogram_has_the_square_root_of_the_number_of_values_as_buckets() {
        // A published histogram of 229,732 values has 480 buckets.
        let found = distribution((0..229_732).map(|i| f64::from(i) / 256.0));
        let histogram = found.histogram().expect("there are values");
        assert_eq!(histogram.counts.len(), 480);
        assert_eq!(histogram.counts.iter().sum::<u64>(), 229_732);
        let spread =
            histogram.counts.iter().max().unwrap() - histogram.counts.iter().min().unwrap();
        assert!(spread <= 8, "the values are uniform: {spread}");
    }

    #[test]
    fn buckets_of_whole_numbers_are_whole() {
        let histogram = distribution([2.0, 3.0, 3.0, 5.0])
            .histogram()
            .expect("values");
        assert_eq!((histogram.start, histogram.width), (2.0, 2.0));
        assert_eq!(histogram.counts, [3, 1]);
        let same = distribution([4.0; 9]).histogram().expect("values");
        assert_eq!((same.start, same.width, same.counts), (4.0, 1.0, vec![9]));
        let one = distribution([0.5; 9]).histogram().expect("values");
        assert_eq!((one.start, one.width, one.counts), (0.5, 1.0, vec![9]));
    }
}
