//! An on-the-fly algorithm that finds the winner of the game on knowledge sets.
//!
//! From a knowledge set the controller chooses an action, and the environment one of the knowledge
//! sets to which it leads. A set is won if it has an action all of whose sets are won. It is lost
//! if each action is lost or leads to a lost set. Both spread backwards as soon as they are known.
//! When everything that matters is explored, some sets may still be open. They are lost if the goal
//! must be reached, since play could go from one observation to the next for ever; they are won if
//! it is enough to keep.
//!
//! Sets are explored breadth first, and only where the answer can still depend on them. Equal sets
//! share one node. If the controller wins from a set, it wins from the subsets in the same way; if
//! it loses from a set, it loses from every set that contains it. So
//! * a set is replaced by a won set that contains it, or by a lost set that it contains;
//! * a set is *covered* by an open set, and is not explored. If it is enough to keep, the open set
//!   must contain it; if the goal must be reached, it must contain the open set. As long as the
//!   open set is not lost (or not won), neither is the covered set. A set that covers another is
//!   not covered itself.
//!
//! Sources: X. Liu, S. Smolka, "Simple linear-time algorithms for minimal fixed points", ICALP
//! 1998, in both directions; M. De Wulf, L. Doyen, J.-F. Raskin, "A Lattice Theory for Solving
//! Games of Imperfect Information", HSCC 2006 (antichains of knowledge sets).

use std::collections::VecDeque;

use rustc_hash::FxHashMap;

use crate::network::{Failure, Symbolic};
use crate::search::limits::{Counters, StopReason, Watch};
use crate::zones::Federation;

use super::class::{Consequence, Explorer};
use super::knowledge::{Knowledge, Observation};
use super::machine::{Action, Machine, MachineState, Question};
use super::place::Places;

/// The number of symbolic states inside an observation between two checks of the limits. Limits are
/// also checked after each knowledge set.
const STATES_BETWEEN_LOOKS: usize = 64;

/// The winner.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Outcome {
    /// The controller.
    Won,
    /// The environment.
    Lost,
    /// A limit was reached first.
    Stopped(StopReason),
}

/// What is known about a knowledge set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Decided {
    Open,
    Won,
    Lost,
}

struct KnowledgeNode {
    knowledge: Knowledge,
    /// See [`Knowledge::signature`].
    signature: u64,
    standing: Decided,
    is_expanded: bool,
    /// Whether all of its choices are known.
    is_complete: bool,
    /// Whether it is in the worklist.
    is_waiting: bool,
    /// Its choices, in the order in which the controller prefers them.
    choices: Vec<usize>,
    /// The choice with which it was found to be won.
    won_by: Option<usize>,
    /// The choices that lead to it.
    comes_from: Vec<usize>,
    /// The node that covers it, or that decided it.
    cover: Option<usize>,
    /// The open nodes that it covers.
    covered: Vec<usize>,
}

/// How a knowledge set relates to the known ones.
enum Relation {
    /// This node has the same set, or a set that decides who wins from this one.
    Of(usize),
    /// This node covers it.
    Under(usize),
    /// The set must be explored.
    New,
}

/// An action in a knowledge set.
struct Choice {
    source: usize,
    action: Action,
    targets: Vec<usize>,
    /// How many targets are not won yet.
    open: usize,
    is_lost: bool,
}

