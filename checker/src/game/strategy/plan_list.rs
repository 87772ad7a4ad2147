//! Lists of plans that take little memory, however many plans there are.
//!
//! The steps of each distinct chain of moves are stored once. A plan is a sequence of chains. If
//! every sequence of winning edges can be carried out, whatever the clocks show, and no edge leads
//! back, the plans are the paths of the winning part of the graph: that part is stored, and the
//! plans are found again one after the other. Otherwise they are written down when they are found;
//! of each, only what differs from the plan before it.
//!
//! Cost: eight bytes for each winning edge and five for each winning node; or, where plans are
//! written down, four bytes for each chain that is not shared with the plan before, and eight.

use std::sync::Arc;

use rustc_hash::FxHashMap;

use crate::cancellation;
use crate::network::{Failure, FixedMove, MoveListId, Moves, Part};

use super::plans::{NoPlans, Plans, UNITS_FOR_STEP};
use crate::game::backward::winning_sets::Win;
use crate::game::forward::node::{Edge, NONE, Standing};
use crate::game::solver::Solver;

/// One transition of a plan.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct PlanStep {
    /// The edges that are taken.
    pub parts: Vec<Part>,
    /// Whether some process was in a committed location before it: such a step follows from the one
    /// before it.
    pub was_committed: bool,
}

/// Plans, in the order of the moves of each state.
#[derive(Clone, Debug, Default)]
pub struct PlanList {
    steps: Vec<PlanStep>,
    chains: Vec<Vec<u32>>,
    ways: Ways,
    count: u64,
}

/// Where the plans are.
#[derive(Clone, Debug)]
enum Ways {
    /// In a graph without circles, whose first node is the initial one.
    Graph(Vec<WayNode>, Vec<Way>),
    /// Of each plan: how many chains it shares with the plan before, how many follow, and these.
    Written(Vec<u32>),
}

impl Default for Ways {
    fn default() -> Ways {
        Ways::Written(Vec::new())
    }
}

/// A node on winning paths: where its edges start. They end where those of the next node start.
#[derive(Clone, Copy, Debug)]
struct WayNode {
    first: u32,
    is_goal: bool,
}

/// An edge on winning paths.
#[derive(Clone, Copy, Debug)]
struct Way {
    target: u32,
    chain: u32,
}

impl PlanList {
    /// How many plans are listed.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// The distinct transitions of the plans.
    pub fn steps(&self) -> &[PlanStep] {
        &self.steps
    }

    /// The distinct chains of transitions, by their indices.
    pub fn chains(&self) -> &[Vec<u32>] {
        &self.chains
    }
}

/// Goes through the plans of a list, one after the other.
#[derive(Clone, Debug)]
pub struct PlanWalk {
    list: Arc<PlanList>,
    /// The chains of the plan.
    chains: Vec<u32>,
    /// Of a graph: the nodes on the path, each with the edge that is next.
    path: Vec<(u32, u32)>,
    /// Where plans are written down: the place of the next one.
    place: usize,
    given: u64,
}

impl PlanWalk {
    /// A walk that starts before the first plan.
    pub fn new(list: Arc<PlanList>) -> PlanWalk {
        let path = match &list.ways {
            Ways::Graph(nodes, _) => vec![(0, nodes[0].first)],
            Ways::Written(_) => Vec::new(),
        };
        PlanWalk {
            list,
            chains: Vec::new(),
            path,
            place: 0,
            given: 0,
        }
    }

    /// The list.
    pub fn list(&self) -> &Arc<PlanList> {
        &self.list
    }

    /// The next plan, as chains; `None` after the last.
    pub fn next_plan(&mut self) -> Option<&[u32]> {
        if self.given == self.list.count {
            return None;
        }
        self.given += 1;
        let list = Arc::clone(&self.list);
        match &list.ways {
            Ways::Graph(nodes, edges) => self.walk_on(nodes, edges),
            Ways::Written(words) => self.read_on(words),
        }
    }

