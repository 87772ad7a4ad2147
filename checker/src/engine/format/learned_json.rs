//! Learned strategies as files, in the form of UPPAAL: written, and read for a model.
//!
//! The format is described in `docs/strategy.md`. In short: `actions` gives moves numbers,
//! `statevars` and `pointvars` are what is seen, and `regressors` has, for each combination of the
//! exact values, a tree for each action, whose leaves say what it is worth. The numbers of files
//! are those of their writer; moves are found by their texts, and locations by their names. A file
//! is read as a whole or not at all.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::sync::Arc;

use serde_json::{Map, Value as Json, json};

use super::json_reader::{At, Mismatch, SEE_FORMAT, WRITE_ONE};
use super::learned_actions::{self, Finder, Unmatched, WAIT};
use crate::cancellation;
use crate::ir::{Feature, FeatureTexts, Network, Observation, Part, ProcessId, Seen};
use crate::learning::{Appraisal, LearnedStrategy, Node, Regressor, order, values, words};

/// The `type` of such a file.
pub const TYPE: &str = "state->regressor";

const REPRESENTATION: &str = "map";
const TREES_TYPE: &str = "act->point->val";
const TREES_REPRESENTATION: &str = "simpletree";

/// Trees are at most so deep.
pub const MOST_DEPTH: usize = 500;

/// What it takes to write or read a node of a tree: see [`cancellation::work`].
const UNITS_FOR_NODE: usize = 128;

const OTHER_MODEL: &str =
    "the strategy was made for another model, or the model has changed: learn it again";

/// A strategy as the text of JSON. Actions that were never tried are left out. The same strategy
/// gives the same text.
pub fn text(network: &Network, strategy: &LearnedStrategy) -> String {
    let head = json!({
        "version": 1.0,
        "type": TYPE,
        "representation": REPRESENTATION,
        "actions": actions(network, strategy),
        "statevars": texts(&strategy.observation).discrete,
        "pointvars": texts(&strategy.observation).continuous,
        "locationnames": location_names(network),
    });
    let mut text = head.to_string();
    text.pop();
    text.push_str(",\"regressors\":{");
    for (index, regressor) in strategy.regressors.iter().enumerate() {
        let comma = if index > 0 { "," } else { "" };
        // Writing to a string cannot fail.
        let _ = write!(
            text,
            "{comma}\"{}\":{{\"type\":\"{TREES_TYPE}\",\"representation\":\"{TREES_REPRESENTATION}\",\
             \"minimize\":{},\"regressor\":{{",
            key_text(&values(&strategy.observation, &regressor.key)),
            u8::from(!strategy.is_greatest),
        );
        for (index, Appraisal { action, tree }) in regressor.appraisals.iter().enumerate() {
            cancellation::work(UNITS_FOR_NODE * tree.len());
            let comma = if index > 0 { "," } else { "" };
            let _ = write!(text, "{comma}\"{action}\":");
            write_tree(tree, 0, &mut text);
        }
        text.push_str("}}");
    }
    text.push_str("}}");
    text
}

/// What an observation sees, as texts.
pub fn texts(observation: &Observation) -> FeatureTexts {
    let texts = |features: &[Feature]| -> Vec<String> {
        let texts = features.iter().map(|one| one.text.clone());
        texts.collect()
    };
    FeatureTexts {
        discrete: texts(&observation.discrete),
        continuous: texts(&observation.continuous),
    }
}

fn actions(network: &Network, strategy: &LearnedStrategy) -> Map<String, Json> {
    let mut is_tried = vec![false; strategy.moves.len() + 1];
    let regressors = strategy.regressors.iter();
    for one in regressors.flat_map(|one| &one.appraisals) {
        is_tried[one.action as usize] = true;
    }
    let texts = learned_actions::texts(network, &strategy.moves);
    let tried = texts.into_iter().zip(is_tried).enumerate();
    tried
        .filter(|(_, (_, is_tried))| *is_tried)
        .map(|(number, (text, _))| (number.to_string(), json!(text)))
        .collect()
}

fn location_names(network: &Network) -> Map<String, Json> {
    let names = network.processes.iter().map(|process| {
        let names = process.locations.iter().enumerate();
        let names: Map<String, Json> = names
            .map(|(number, one)| (number.to_string(), json!(one.name)))
            .collect();
        (format!("{}.location", process.name), Json::Object(names))
    });
    names.collect()
}

