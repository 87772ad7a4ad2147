//! Shields as files: written, and read for a model.
//!
//! The format is described in `docs/strategy.md`. In short: `axes` are what the cells are made of,
//! `actions` the moves of the controller, `sets` the different sets of moves, and `cells` has, in
//! the order of the cells, the number of a set and in how many cells it is the allowed one. A file
//! is read as a whole or not at all.

use serde_json::{Value as Json, json};

use super::json_reader::{At, Mismatch, SEE_FORMAT, WRITE_ONE};
use super::learned_actions::{self, Finder};
use crate::cancellation;
use crate::ir::{Axis, Feature, Network, Part, ProcessId, Seen};
use crate::shield::{Grid, Shield};

/// The `format` of such a file.
pub const FORMAT: &str = "ntagen-shield";

const VERSION: u64 = 1;

/// What it takes to write or read a run of cells: see [`cancellation::work`].
const UNITS_FOR_RUN: usize = 32;

/// The most cells of a shield.
const MOST_CELLS: u64 = u32::MAX as u64;

const OTHER_MODEL: &str =
    "the shield was made for another model, or the model has changed: make it again";

/// A shield as the text of JSON; the same shield gives the same text.
pub fn text(network: &Network, shield: &Shield, query: &str) -> String {
    let axes: Vec<Json> = shield
        .grid
        .axes
        .iter()
        .map(|one| axis(network, one))
        .collect();
    let mut actions = learned_actions::texts(network, &shield.moves);
    actions.pop();
    let mut sets: Vec<u64> = shield.allowed.clone();
    sets.sort_unstable();
    sets.dedup();
    let mut cells: Vec<usize> = Vec::new();
    for run in shield.allowed.chunk_by(|one, other| one == other) {
        cancellation::work(UNITS_FOR_RUN);
        cells.push(sets.partition_point(|&set| set < run[0]));
        cells.push(run.len());
    }
    let moves = 0..shield.moves.len() as u32;
    let places = |set: &u64| -> Vec<u32> {
        moves
            .clone()
            .filter(|place| set >> place & 1 == 1)
            .collect()
    };
    json!({
        "format": FORMAT,
        "version": VERSION,
        "query": query,
        "axes": axes,
        "actions": actions,
        "sets": sets.iter().map(places).collect::<Vec<Vec<u32>>>(),
        "cells": cells,
    })
    .to_string()
}

fn axis(network: &Network, axis: &Axis) -> Json {
    let name = &axis.feature.text;
    match axis.feature.seen {
        Seen::Location(process) => json!({"name": name, "locations": locations(network, process)}),
        Seen::Integer(_) => json!({"name": name, "low": axis.low as i64, "high": axis.high as i64}),
        _ => json!({"name": name, "low": axis.low, "high": axis.high, "cells": axis.cells}),
    }
}

/// The names of the locations of a process.
pub(super) fn locations(network: &Network, ProcessId(process): ProcessId) -> Vec<&str> {
    let locations = network.processes[process as usize].locations.iter();
    locations.map(|one| one.name.as_str()).collect()
}

/// Whether this is, or wants to be, a shield.
pub fn is_one(file: &Json) -> bool {
    file["format"] == FORMAT
}

/// The names of the axes of a file.
///
/// # Errors
/// The file is not of the format.
pub fn names(file: &Json) -> Result<Vec<String>, Mismatch> {
    let whole = At::whole(file);
    whole.only(&[
        "format", "version", "query", "axes", "actions", "sets", "cells",
    ])?;
    let version = whole.field("version")?;
    if version.0.as_u64() != Some(VERSION) {
        let message = format!("version {} of the format is not known", version.0);
        return Err(version.wrong(message, "this ntagen reads version 1"));
    }
    let axes = whole.list("axes")?;
    axes.iter().map(|one| one.text("name")).collect()
}

/// What the model has that a file names.
pub struct Names<'n> {
    /// The network, in the stochastic reading.
    pub network: &'n Network,
    /// What the names of the axes are.
    pub features: &'n [Feature],
    /// The moves of the controller.
    pub moves: &'n [Part],
}

/// Reads a shield.
///
/// # Errors
/// It is not of the format, or names what the model does not have.
pub fn read(file: &Json, names: &Names<'_>) -> Result<Shield, Mismatch> {
    let whole = At::whole(file);
    let axes = whole.list("axes")?;
    let axes = axes.iter().zip(names.features);
    let axes = axes.map(|(at, feature)| read_axis(at, feature, names.network));
    let grid = Grid {
        axes: axes.collect::<Result<Vec<Axis>, Mismatch>>()?,
    };
    let cells = grid.cells();
    if grid.axes.is_empty() || cells > MOST_CELLS {
        let message = format!("these axes make {cells} cells");
        return Err(whole.field("axes")?.wrong(message, WRITE_ONE));
    }
    let places = actions_of(&whole, names)?;
    let sets = whole.list("sets")?;
    let sets = sets.iter().map(|set| read_set(set, &places));
    let sets = sets.collect::<Result<Vec<u64>, Mismatch>>()?;
    Ok(Shield {
        allowed: read_cells(&whole, &sets, cells)?,
        moves: names.moves.to_vec(),
        grid,
    })
}

