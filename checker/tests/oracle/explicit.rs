//! The graph of regions of a network, and games on it by fixpoints.

use std::collections::{BTreeMap, HashMap};

use checker::ir::Network;
use checker::verify::{Error, Move, Part, Regions, Semantics, State};

/// A move, as far as games need it.
#[derive(Clone, Debug)]
pub(crate) struct Step {
    pub target: usize,
    pub controllable: bool,
    pub parts: Vec<Part>,
    /// The edges that it takes, without the branches: the controller chooses among these only.
    pub entry: Entry,
    pub label: Label,
}

/// What is chosen of a move, as numbers.
pub(crate) type Entry = Vec<(u32, u32, u32)>;

impl Step {
    fn takes_part(&self, process: u32) -> bool {
        self.parts.iter().any(|part| part.process == process)
    }
}

/// What is chosen of a move: the edges with their select values. Of legs that are edges it is what
/// they have of their branch point's edge, and if that does not synchronise, the leg says with
/// whom.
pub(crate) fn entry(network: &Network, parts: &[Part]) -> Entry {
    let leg = |part: &Part| {
        let process = &network.processes[part.process as usize];
        process.edges[part.edge as usize].leg.as_ref()
    };
    let first = parts.first().and_then(leg);
    let is_alone = first.is_some_and(|leg| !leg.follows_sync);
    let named = parts.iter().take(if is_alone { 1 } else { parts.len() });
    named
        .map(|part| match leg(part) {
            Some(leg) => (part.process, leg.first.0, part.select / leg.combinations),
            None => (part.process, part.edge, part.select),
        })
        .collect()
}

/// What tells controllable moves apart under partial observation: the channel, else the edge with
/// its select values.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub(crate) enum Label {
    Channel(u32),
    Edge(u32, u32, u32),
}

/// What stops time in a state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Stopper {
    /// The location or the invariant of a process.
    Process(u32),
    /// A synchronisation on an urgent channel.
    Channel,
}

/// A region with its successors.
#[derive(Clone, Debug)]
pub(crate) struct Node {
    pub state: State,
    pub steps: Vec<Step>,
    /// The next region, if time may pass; the node itself if the region has no end.
    pub later: Option<usize>,
    /// What stops time, if it is stopped.
    pub stoppers: Vec<Stopper>,
    /// Whether the controller is not allowed to wait.
    pub is_obliged: bool,
}

/// All regions that can be reached; the first is the initial one.
pub(crate) struct Graph {
    pub nodes: Vec<Node>,
    pub ticks: i64,
    pub network: Network,
}

/// Why there is no graph.
pub(crate) enum NoGraph {
    TooLarge,
    Failed(Error),
}

impl From<Error> for NoGraph {
    fn from(error: Error) -> NoGraph {
        NoGraph::Failed(error)
    }
}

#[derive(Default)]
struct Known {
    index: HashMap<State, usize>,
    states: Vec<State>,
}

impl Known {
    fn id(&mut self, state: State) -> usize {
        if let Some(&id) = self.index.get(&state) {
            return id;
        }
        self.states.push(state.clone());
        self.index.insert(state, self.states.len() - 1);
        self.states.len() - 1
    }
}

/// Explores all regions, up to a number. If priorities count, only moves of the highest level are
/// possible in each.
pub(crate) fn explore(
    semantics: &Semantics<'_>,
    regions: &Regions,
    has_priorities: bool,
    most: usize,
) -> Result<Graph, NoGraph> {
    let mut known = Known::default();
    let mut initial = semantics.initial()?;
    regions.represent_state(&mut initial);
    known.id(initial);
    let mut nodes = Vec::new();
    while nodes.len() < known.states.len() {
        if known.states.len() > most {
            return Err(NoGraph::TooLarge);
        }
        let state = known.states[nodes.len()].clone();
        let node = successors(semantics, regions, has_priorities, state, &mut known)?;
        nodes.push(node);
    }
    Ok(Graph {
        nodes,
        ticks: semantics.ticks_per_unit(),
        network: semantics.network().clone(),
    })
}

fn successors(
    semantics: &Semantics<'_>,
    regions: &Regions,
    has_priorities: bool,
    state: State,
    known: &mut Known,
) -> Result<Node, Error> {
    let moves = semantics.moves(&state)?;
    let mut possible = Vec::new();
    for one in &moves {
        if let Some(target) = semantics.take(&state, &one.parts)? {
            possible.push((one, target));
        }
    }
    if has_priorities {
        let highest = possible.iter().map(|(one, _)| one.level).max();
        possible.retain(|(one, _)| Some(one.level) == highest);
    }
    let mut steps = Vec::new();
    for (one, mut target) in possible {
        regions.represent_state(&mut target);
        steps.push(Step {
            target: known.id(target),
            controllable: one.controllable,
            parts: one.parts.clone(),
            label: label(semantics.network(), one),
            entry: entry(semantics.network(), &one.parts),
        });
    }
    let mut next = state.clone();
    regions.pass(&mut next.clocks);
    let mut stoppers = Vec::new();
    for process in 0..semantics.network().processes.len() {
        if semantics.is_urgent(process, &state) || !semantics.invariant_holds(process, &next)? {
            stoppers.push(Stopper::Process(process as u32));
        }
    }
    let network = semantics.network();
    // Of a synchronisation that is possible at all moments after the region there is no first one.
    let is_stopped_at_once = network.features.clock_guarded_urgent
        && regions.opens(&state.clocks)
        && semantics.moves(&next)?.iter().any(|one| one.is_urgent);
    if is_stopped_at_once || moves.iter().any(|one| one.is_urgent) {
        stoppers.push(Stopper::Channel);
    }
    let later = stoppers.is_empty().then(|| known.id(next));
    Ok(Node {
        state,
        steps,
        later,
        stoppers,
        is_obliged: false,
    })
}