/// The key of exact values; without any it is `(1)`.
fn key_text(values: &[f64]) -> String {
    if values.is_empty() {
        return String::from("(1)");
    }
    let values: Vec<String> = values.iter().map(|&value| short(value)).collect();
    format!("({})", values.join(","))
}

/// The shortest text that is read as the same double; integers have no point.
fn short(value: f64) -> String {
    let text = format!("{value:?}");
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}

fn write_tree(tree: &[Node<f64>], node: u32, text: &mut String) {
    // Writing to a string cannot fail.
    let _ = match tree[node as usize] {
        Node::Leaf(worth) => write!(text, "{worth:?}"),
        Node::Cut {
            feature,
            bound,
            low,
            high,
        } => {
            let _ = write!(text, "{{\"var\":{feature},\"bound\":{bound:?},\"low\":");
            write_tree(tree, low, text);
            text.push_str(",\"high\":");
            write_tree(tree, high, text);
            write!(text, "}}")
        }
    };
}

/// How deep the trees of a strategy are.
pub fn depth(strategy: &LearnedStrategy) -> usize {
    let regressors = strategy.regressors.iter();
    let trees = regressors.flat_map(|one| &one.appraisals);
    let depth = |tree: &[Node<f64>]| {
        // A node stands behind the one that leads to it.
        let mut depths = vec![1; tree.len()];
        for (node, branch) in tree.iter().enumerate() {
            if let Node::Cut { low, high, .. } = *branch {
                depths[low as usize] = depths[node] + 1;
                depths[high as usize] = depths[node] + 1;
            }
        }
        depths.into_iter().max().unwrap_or(0)
    };
    trees.map(|one| depth(&one.tree)).max().unwrap_or(0)
}

/// The JSON of the bytes of a file.
///
/// # Errors
/// They are none, or are nested too deeply to be looked at.
pub fn parsed(bytes: &[u8]) -> Result<Json, Mismatch> {
    let wrong = |message: String| Mismatch {
        place: String::new(),
        message,
        help: Some(WRITE_ONE),
    };
    // The objects around a tree are four deep.
    if nesting(bytes) > MOST_DEPTH + 4 {
        let message = format!("this is nested too deeply: trees are at most {MOST_DEPTH} deep");
        return Err(wrong(message));
    }
    let mut reader = serde_json::Deserializer::from_slice(bytes);
    reader.disable_recursion_limit();
    let mut values = reader.into_iter::<Json>();
    let no_json = |error| wrong(format!("this is no JSON: {error}"));
    let file = values
        .next()
        .ok_or_else(|| wrong(String::from("the file is empty")))?;
    let file = file.map_err(no_json)?;
    match values.next() {
        None => Ok(file),
        Some(Err(error)) => Err(no_json(error)),
        Some(Ok(_)) => Err(wrong(String::from(
            "this is no JSON: there is more behind its end",
        ))),
    }
}

/// How deep brackets are nested outside of texts.
fn nesting(bytes: &[u8]) -> usize {
    let (mut depth, mut deepest, mut is_text, mut is_escaped) = (0_usize, 0, false, false);
    for &byte in bytes {
        match byte {
            _ if is_escaped => is_escaped = false,
            b'\\' if is_text => is_escaped = true,
            b'"' => is_text = !is_text,
            b'{' | b'[' if !is_text => depth += 1,
            b'}' | b']' if !is_text => depth = depth.saturating_sub(1),
            _ => {}
        }
        deepest = deepest.max(depth);
    }
    deepest
}

/// Whether this is, or wants to be, a learned strategy.
pub fn is_one(file: &Json) -> bool {
    file.get("format").is_none() && (file.get("type").is_some() || file.get("regressors").is_some())
}

