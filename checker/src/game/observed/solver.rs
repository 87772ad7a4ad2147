//! Who wins the game on knowledge sets, on the fly.
//!
//! From a knowledge set the controller chooses an action, the environment one of the knowledge sets that this leads to. A set is won
//! with an action all of whose sets are won, and lost if each action is lost or leads to one that is lost. Both spread backwards
//! as soon as they are known. If everything that matters is explored, what is still open is lost if the goal must be reached,
//! since play could go from one observation to the next for ever, and won if it is enough to keep.
//!
//! Sets are explored breadth first, and only where the answer can still hang on them. Equal sets are one.
//!
//! Source: X. Liu, S. Smolka, "Simple linear-time algorithms for minimal fixed points", ICALP 1998, in both directions.

use std::collections::VecDeque;

use rustc_hash::FxHashMap;

use crate::network::{Failure, Symbolic};
use crate::search::limits::{Counters, StopReason, Watch};
use crate::zones::Federation;

use super::class::{Explorer, Outcome};
use super::place::Places;
use super::{Action, Knowledge, Machine, MachineState, Question};

/// How often limits are looked at: after so many symbolic states inside an observation, and after each knowledge set.
const STATES_BETWEEN_LOOKS: usize = 64;

/// Who wins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// The controller.
    Won,
    /// The environment.
    Lost,
    /// A limit came first.
    Stopped(StopReason),
}

/// What is known of a knowledge set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Standing {
    Open,
    Won,
    Lost,
}

struct Node {
    knowledge: Knowledge,
    standing: Standing,
    is_expanded: bool,
    /// Whether it is in the queue.
    is_waiting: bool,
    /// Its choices, in the order in which the controller prefers them.
    choices: Vec<usize>,
    /// The choice with which it was found to be won.
    won_by: Option<usize>,
    /// The choices that lead to it.
    comes_from: Vec<usize>,
}

/// An action in a knowledge set.
struct Choice {
    source: usize,
    action: Action,
    targets: Vec<usize>,
    /// How many of the targets are not won yet.
    open: usize,
    is_lost: bool,
}

/// The game on knowledge sets.
pub struct Solver<'e, 'a, 'q> {
    explorer: Explorer<'e, 'a, 'q>,
    nodes: Vec<Node>,
    choices: Vec<Choice>,
    /// By hash: the nodes.
    known: FxHashMap<u64, Vec<usize>>,
    waiting: VecDeque<usize>,
    bytes: usize,
    zones: u64,
}