fn label(network: &Network, one: &Move) -> Label {
    let first = one.parts[0];
    let edges = &network.processes[first.process as usize].edges;
    let leg = edges[first.edge as usize].leg.as_ref();
    match one.channel {
        Some(channel) if leg.is_none_or(|leg| leg.follows_sync) => Label::Channel(channel),
        _ => {
            let (process, edge, select) = entry(network, &one.parts)[0];
            let named = edges[edge as usize].leg.as_ref();
            Label::Edge(
                process,
                edge,
                select * named.map_or(1, |leg| leg.combinations),
            )
        }
    }
}

impl Graph {
    /// Whether no move is possible in a node, now or after any delay.
    pub(crate) fn is_deadlock(&self, node: usize) -> bool {
        is_deadlock(node, |node| {
            let node = &self.nodes[node];
            (!node.steps.is_empty(), node.later)
        })
    }
}

/// Whether no move is possible in a node, now or after any delay; `look` says of a node whether
/// there is a move, and where time leads.
pub(crate) fn is_deadlock(node: usize, look: impl Fn(usize) -> (bool, Option<usize>)) -> bool {
    let mut seen = vec![node];
    loop {
        match look(seen[seen.len() - 1]) {
            (true, _) => return false,
            (false, Some(later)) if !seen.contains(&later) => seen.push(later),
            _ => return true,
        }
    }
}

/// What the controller is to enforce, node by node.
pub(crate) struct Objective<'a> {
    /// Play ends, won, where this holds.
    pub goal: &'a [bool],
    /// Where this does not hold, play is lost (goals excepted).
    pub keep: &'a [bool],
    /// Whether the goal must be reached; otherwise keeping is enough.
    pub must_reach: bool,
}

/// The rule for forced moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Rule {
    Tiga,
    Product,
    Neutral,
}

/// The nodes from which the controller wins: the least fixpoint if the goal must be reached, else
/// the greatest.
pub(crate) fn winning(graph: &Graph, objective: &Objective<'_>, rule: Rule) -> Vec<bool> {
    let mut win = vec![!objective.must_reach; graph.nodes.len()];
    loop {
        let mut changed = false;
        for node in (0..graph.nodes.len()).rev() {
            let wins = objective.goal[node]
                || (objective.keep[node]
                    && is_won(graph, node, (&win, &win), objective.must_reach, rule));
            changed |= wins != win[node];
            win[node] = wins;
        }
        if !changed {
            return win;
        }
    }
}

/// The nodes from which the controller can keep for ever, and have the goal again and again: a
/// greatest fixpoint around a least one. Where play ends, the goal must hold.
pub(crate) fn recurring(graph: &Graph, goal: &[bool], keep: &[bool], rule: Rule) -> Vec<bool> {
    let mut kept = vec![true; graph.nodes.len()];
    loop {
        let mut win = vec![false; graph.nodes.len()];
        loop {
            let mut changed = false;
            for node in (0..graph.nodes.len()).rev() {
                let wins = keep[node]
                    && if goal[node] {
                        is_won(graph, node, (&kept, &kept), false, rule)
                    } else {
                        is_won(graph, node, (&win, &win), true, rule)
                    };
                changed |= wins != win[node];
                win[node] = wins;
            }
            if !changed {
                break;
            }
        }
        if win == kept {
            return win;
        }
        kept = win;
    }
}

/// Whether the controller wins from a node, if moves must lead to nodes of the first set, and time
/// to nodes of the second.
pub(crate) fn is_won(
    graph: &Graph,
    node: usize,
    (win, win_by_time): (&[bool], &[bool]),
    must_reach: bool,
    rule: Rule,
) -> bool {
    let node = &graph.nodes[node];
    let (own, others): (Vec<&Step>, Vec<&Step>) =
        node.steps.iter().partition(|step| step.controllable);
    if others.iter().any(|step| !win[step.target]) {
        return false;
    }
    // The environment picks the branch.
    let mut entries: BTreeMap<Entry, bool> = BTreeMap::new();
    for step in &own {
        *entries.entry(step.entry.clone()).or_insert(true) &= win[step.target];
    }
    let wins_by_moving = entries.values().any(|wins| *wins);
    if node.is_obliged {
        return wins_by_moving;
    }
    if wins_by_moving || node.later.is_some_and(|later| win_by_time[later]) {
        return true;
    }
    if node.later.is_some() {
        return false;
    }
    // Where the environment may decline, the controller has to move if there is something to keep.
    !others.is_empty() && is_forced(&node.stoppers, &own, rule) || !must_reach && own.is_empty()
}

/// Whether the environment must move where time is stopped: something stops time to which the
/// controller has no move.
pub(crate) fn is_forced(stoppers: &[Stopper], own: &[&Step], rule: Rule) -> bool {
    stoppers.iter().any(|stopper| match (rule, stopper) {
        (Rule::Neutral, _) => true,
        (Rule::Product, _) | (Rule::Tiga, Stopper::Channel) => own.is_empty(),
        (Rule::Tiga, Stopper::Process(process)) => {
            own.iter().all(|step| !step.takes_part(*process))
        }
    })
}