/// What the strategy of a file sees, as texts with blanks collapsed.
///
/// # Errors
/// The file is no learned strategy.
pub fn features(file: &Json) -> Result<FeatureTexts, Mismatch> {
    let whole = At::whole(file);
    let expect = |at: &At<'_>, name: &str, wanted: &str| {
        let given = at.text(name)?;
        if given == wanted {
            return Ok(());
        }
        let message = format!("this is {given:?}, and of a learned strategy it is {wanted:?}");
        Err(at.field(name)?.wrong(message, WRITE_ONE))
    };
    expect(&whole, "type", TYPE)?;
    expect(&whole, "representation", REPRESENTATION)?;
    let version = whole.field("version")?;
    if version.0.as_f64() != Some(1.0) {
        let message = format!("version {} of the format is not known", version.0);
        return Err(version.wrong(message, "this ntagen reads version 1.0"));
    }
    let texts = |name: &str| {
        let list = whole.list(name)?;
        let texts = list.iter().map(|one| match one.0.as_str() {
            Some(text) => Ok(text.split_whitespace().collect::<Vec<_>>().join(" ")),
            None => Err(one.wrong("this is no text", SEE_FORMAT)),
        });
        texts.collect::<Result<Vec<String>, Mismatch>>()
    };
    Ok(FeatureTexts {
        discrete: texts("statevars")?,
        continuous: texts("pointvars")?,
    })
}

/// What the model has that a file names.
pub struct Names<'n> {
    /// The network, in the stochastic reading.
    pub network: &'n Network,
    /// What the features of the file are.
    pub observation: &'n Arc<Observation>,
    /// The moves of the controller.
    pub moves: &'n [Part],
}

/// Reads a strategy.
///
/// # Errors
/// It is not of the format, or names what the model does not have.
pub fn read(file: &Json, names: &Names<'_>) -> Result<LearnedStrategy, Mismatch> {
    let whole = At::whole(file);
    let reader = Reader {
        names,
        actions: actions_of(&whole, names)?,
        locations: locations_of(&whole, names)?,
    };
    let mut is_greatest = None;
    let mut regressors = Vec::new();
    let given = whole.map("regressors")?;
    for (key, regressor) in given {
        let place = format!("regressors.{key}");
        let at = At(regressor, place);
        let is_max = is_maximised(&at)?;
        if *is_greatest.get_or_insert(is_max) != is_max {
            let message = "this is the other way round than before";
            return Err(at.field("minimize")?.wrong(message, SEE_FORMAT));
        }
        let key = reader.key(key).map_err(|why| at.wrong(why, OTHER_MODEL))?;
        let appraisals = reader.appraisals(&at, is_max)?;
        regressors.push(Regressor { key, appraisals });
    }
    let observation = names.observation;
    regressors.sort_by(|one, other| order(observation, &one.key, &other.key));
    if let Some(pair) = regressors.windows(2).find(|two| two[0].key == two[1].key) {
        let key = key_text(&values(observation, &pair[0].key));
        let message = format!("the values {key} are there twice");
        return Err(whole.field("regressors")?.wrong(message, SEE_FORMAT));
    }
    regressors.retain(|one| !one.appraisals.is_empty());
    Ok(LearnedStrategy {
        is_greatest: is_greatest.unwrap_or(false),
        observation: Arc::clone(observation),
        moves: names.moves.to_vec(),
        regressors,
    })
}

fn is_maximised(at: &At<'_>) -> Result<bool, Mismatch> {
    let minimises = at.typed("minimize", "0 or 1", |value| match value {
        Json::Bool(given) => Some(*given),
        number if number.as_f64() == Some(0.0) => Some(false),
        number if number.as_f64() == Some(1.0) => Some(true),
        _ => None,
    })?;
    Ok(!minimises)
}

/// By their numbers in the file: the actions.
fn actions_of(whole: &At<'_>, names: &Names<'_>) -> Result<HashMap<String, u32>, Mismatch> {
    let given = whole.map("actions")?;
    let texts = learned_actions::texts(names.network, names.moves);
    let asked = given.values().filter_map(Json::as_str);
    let finder = Finder::new(&texts, asked);
    let mut actions = HashMap::new();
    let mut taken: HashMap<u32, &str> = HashMap::new();
    for (number, text) in given {
        let at = At(text, format!("actions.{number}"));
        let Some(text) = text.as_str() else {
            return Err(at.wrong("this is no text", SEE_FORMAT));
        };
        let action = if text.trim() == WAIT {
            names.moves.len() as u32
        } else {
            let found = finder.find(text);
            found.map_err(|why| {
                let message = match why {
                    Unmatched::Unknown => format!("the controller has no move {text}"),
                    Unmatched::Ambiguous => format!("several moves may be {text}"),
                };
                at.wrong(message, OTHER_MODEL)
            })?
        };
        if let Some(other) = taken.insert(action, number) {
            let message = format!("this is the same action as number {other}");
            return Err(at.wrong(message, SEE_FORMAT));
        }
        actions.insert(number.clone(), action);
    }
    Ok(actions)
}