    fn walk_on(&mut self, nodes: &[WayNode], edges: &[Way]) -> Option<&[u32]> {
        loop {
            let (node, next) = self.path.last_mut()?;
            let WayNode { first, is_goal } = nodes[*node as usize];
            if is_goal && *next == first {
                // A goal has no edges: the mark is that of a node that was left.
                *next = NONE;
                return Some(&self.chains);
            }
            let end = nodes[*node as usize + 1].first;
            if *next >= end {
                self.path.pop();
                self.chains.pop();
                continue;
            }
            let way = edges[*next as usize];
            *next += 1;
            self.path
                .push((way.target, nodes[way.target as usize].first));
            self.chains.push(way.chain);
        }
    }

    fn read_on(&mut self, words: &[u32]) -> Option<&[u32]> {
        let [shared, more] = *words.get(self.place..)?.first_chunk()?;
        let start = self.place + 2;
        self.place = start + more as usize;
        self.chains.truncate(shared as usize);
        self.chains.extend(words.get(start..self.place)?);
        Some(&self.chains)
    }
}

/// What follows the plans that are listed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EndOfPlans {
    /// None.
    All,
    /// More than are wanted, or, after a single one, nobody looked.
    More,
    /// A limit came first.
    Stopped,
}

/// Nodes or plans between two looks at the memory that they take.
const BETWEEN_LOOKS: usize = 256;

/// Lists the plans of a solved game, at most `most`.
///
/// # Errors
/// The outer one: the model fails. The inner one: there is no list.
pub fn list_plans(
    solver: &mut Solver<'_, '_, '_>,
    most: u64,
) -> Result<Result<(PlanList, EndOfPlans), NoPlans>, Failure> {
    if (0..solver.graph.nodes.len() as u32).any(|node| has_opponent_choice(solver, node)) {
        return Ok(Err(NoPlans::EnvironmentChooses));
    }
    let mut chains = Chains::default();
    if most > 1
        && let Some(graph) = WinningGraph::of(solver)
        && (graph.count <= most || graph.nodes.len() as u64 <= most)
    {
        let end = if graph.count <= most {
            EndOfPlans::All
        } else {
            EndOfPlans::More
        };
        let mut list = graph.into_list(solver, chains)?;
        list.count = list.count.min(most);
        return Ok(Ok((list, end)));
    }
    let (words, count, end) = write_down(solver, &mut chains, most)?;
    Ok(Ok((chains.into_list(Ways::Written(words), count), end)))
}

/// Writes plans down as they are found.
fn write_down(
    solver: &mut Solver<'_, '_, '_>,
    chains: &mut Chains,
    most: u64,
) -> Result<(Vec<u32>, u64, EndOfPlans), Failure> {
    let mut plans = Plans::new(solver);
    let mut known: FxHashMap<u32, u32> = FxHashMap::default();
    let (mut words, mut last, mut count) = (Vec::new(), Vec::new(), 0);
    loop {
        let step = cancellation::unless_cut(|| {
            if count % BETWEEN_LOOKS as u64 == 0 {
                cancellation::ask_for(size_of_val(&*words) + 32 * known.len());
            }
            plans.next_path().map(<[u32]>::to_vec)
        });
        let path = match step {
            Err(cancellation::Cut) => return Ok((words, count, EndOfPlans::Stopped)),
            Ok(None) => return Ok((words, count, EndOfPlans::All)),
            Ok(Some(_)) if count == most => return Ok((words, count, EndOfPlans::More)),
            Ok(Some(path)) => path,
        };
        let shared = path.iter().zip(&last).take_while(|(a, b)| a == b).count();
        let more = cancellation::unless_cut(|| {
            let edges = path[shared..].iter();
            edges
                .map(|&edge| {
                    if let Some(&chain) = known.get(&edge) {
                        return Ok(chain);
                    }
                    let chain = chains.of_edge(plans.solver, edge)?;
                    known.insert(edge, chain);
                    Ok(chain)
                })
                .collect::<Result<Vec<u32>, Failure>>()
        });
        let Ok(more) = more else {
            return Ok((words, count, EndOfPlans::Stopped));
        };
        let more = match more {
            Err(Failure::Interrupted) => return Ok((words, count, EndOfPlans::Stopped)),
            other => other?,
        };
        words.extend([shared as u32, more.len() as u32]);
        words.extend(more);
        last = path;
        count += 1;
        if most == 1 {
            return Ok((words, count, EndOfPlans::More));
        }
    }
}

