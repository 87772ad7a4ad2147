//! Runs that `simulate` shows, as JSON. They may have millions of points: their text is written
//! without values of JSON in between.

use serde_json::json;

use super::json::written_pairs;
use crate::stochastic::Trajectory;

/// An object with the number of the `run` and its `points`: of each item, by its text, pairs of a
/// moment in units of the model and a value, which is null if it is infinite.
pub fn write(items: &[String], run: &Trajectory) -> String {
    let mut points = Vec::new();
    for (index, (item, line)) in items.iter().zip(&run.points).enumerate() {
        if !items[..index].contains(item) {
            points.push(format!("{}: {}", json!(item), written_pairs(line)));
        }
    }
    format!(
        "{{\"run\": {}, \"points\": {{{}}}}}",
        run.run,
        points.join(", ")
    )
}