/// By process: the locations by their numbers in the file.
fn locations_of(
    whole: &At<'_>,
    names: &Names<'_>,
) -> Result<HashMap<u32, HashMap<i64, i32>>, Mismatch> {
    let mut locations = HashMap::new();
    for (name, given) in whole.map("locationnames")? {
        let at = At(given, format!("locationnames.{name}"));
        let mut processes = (0..).zip(&names.network.processes);
        let named = name.strip_suffix(".location").unwrap_or(name);
        let Some((number, process)) = processes.find(|(_, one)| one.name == named) else {
            return Err(at.wrong(format!("the model has no process {named}"), OTHER_MODEL));
        };
        let Some(given) = given.as_object() else {
            return Err(at.wrong("this is no object", SEE_FORMAT));
        };
        let mut own = HashMap::new();
        for (place, location) in given {
            let known = process.locations.iter();
            let mut known = known.map(|one| one.name.as_str());
            let Some(found) = known.position(|one| Some(one) == location.as_str()) else {
                let message = format!("process {named} has no location {location}");
                return Err(at.wrong(message, OTHER_MODEL));
            };
            let Ok(place) = place.parse() else {
                return Err(at.wrong(format!("{place:?} is no number"), SEE_FORMAT));
            };
            own.insert(place, found as i32);
        }
        // In a tree, numbers of locations are compared.
        let is_seen = |one: &Feature| one.seen == Seen::Location(ProcessId(number));
        let is_compared = names.observation.continuous.iter().any(is_seen);
        if is_compared && own.iter().any(|(&theirs, &ours)| theirs != i64::from(ours)) {
            let message = "the locations are numbered otherwise in the model";
            return Err(at.wrong(message, "write the location before the arrow"));
        }
        locations.insert(number, own);
    }
    Ok(locations)
}

struct Reader<'n> {
    names: &'n Names<'n>,
    actions: HashMap<String, u32>,
    locations: HashMap<u32, HashMap<i64, i32>>,
}

impl Reader<'_> {
    /// The words of the exact values of a key.
    fn key(&self, text: &str) -> Result<Vec<i32>, String> {
        let observation = self.names.observation;
        let inner = text.trim().strip_prefix('(');
        let Some(inner) = inner.and_then(|text| text.strip_suffix(')')) else {
            return Err(String::from("a key is a list of values in brackets"));
        };
        let texts: Vec<&str> = inner.split(',').map(str::trim).collect();
        let features = &observation.discrete;
        if features.is_empty() && matches!(texts[..], ["" | "1"]) {
            return Ok(Vec::new());
        }
        if texts.len() != features.len() {
            let count = features.len();
            return Err(format!(
                "there should be {count} values, one for each of statevars"
            ));
        }
        let mut given = Vec::with_capacity(texts.len());
        for (text, feature) in texts.iter().zip(features) {
            let number = text.parse().ok().filter(|number: &f64| number.is_finite());
            let Some(number) = number else {
                return Err(format!("{text:?} is no number"));
            };
            given.push(match feature.seen {
                Seen::Location(process) => self.location(process.0, number)?,
                _ => number,
            });
        }
        words(observation, &given).ok_or_else(|| format!("{text} are no values of statevars"))
    }

    /// The number of a location in the model.
    fn location(&self, process: u32, number: f64) -> Result<f64, String> {
        let count = self.names.network.processes[process as usize]
            .locations
            .len();
        let known = self.locations.get(&process);
        let place = number as i64;
        let found = match known {
            _ if number.fract() != 0.0 => None,
            Some(known) => known.get(&place).copied(),
            None => i32::try_from(place).ok(),
        };
        let found = found.filter(|&one| (0..count as i32).contains(&one));
        found.map(f64::from).ok_or_else(|| {
            let name = &self.names.network.processes[process as usize].name;
            format!("process {name} has no location with the number {number}")
        })
    }

    fn appraisals(&self, at: &At<'_>, is_greatest: bool) -> Result<Vec<Appraisal>, Mismatch> {
        for (name, wanted) in [
            ("type", TREES_TYPE),
            ("representation", TREES_REPRESENTATION),
        ] {
            let given = at.text(name)?;
            if given != wanted {
                let message = format!("only {wanted:?} is known here");
                return Err(at.field(name)?.wrong(message, SEE_FORMAT));
            }
        }
        let mut appraisals = Vec::new();
        for (number, tree) in at.map("regressor")? {
            let at = At(tree, format!("{}.regressor.{number}", at.1));
            let Some(&action) = self.actions.get(number) else {
                return Err(at.wrong("there is no action with this number", SEE_FORMAT));
            };
            let mut nodes = Vec::new();
            let points = self.names.observation.continuous.len();
            grow(tree, points, &mut nodes).map_err(|Wrong { place, message }| Mismatch {
                place: format!("{}{place}", at.1),
                message,
                help: Some(SEE_FORMAT),
            })?;
            appraisals.push(Appraisal {
                action,
                tree: nodes,
            });
        }
        appraisals.sort_by_key(|one| one.action);
        replace_infinite(&mut appraisals, is_greatest);
        Ok(appraisals)
    }
}