impl<'e, 'a, 'q> Solver<'e, 'a, 'q> {
    /// The game of a question.
    pub fn new(symbolic: &'e mut Symbolic<'a>, question: Question<'q>) -> Solver<'e, 'a, 'q> {
        Solver {
            explorer: Explorer {
                symbolic,
                question,
                places: Places::default(),
                explored: 0,
            },
            nodes: Vec::new(),
            choices: Vec::new(),
            known: FxHashMap::default(),
            waiting: VecDeque::new(),
            bytes: 0,
            zones: 0,
        }
    }

    /// What was done: symbolic states inside observations are explored, zones of knowledge sets stored.
    pub fn counters(&self) -> Counters {
        Counters {
            explored: self.explorer.explored,
            stored: self.zones,
            waiting: self.waiting.len() as u64,
            bytes: (self.bytes + self.explorer.places.bytes()) as u64,
        }
    }

    /// The number of knowledge sets.
    pub fn knowledge_sets(&self) -> usize {
        self.nodes.len()
    }

    /// Solves the game.
    pub fn solve(&mut self, watch: &mut dyn Watch) -> Result<Answer, Failure> {
        let Some(standing) = self.start()? else {
            return Ok(Answer::Won);
        };
        if standing == Standing::Lost {
            return Ok(Answer::Lost);
        }
        while let Some(node) = self.waiting.pop_front() {
            self.nodes[node].is_waiting = false;
            if let Some(reason) = watch.look(&self.counters()) {
                return Ok(Answer::Stopped(reason));
            }
            if self.matters(node)
                && let Some(reason) = self.expand(node, watch)?
            {
                return Ok(Answer::Stopped(reason));
            }
            match self.nodes[0].standing {
                Standing::Open => {}
                Standing::Won => return Ok(Answer::Won),
                Standing::Lost => return Ok(Answer::Lost),
            }
        }
        Ok(if self.explorer.question.must_reach {
            Answer::Lost
        } else {
            Answer::Won
        })
    }

    /// Makes the node of the initial state; `None` if the goal holds in it.
    fn start(&mut self) -> Result<Option<Standing>, Failure> {
        let explorer = &mut self.explorer;
        let (words, zone, _) = explorer.symbolic.start()?;
        let place = explorer
            .places
            .at(explorer.symbolic, &explorer.question, &words)?;
        let initial = Federation::of_zone(zone.dimension(), zone.bounds());
        if initial.intersects(&place.goal) {
            return Ok(None);
        }
        let is_broken = initial.intersects(&place.broken);
        let mut cells = place.cells.iter();
        let cell = cells.find(|(_, part)| initial.intersects(part));
        let observation = cell.expect("every state has an observation").0.clone();
        let mut knowledge = Knowledge::empty(observation);
        let mut zones = vec![zone];
        explorer.symbolic.extrapolate_all(&words, &mut zones);
        for zone in &zones {
            knowledge.add(&words, zone.bounds(), zone.dimension());
        }
        self.node_of(knowledge);
        Ok(Some(if is_broken {
            Standing::Lost
        } else {
            Standing::Open
        }))
    }

    fn node_of(&mut self, knowledge: Knowledge) -> usize {
        let hash = knowledge.hash();
        let same = self.known.entry(hash).or_default();
        let found = same
            .iter()
            .copied()
            .find(|&node| self.nodes[node].knowledge.is_same(&knowledge));
        if let Some(node) = found {
            return node;
        }
        let node = self.nodes.len();
        same.push(node);
        self.zones += knowledge.zone_count() as u64;
        self.bytes += 160 + knowledge.bytes();
        self.nodes.push(Node {
            knowledge,
            standing: Standing::Open,
            is_expanded: false,
            is_waiting: true,
            choices: Vec::new(),
            won_by: None,
            comes_from: Vec::new(),
        });
        self.waiting.push_back(node);
        node
    }

    /// Whether the answer may hang on an open node: some choice of an open node that is not lost leads to it.
    fn matters(&self, node: usize) -> bool {
        let one = &self.nodes[node];
        if one.is_expanded || one.standing != Standing::Open {
            return false;
        }
        node == 0
            || one.comes_from.iter().any(|&choice| {
                let choice = &self.choices[choice];
                !choice.is_lost && self.nodes[choice.source].standing == Standing::Open
            })
    }

    /// Computes the choices of a node.
    fn expand(
        &mut self,
        node: usize,
        watch: &mut dyn Watch,
    ) -> Result<Option<StopReason>, Failure> {
        self.nodes[node].is_expanded = true;
        let mut offers = Vec::new();
        let mut actions = vec![Action::Wait];
        let mut next = 0;
        while let Some(&action) = actions.get(next) {
            next += 1;
            let counters = self.counters();
            let mut looks = 0;
            let mut look = |entries: usize, bytes: usize| {
                looks += 1;
                if looks % STATES_BETWEEN_LOOKS != 0 {
                    return None;
                }
                watch.look(&Counters {
                    stored: counters.stored + entries as u64,
                    bytes: counters.bytes.max(bytes as u64) + 64 * entries as u64,
                    ..counters
                })
            };
            let knowledge = &self.nodes[node].knowledge;
            let outcome = self
                .explorer
                .outcome(knowledge, action, &mut offers, &mut look)?;
            if action == Action::Wait {
                actions.append(&mut offers);
            }
            let (exits, is_lost) = match outcome {
                Outcome::Stopped(reason) => return Ok(Some(reason)),
                Outcome::Lost => (Vec::new(), true),
                Outcome::Next(exits) => (exits, false),
            };
            self.add_choice(node, action, exits, is_lost);
            if self.nodes[node].standing == Standing::Won {
                return Ok(None);
            }
        }
        self.lose_if_hopeless(node);
        Ok(None)
    }

    fn add_choice(&mut self, source: usize, action: Action, exits: Vec<Knowledge>, is_lost: bool) {
        let choice = self.choices.len();
        let targets: Vec<usize> = exits.into_iter().map(|one| self.node_of(one)).collect();
        let is_won = |&&target: &&usize| self.nodes[target].standing == Standing::Won;
        let open = targets.len() - targets.iter().filter(is_won).count();
        let meets_lost = |&target: &usize| self.nodes[target].standing == Standing::Lost;
        let is_lost = is_lost || targets.iter().any(meets_lost);
        for &target in &targets {
            let node = &mut self.nodes[target];
            node.comes_from.push(choice);
            let has_place = node.is_expanded || node.is_waiting;
            if !has_place && node.standing == Standing::Open {
                node.is_waiting = true;
                self.waiting.push_back(target);
            }
        }
        self.bytes += 80 + 16 * targets.len();
        self.choices.push(Choice {
            source,
            action,
            targets,
            open,
            is_lost,
        });
        self.nodes[source].choices.push(choice);
        if open == 0 && !is_lost {
            self.win(choice);
        }
    }

    /// Spreads that the source of a choice is won.
    fn win(&mut self, choice: usize) {
        let mut won = vec![choice];
        while let Some(choice) = won.pop() {
            let source = self.choices[choice].source;
            let node = &mut self.nodes[source];
            if node.standing != Standing::Open {
                continue;
            }
            node.standing = Standing::Won;
            node.won_by = Some(choice);
            for &before in &node.comes_from {
                let before_choice = &mut self.choices[before];
                before_choice.open -= 1;
                if before_choice.open == 0 && !before_choice.is_lost {
                    won.push(before);
                }
            }
        }
    }

    /// Spreads that a node is lost, if none of its choices is left. All of them must be known.
    fn lose_if_hopeless(&mut self, node: usize) {
        let mut suspects = vec![node];
        while let Some(suspect) = suspects.pop() {
            let node = &self.nodes[suspect];
            let is_hopeless = node.is_expanded
                && node.standing == Standing::Open
                && node
                    .choices
                    .iter()
                    .all(|&choice| self.choices[choice].is_lost);
            if !is_hopeless {
                continue;
            }
            self.nodes[suspect].standing = Standing::Lost;
            for index in 0..self.nodes[suspect].comes_from.len() {
                let choice = &mut self.choices[self.nodes[suspect].comes_from[index]];
                choice.is_lost = true;
                suspects.push(choice.source);
            }
        }
    }

    /// The strategy of the controller, who has won.
    pub fn machine(&self) -> Machine {
        let mut machine = Machine { states: Vec::new() };
        if self.nodes.is_empty() {
            return machine;
        }
        let mut numbers = FxHashMap::default();
        numbers.insert(0, 0);
        let mut order = vec![0];
        let mut next = 0;
        while let Some(&node) = order.get(next) {
            next += 1;
            let choice = &self.choices[self.chosen(node)];
            let mut following = Vec::new();
            for &target in &choice.targets {
                let number = *numbers.entry(target).or_insert_with(|| {
                    order.push(target);
                    order.len() - 1
                });
                let observation = self.nodes[target].knowledge.observation.clone();
                following.push((observation, number));
            }
            machine.states.push(MachineState {
                knowledge: self.nodes[node].knowledge.clone(),
                action: choice.action,
                next: following,
            });
        }
        machine
    }

    /// The choice of a node that is not lost: the one by which it was won, else the first that is not lost.
    fn chosen(&self, node: usize) -> usize {
        let node = &self.nodes[node];
        let is_left = |choice: &&usize| !self.choices[**choice].is_lost;
        let chosen = node.won_by.or(node.choices.iter().find(is_left).copied());
        chosen.expect("a node that is not lost has a choice")
    }
}