fn read_axis(at: &At<'_>, feature: &Feature, network: &Network) -> Result<Axis, Mismatch> {
    let finite = |name: &str| {
        at.typed(name, "number", |value| {
            value.as_f64().filter(|one| one.is_finite())
        })
    };
    if let Seen::Location(process) = feature.seen {
        at.only(&["name", "locations"])?;
        let known = locations(network, process);
        let given = at.field("locations")?;
        if *given.0 != json!(known) {
            return Err(given.wrong("these are not the locations of the process", OTHER_MODEL));
        }
        return Ok(Axis {
            feature: feature.clone(),
            low: 0.0,
            high: known.len() as f64 - 1.0,
            cells: known.len() as u32,
        });
    }
    let is_exact = matches!(feature.seen, Seen::Integer(_));
    if matches!(feature.seen, Seen::Computed(_)) || is_exact == at.0.get("cells").is_some() {
        let message = format!("{} is of another kind in the model", feature.text);
        return Err(at.wrong(message, OTHER_MODEL));
    }
    at.only(&["name", "low", "high", "cells"])?;
    let (low, high) = (finite("low")?, finite("high")?);
    let cells = if is_exact {
        (high - low + 1.0) as u32
    } else {
        at.index("cells")?
    };
    let is_whole = low.fract() == 0.0 && high.fract() == 0.0 && high - low < MOST_CELLS as f64;
    if low > high || cells == 0 || (is_exact && !is_whole) || (!is_exact && low >= high) {
        return Err(at.wrong(
            format!("{low} and {high} are no bounds of cells"),
            SEE_FORMAT,
        ));
    }
    Ok(Axis {
        feature: feature.clone(),
        low,
        high,
        cells,
    })
}

/// By their numbers in the file: the places of the moves.
fn actions_of(whole: &At<'_>, names: &Names<'_>) -> Result<Vec<u32>, Mismatch> {
    let mut texts = learned_actions::texts(names.network, names.moves);
    texts.pop();
    let given = whole.list("actions")?;
    let asked = given.iter().filter_map(|one| one.0.as_str());
    let finder = Finder::new(&texts, asked);
    let mut places = Vec::new();
    for at in &given {
        let found = at.0.as_str().and_then(|text| finder.find(text).ok());
        match found {
            Some(place) if !places.contains(&place) => places.push(place),
            _ => {
                let message = format!("{} is no move of the controller, or no single one", at.0);
                return Err(at.wrong(message, OTHER_MODEL));
            }
        }
    }
    if let Some(text) = (0..).zip(&texts).find(|(place, _)| !places.contains(place)) {
        let message = format!("the controller has the move {}, too", text.1);
        return Err(whole.field("actions")?.wrong(message, OTHER_MODEL));
    }
    Ok(places)
}

fn read_set(at: &At<'_>, places: &[u32]) -> Result<u64, Mismatch> {
    let mut set = 0;
    for one in at.entries()? {
        let place = one
            .0
            .as_u64()
            .and_then(|number| places.get(number as usize));
        let Some(place) = place else {
            return Err(one.wrong(format!("there is no action {}", one.0), SEE_FORMAT));
        };
        set |= 1 << place;
    }
    Ok(set)
}

/// The sets of the cells, one after the other.
fn read_cells(whole: &At<'_>, sets: &[u64], count: u64) -> Result<Vec<u64>, Mismatch> {
    let given = whole.field("cells")?;
    let numbers = given.0.as_array().map(Vec::as_slice).unwrap_or_default();
    let mut allowed = Vec::new();
    for run in numbers.chunks(2) {
        cancellation::work(UNITS_FOR_RUN);
        let set = run[0].as_u64().and_then(|set| sets.get(set as usize));
        let length = run.get(1).and_then(Json::as_u64);
        let left = count - allowed.len() as u64;
        let (Some(&set), Some(length)) = (set, length.filter(|&one| one <= left)) else {
            let message = "this is no list of sets with numbers of cells";
            return Err(given.wrong(message, SEE_FORMAT));
        };
        allowed.resize(allowed.len() + length as usize, set);
    }
    if allowed.len() as u64 != count {
        let message = format!(
            "these are {} cells, and the axes make {count}",
            allowed.len()
        );
        return Err(given.wrong(message, SEE_FORMAT));
    }
    Ok(allowed)
}