/// What is wrong with a tree: where below it, and why.
struct Wrong {
    place: String,
    message: String,
}

/// Adds a tree to the nodes; gives its place. A leaf without end is the text "inf".
fn grow(tree: &Json, points: usize, nodes: &mut Vec<Node<f64>>) -> Result<u32, Wrong> {
    cancellation::work(UNITS_FOR_NODE);
    let wrong = |place: &str, message: String| Wrong {
        place: place.to_owned(),
        message,
    };
    let place = nodes.len();
    let given = match tree {
        Json::Object(given) => given,
        Json::String(text) if text.trim() == "inf" => {
            nodes.push(Node::Leaf(f64::INFINITY));
            return Ok(place as u32);
        }
        leaf => {
            let worth = leaf.as_f64().filter(|worth| worth.is_finite());
            let worth = worth.ok_or_else(|| wrong("", format!("{leaf} is no number")))?;
            // No zero has a sign.
            nodes.push(Node::Leaf(worth + 0.0));
            return Ok(place as u32);
        }
    };
    let field = |name: &str| {
        given
            .get(name)
            .ok_or_else(|| wrong("", format!("\"{name}\" is missing")))
    };
    let feature = field("var")?;
    let Some(feature) = feature.as_u64().filter(|&var| var < points as u64) else {
        let message = format!("there are {points} pointvars, and none is number {feature}");
        return Err(wrong(".var", message));
    };
    let bound = field("bound")?.as_f64().filter(|bound| bound.is_finite());
    let bound = bound.ok_or_else(|| wrong(".bound", String::from("this is no number")))?;
    nodes.push(Node::Leaf(0.0));
    let mut part = |name: &str| {
        let grown = grow(field(name)?, points, nodes);
        grown.map_err(|one| wrong(&format!(".{name}{}", one.place), one.message))
    };
    let (low, high) = (part("low")?, part("high")?);
    nodes[place] = Node::Cut {
        feature: feature as u32,
        bound: bound + 0.0,
        low,
        high,
    };
    Ok(place as u32)
}

/// Writes a number that is worse than all others in the place of leaves without end.
fn replace_infinite(appraisals: &mut [Appraisal], is_greatest: bool) {
    let sign = if is_greatest { -1.0 } else { 1.0 };
    let costs = appraisals.iter().flat_map(|one| &one.tree);
    let costs = costs.filter_map(|node| match node {
        Node::Leaf(worth) if worth.is_finite() => Some(sign * worth),
        _ => None,
    });
    let worst = costs.fold(0.0, f64::max);
    let worse = sign * (2.0 * worst + 1.0).min(f64::MAX);
    for node in appraisals.iter_mut().flat_map(|one| &mut one.tree) {
        if *node == Node::Leaf(f64::INFINITY) {
            *node = Node::Leaf(worse);
        }
    }
}