/// The part of the graph that winning paths go through, without circles.
struct WinningGraph {
    /// The nodes, as those of the game; the first is the initial one.
    nodes: Vec<u32>,
    /// The number of each node of the game in it.
    numbers: Vec<u32>,
    count: u64,
}

impl WinningGraph {
    /// The winning part; `None` if not all of its paths are plans, whatever the clocks show.
    fn of(solver: &Solver<'_, '_, '_>) -> Option<WinningGraph> {
        let graph = &*solver.graph;
        cancellation::ask_for(graph.nodes.len() * 4 * size_of::<u64>());
        let mut found = WinningGraph {
            nodes: Vec::new(),
            numbers: vec![NONE; graph.nodes.len()],
            count: 0,
        };
        if matches!(solver.won.win[0], Win::Nothing) {
            return None;
        }
        // Of each node, by its number: the paths from it, and whether it is on the path now.
        let mut counts: Vec<(u64, bool)> = Vec::new();
        let mut path: Vec<(u32, usize)> = Vec::new();
        found.enter(0, &mut counts, &mut path);
        while let Some((node, next)) = path.last_mut() {
            cancellation::work(1);
            let number = found.numbers[*node as usize] as usize;
            let range = graph.edges_of(*node);
            let is_goal = graph.nodes[*node as usize].standing == Standing::Goal;
            if is_goal || range.start + *next >= range.end {
                let paths = if is_goal { 1 } else { counts[number].0 };
                counts[number] = (paths, false);
                path.pop();
                if let Some((before, _)) = path.last() {
                    let before = &mut counts[found.numbers[*before as usize] as usize];
                    before.0 = before.0.saturating_add(paths);
                }
                continue;
            }
            let edge = &graph.edges[range.start + *next];
            *next += 1;
            if !is_winning(solver, edge) {
                continue;
            }
            if !edge.is_total || graph.urgent(edge.target).is_some() {
                return None;
            }
            let target = found.numbers[edge.target as usize];
            if target == NONE {
                found.enter(edge.target, &mut counts, &mut path);
                continue;
            }
            let (paths, is_on_path) = counts[target as usize];
            if is_on_path {
                return None;
            }
            counts[number].0 = counts[number].0.saturating_add(paths);
        }
        found.count = counts[0].0;
        Some(found)
    }

    fn enter(&mut self, node: u32, counts: &mut Vec<(u64, bool)>, path: &mut Vec<(u32, usize)>) {
        self.numbers[node as usize] = self.nodes.len() as u32;
        self.nodes.push(node);
        counts.push((0, true));
        path.push((node, 0));
    }

    /// The list of its plans.
    fn into_list(
        self,
        solver: &mut Solver<'_, '_, '_>,
        mut chains: Chains,
    ) -> Result<PlanList, Failure> {
        let mut nodes = Vec::with_capacity(self.nodes.len() + 1);
        let mut ways: Vec<Way> = Vec::new();
        for (number, &node) in self.nodes.iter().enumerate() {
            if number % BETWEEN_LOOKS == 0 {
                cancellation::ask_for(size_of_val(&*nodes) + size_of_val(&*ways));
            }
            let is_goal = solver.graph.nodes[node as usize].standing == Standing::Goal;
            let first = ways.len() as u32;
            nodes.push(WayNode { first, is_goal });
            if is_goal {
                continue;
            }
            for edge in solver.graph.edges_of(node) {
                if is_winning(solver, &solver.graph.edges[edge]) {
                    let target = self.numbers[solver.graph.edges[edge].target as usize];
                    let chain = chains.of_edge(solver, edge as u32)?;
                    ways.push(Way { target, chain });
                }
            }
        }
        nodes.push(WayNode {
            first: ways.len() as u32,
            is_goal: false,
        });
        Ok(chains.into_list(Ways::Graph(nodes, ways), self.count))
    }
}

