//! How the values of runs are distributed, as JSON.

use serde_json::{Value as Json, json};

use super::json::real;
use crate::stochastic::{Measured, ValuesOfRuns};

/// The most values at which the cumulative distribution is written.
const MOST_POINTS: usize = 200;

/// What the values are (`of`), whether they are of runs that break what is asked (`broken`), how
/// many `runs` and values (`count`) there are, with `mean`, `min` and `max`, which are null without
/// values. `resolution` is 0 if all values are exact, else how wide the bins are that values were
/// counted in.
///
/// `histogram` has the width and the counts of buckets, and is null without values. `cumulative`
/// has at some values the share of the runs that have at most this value, and between which shares
/// the true one lies, everywhere at once; `band` is half the distance between these.
pub fn write(values: &ValuesOfRuns) -> Json {
    let (distribution, band) = (&values.distribution, values.band());
    let known = |value: f64| {
        if distribution.count == 0 {
            Json::Null
        } else {
            real(value)
        }
    };
    let of = match values.measured {
        Measured::Time => "time",
        Measured::Clock => "clock",
        Measured::Moves => "moves",
        Measured::Value => "value",
    };
    let histogram = distribution.histogram().map(|histogram| {
        json!({
            "start": real(histogram.start),
            "width": real(histogram.width),
            "counts": histogram.counts,
        })
    });
    json!({
        "of": of,
        "broken": values.of_broken,
        "runs": values.runs,
        "count": distribution.count,
        "mean": known(distribution.mean),
        "min": known(distribution.least),
        "max": known(distribution.greatest),
        "resolution": real(distribution.resolution),
        "histogram": histogram,
        "band": real(band),
        "cumulative": cumulative(values, band),
    })
}

fn cumulative(values: &ValuesOfRuns, band: f64) -> Json {
    let (mut at, mut shares, mut lowers, mut uppers) = (vec![], vec![], vec![], vec![]);
    let points = &values.distribution.points;
    let step = points.len().div_ceil(MOST_POINTS).max(1);
    let mut below = 0;
    for (index, (value, count)) in points.iter().enumerate() {
        below += count;
        if (index + 1) % step == 0 || index + 1 == points.len() {
            let share = below as f64 / values.runs as f64;
            at.push(real(*value));
            shares.push(share);
            lowers.push((share - band).max(0.0));
            uppers.push((share + band).min(1.0));
        }
    }
    json!({ "at": at, "value": shares, "lower": lowers, "upper": uppers })
}