/// The game on knowledge sets.
pub struct Solver<'e, 'a, 'q> {
    explorer: Explorer<'e, 'a, 'q>,
    nodes: Vec<KnowledgeNode>,
    choices: Vec<Choice>,
    /// The nodes with this hash.
    known: FxHashMap<u64, Vec<usize>>,
    /// The nodes with this observation.
    alike: FxHashMap<Observation, Vec<usize>>,
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
            alike: FxHashMap::default(),
            waiting: VecDeque::new(),
            bytes: 0,
            zones: 0,
        }
    }

    /// The work until now: symbolic states inside observations are explored, zones of knowledge
    /// sets are stored.
    pub fn counters(&self) -> Counters {
        Counters {
            explored: self.explorer.explored,
            stored: self.zones,
            waiting: self.waiting.len() as u64,
            bytes: (self.bytes + self.explorer.places.bytes()) as u64,
        }
    }

    /// Solves the game.
    pub fn solve(&mut self, watch: &mut dyn Watch) -> Result<Outcome, Failure> {
        let Some(standing) = self.start()? else {
            return Ok(Outcome::Won);
        };
        if standing == Decided::Lost {
            return Ok(Outcome::Lost);
        }
        while let Some(node) = self.waiting.pop_front() {
            self.nodes[node].is_waiting = false;
            if let Some(reason) = watch.look(&self.counters()) {
                return Ok(Outcome::Stopped(reason));
            }
            if self.matters(node)
                && let Some(reason) = self.expand(node, watch)?
            {
                return Ok(Outcome::Stopped(reason));
            }
            match self.nodes[0].standing {
                Decided::Open => {}
                Decided::Won => return Ok(Outcome::Won),
                Decided::Lost => return Ok(Outcome::Lost),
            }
        }
        Ok(if self.explorer.question.must_reach {
            Outcome::Lost
        } else {
            Outcome::Won
        })
    }

    /// Makes the node of the initial state; `None` if the goal holds in it.
    fn start(&mut self) -> Result<Option<Decided>, Failure> {
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
        let initial = self.node_of(knowledge);
        self.wait_for(initial);
        Ok(Some(if is_broken {
            Decided::Lost
        } else {
            Decided::Open
        }))
    }

    fn node_of(&mut self, knowledge: Knowledge) -> usize {
        let hash = knowledge.hash();
        let mut same = self.known.get(&hash).into_iter().flatten().copied();
        if let Some(node) = same.find(|&node| self.nodes[node].knowledge.is_same(&knowledge)) {
            return node;
        }
        let signature = knowledge.signature();
        let cover = match self.place_of(&knowledge, signature) {
            Relation::Of(node) => return node,
            Relation::Under(cover) => Some(cover),
            Relation::New => None,
        };
        let node = self.nodes.len();
        self.known.entry(hash).or_default().push(node);
        let alike = self.alike.entry(knowledge.observation.clone());
        alike.or_default().push(node);
        self.zones += knowledge.zone_count() as u64;
        self.bytes += 240 + knowledge.bytes();
        self.nodes.push(KnowledgeNode {
            knowledge,
            signature,
            standing: Decided::Open,
            is_expanded: false,
            is_complete: false,
            is_waiting: false,
            choices: Vec::new(),
            won_by: None,
            comes_from: Vec::new(),
            cover,
            covered: Vec::new(),
        });
        if let Some(cover) = cover {
            self.nodes[cover].covered.push(node);
        }
        node
    }

    /// How a set that no node has relates to the sets of the nodes.
    fn place_of(&self, knowledge: &Knowledge, signature: u64) -> Relation {
        let must_reach = self.explorer.question.must_reach;
        let mut place = Relation::New;
        for &node in self.alike.get(&knowledge.observation).into_iter().flatten() {
            let other = &self.nodes[node];
            let is_smaller = match other.standing {
                Decided::Won => false,
                Decided::Lost => true,
                Decided::Open if other.cover.is_none() && matches!(place, Relation::New) => {
                    must_reach
                }
                Decided::Open => continue,
            };
            let is_related = if is_smaller {
                other.signature & !signature == 0 && other.knowledge.is_subset(knowledge)
            } else {
                signature & !other.signature == 0 && knowledge.is_subset(&other.knowledge)
            };
            if is_related && other.standing != Decided::Open {
                return Relation::Of(node);
            }
            if is_related {
                place = Relation::Under(node);
            }
        }
        place
    }

    /// Puts an open node, or the node that covers it, into the worklist, unless it was there
    /// before.
    fn wait_for(&mut self, node: usize) {
        let node = self.nodes[node].cover.unwrap_or(node);
        let one = &mut self.nodes[node];
        if !one.is_expanded && !one.is_waiting && one.standing == Decided::Open {
            one.is_waiting = true;
            self.waiting.push_back(node);
        }
    }

    /// Whether the answer may depend on an open node: some choice of an open node is not lost and
    /// leads to it, or to a node that it covers.
    fn matters(&self, node: usize) -> bool {
        let one = &self.nodes[node];
        if one.is_expanded || one.standing != Decided::Open {
            return false;
        }
        let is_wanted = |node: usize| {
            let mut choices = self.nodes[node].comes_from.iter();
            choices.any(|&choice| {
                let choice = &self.choices[choice];
                !choice.is_lost && self.nodes[choice.source].standing == Decided::Open
            })
        };
        node == 0 || is_wanted(node) || one.covered.iter().any(|&node| is_wanted(node))
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
                Consequence::Stopped(reason) => return Ok(Some(reason)),
                Consequence::Lost => (Vec::new(), true),
                Consequence::Next(exits) => (exits, false),
            };
            self.add_choice(node, action, exits, is_lost);
            if self.nodes[node].standing == Decided::Won {
                return Ok(None);
            }
        }
        self.nodes[node].is_complete = true;
        if self.is_hopeless(node) {
            self.spread(node, Decided::Lost);
        }
        Ok(None)
    }

    fn add_choice(&mut self, source: usize, action: Action, exits: Vec<Knowledge>, is_lost: bool) {
        let choice = self.choices.len();
        let targets: Vec<usize> = exits.into_iter().map(|one| self.node_of(one)).collect();
        let is_won = |&&target: &&usize| self.nodes[target].standing == Decided::Won;
        let open = targets.len() - targets.iter().filter(is_won).count();
        let meets_lost = |&target: &usize| self.nodes[target].standing == Decided::Lost;
        let is_lost = is_lost || targets.iter().any(meets_lost);
        for &target in &targets {
            self.nodes[target].comes_from.push(choice);
            self.wait_for(target);
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

    /// Propagates that the source of a choice is won.
    fn win(&mut self, choice: usize) {
        let source = self.choices[choice].source;
        if self.nodes[source].standing == Decided::Open {
            self.nodes[source].won_by = Some(choice);
            self.spread(source, Decided::Won);
        }
    }

    /// Whether an open node has no choice left.
    fn is_hopeless(&self, node: usize) -> bool {
        let node = &self.nodes[node];
        node.is_complete
            && node.standing == Decided::Open
            && node
                .choices
                .iter()
                .all(|&choice| self.choices[choice].is_lost)
    }

    /// Propagates that an open node is won or lost.
    fn spread(&mut self, node: usize, standing: Decided) {
        let mut decided = vec![(node, standing)];
        while let Some((node, standing)) = decided.pop() {
            if self.nodes[node].standing != Decided::Open {
                continue;
            }
            self.nodes[node].standing = standing;
            for index in 0..self.nodes[node].comes_from.len() {
                let before = self.nodes[node].comes_from[index];
                let choice = &mut self.choices[before];
                let source = choice.source;
                if standing == Decided::Lost {
                    choice.is_lost = true;
                    if self.is_hopeless(source) {
                        decided.push((source, Decided::Lost));
                    }
                    continue;
                }
                choice.open -= 1;
                if choice.open == 0
                    && !choice.is_lost
                    && self.nodes[source].standing == Decided::Open
                {
                    self.nodes[source].won_by.get_or_insert(before);
                    decided.push((source, Decided::Won));
                }
            }
            let covered = std::mem::take(&mut self.nodes[node].covered);
            let is_decisive = (standing == Decided::Lost) == self.explorer.question.must_reach;
            for one in covered {
                if is_decisive {
                    decided.push((one, standing));
                } else if let Some(decision) = self.uncover(one) {
                    decided.push(decision);
                }
            }
        }
    }

    /// Searches for another node that covers or decides an open node, because its cover no longer
    /// covers it.
    fn uncover(&mut self, node: usize) -> Option<(usize, Decided)> {
        // Since it had a cover, it covers no other node, and `place_of` cannot find the node
        // itself.
        let one = &self.nodes[node];
        match self.place_of(&one.knowledge, one.signature) {
            Relation::Of(other) => {
                self.nodes[node].cover = Some(other);
                return Some((node, self.nodes[other].standing));
            }
            Relation::Under(cover) => {
                self.nodes[node].cover = Some(cover);
                self.nodes[cover].covered.push(node);
            }
            Relation::New => self.nodes[node].cover = None,
        }
        self.wait_for(node);
        None
    }

    /// The strategy of the controller, who must have won.
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
                let target = self.played_as(target);
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

    /// The node whose choices the controller follows in a node that is not lost.
    fn played_as(&self, node: usize) -> usize {
        let mut node = node;
        while self.nodes[node].won_by.is_none()
            && let Some(cover) = self.nodes[node].cover
        {
            node = cover;
        }
        node
    }

    /// The choice in a node that is not lost and has choices of its own: the choice that won it, or
    /// the first one that is not lost.
    fn chosen(&self, node: usize) -> usize {
        let node = &self.nodes[node];
        let is_left = |choice: &&usize| !self.choices[**choice].is_lost;
        let chosen = node.won_by.or(node.choices.iter().find(is_left).copied());
        chosen.expect("a node that is not lost has a choice")
    }
}