fn is_winning(solver: &Solver<'_, '_, '_>, edge: &Edge) -> bool {
    !matches!(solver.won.win[edge.target as usize], Win::Nothing)
}

/// Whether the environment has another move besides this one, or may choose when to move.
fn has_opponent_choice(solver: &Solver<'_, '_, '_>, node: u32) -> bool {
    let range = solver.graph.edges_of(node);
    let count = range.len();
    let has_opponent = range
        .into_iter()
        .any(|edge| !solver.graph.edges[edge].controllable || solver.graph.edges[edge].is_leg);
    has_opponent && (count > 1 || solver.graph.nodes[node as usize].delays)
}

/// The distinct steps and chains that were met.
#[derive(Default)]
struct Chains {
    steps: Vec<PlanStep>,
    step_ids: FxHashMap<PlanStep, u32>,
    found: Vec<Vec<u32>>,
    ids: FxHashMap<Vec<u32>, u32>,
    /// The moves of lists that were fixed, by list and ordinal.
    fixed: FxHashMap<(MoveListId, u32), (u32, Option<FixedMove>)>,
    words: Vec<i32>,
    moves: Moves,
    /// The steps of the chain that is followed.
    current: Vec<u32>,
}

impl Chains {
    /// The chain of an edge: the steps from its source to its target.
    fn of_edge(&mut self, solver: &mut Solver<'_, '_, '_>, index: u32) -> Result<u32, Failure> {
        let edge = solver.graph.edges[index as usize];
        let mut words = std::mem::take(&mut self.words);
        words.clone_from(&solver.graph.symbolic.stepper.network().initial);
        solver.graph.load(edge.source, &mut words);
        self.current.clear();
        let result = (0..edge.length).try_for_each(|position| -> Result<(), Failure> {
            let ordinal = if position == 0 { edge.ordinal } else { 0 };
            let step = self.take(solver, ordinal, &mut words)?;
            self.current.push(step);
            Ok(())
        });
        self.words = words;
        result?;
        if let Some(&known) = self.ids.get(&self.current) {
            return Ok(known);
        }
        let id = self.found.len() as u32;
        self.found.push(self.current.clone());
        self.ids.insert(self.current.clone(), id);
        Ok(id)
    }

    /// Takes the move with this ordinal; returns the step.
    fn take(
        &mut self,
        solver: &mut Solver<'_, '_, '_>,
        ordinal: u32,
        words: &mut [i32],
    ) -> Result<u32, Failure> {
        cancellation::work(UNITS_FOR_STEP);
        let symbolic = &mut *solver.graph.symbolic;
        // Moves depend on locations and answers of guards: most were met before.
        let list = match symbolic.stepper.vector(words) {
            Some(vector) if symbolic.is_fixed() => symbolic.stepper.move_list(vector, words)?,
            _ => None,
        };
        let known = list.and_then(|list| self.fixed.get(&(list, ordinal)));
        if let Some((step, Some(one))) = known {
            symbolic.stepper.take(one, words)?;
            return Ok(*step);
        }
        symbolic.remembered_moves(words, &mut self.moves)?;
        let one = self.moves.get(ordinal as usize);
        let taken = PlanStep {
            parts: one.parts.to_vec(),
            was_committed: symbolic.stepper.is_committed(words),
        };
        let count = self.steps.len() as u32;
        let step = *self.step_ids.entry(taken).or_insert_with_key(|step| {
            self.steps.push(step.clone());
            count
        });
        if let Some(list) = list {
            let fixed = symbolic.stepper.fix(one, words);
            self.fixed.insert((list, ordinal), (step, fixed));
        }
        symbolic.stepper.fire(one.parts, words)?;
        Ok(step)
    }

    fn into_list(self, ways: Ways, count: u64) -> PlanList {
        PlanList {
            steps: self.steps,
            chains: self.found,
            ways,
            count,
        }
    }
}
