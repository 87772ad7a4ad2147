//! The decisions of a learned strategy in a discrete state, by clock values.
//!
//! They allow all that random runs do under the strategy ([`crate::stochastic`], `control`):
//! * If it sees a clock, it is asked at once and at every cut. In each cell the best of the actions
//!   that are possible are allowed. Where a move is among the best and to wait is not, no time
//!   passes.
//! * If it sees none, delays are drawn. Time may pass wherever the model lets it, and after any
//!   delay the best actions are allowed.
//! * Where it has never seen the exact values, or none of the actions, everything is allowed. If
//!   delays are drawn from there on, they may end anywhere behind.
//!
//! Within another strategy, only what that allows is possible.

use rustc_hash::FxHashMap;

use super::cells::cells;
use super::scene::Scene;
use super::sight::SymbolicSight;
use crate::game::strategy::Decision;
use crate::game::strategy::closed_loop::ClosedLoop;
use crate::ir::{Network, Part};
use crate::learning::strategy::{LearnedStrategy, Regressor};
use crate::network::{self, Symbolic};
use crate::stochastic;
use crate::zones::{ClockSet, Federation, Zone, instants};

/// Why the decisions of a state are not known.
#[derive(Clone, Copy, Debug)]
pub enum Broken {
    /// A move of the state fails.
    Move(network::Failure),
    /// What the strategy sees of it has no value.
    Feature(stochastic::Failure),
}

impl From<network::Failure> for Broken {
    fn from(failure: network::Failure) -> Broken {
        Broken::Move(failure)
    }
}

impl From<stochastic::Failure> for Broken {
    fn from(failure: stochastic::Failure) -> Broken {
        Broken::Feature(failure)
    }
}

/// Finds the decisions of discrete states.
pub(super) struct Deciding<'a> {
    symbolic: Symbolic<'a>,
    pub(super) sight: SymbolicSight<'a>,
    strategy: &'a LearnedStrategy,
    under: Option<&'a ClosedLoop>,
    /// The actions by their moves.
    actions: FxHashMap<Part, u32>,
    /// By exact values: what is known there.
    regressors: FxHashMap<&'a [i32], &'a Regressor>,
}

/// What is allowed, by clock values.
struct Plan {
    /// For each entry of the scene.
    moves: Vec<Federation>,
    waits: Federation,
}

/// An action that is known: an entry of the scene, or to wait.
#[derive(Clone, Copy)]
struct Known {
    entry: Option<usize>,
    value: f64,
}

/// What is best in the parts of a cell.
struct Ranked {
    best: Plan,
    /// Where none of the actions is known.
    unknown: Federation,
}

impl<'a> Deciding<'a> {
    /// The symbolic states are those of the model without any strategy.
    pub(super) fn new(
        strategy: &'a LearnedStrategy,
        symbolic: Symbolic<'a>,
        sight: SymbolicSight<'a>,
        under: Option<&'a ClosedLoop>,
    ) -> Deciding<'a> {
        let actions = strategy.moves.iter().copied().zip(0..);
        let regressors = strategy.regressors.iter();
        Deciding {
            symbolic,
            sight,
            strategy,
            under,
            actions: actions.collect(),
            regressors: regressors.map(|one| (&one.key[..], one)).collect(),
        }
    }

    pub(super) fn network(&self) -> &'a Network {
        self.symbolic.stepper.network()
    }

    /// The decisions in the state with these words; none where everything is allowed.
    pub(super) fn decisions(&mut self, words: &[i32]) -> Result<Vec<Decision>, Broken> {
        let mut words = words.to_vec();
        let scene = Scene::new(&mut self.symbolic, self.under, &mut words)?;
        let Some(scene) = scene else {
            return Ok(Vec::new());
        };
        let (key, point) = self.sight.look(&words)?;
        let known = self.regressors.get(key).copied();
        let plan = match known {
            Some(regressor) => self.plan(&scene, regressor, &point),
            None if self.under.is_none() => return Ok(Vec::new()),
            None => everything(&scene),
        };
        Ok(decisions(scene, plan))
    }

    /// What is allowed where the exact values are known.
    fn plan(&self, scene: &Scene, regressor: &Regressor, point: &[f64]) -> Plan {
        let tree = |action: Option<u32>| {
            let known = regressor.appraisals.iter();
            let mut known = known.filter(|one| Some(one.action) == action);
            known.next().map(|one| &one.tree[..])
        };
        let entries = scene.entries.iter().enumerate();
        let entries = entries.filter_map(|(entry, one)| {
            let tree = tree(self.actions.get(&one.part).copied())?;
            Some((Some(entry), tree))
        });
        let wait = tree(Some(self.strategy.moves.len() as u32));
        let (targets, trees): (Vec<Option<usize>>, Vec<_>) =
            entries.chain(wait.map(|tree| (None, tree))).unzip();
        let measured = &self.sight.continuous;
        let mut all = Plan::empty(scene);
        let (mut acts, mut unknown) = (all.waits.clone(), all.waits.clone());
        let mut closed_waits = all.waits.clone();
        for cell in cells(&trees, measured, point) {
            let sign = if self.strategy.is_greatest { -1.0 } else { 1.0 };
            let values = targets.iter().zip(&cell.values);
            let known = values.map(|(&entry, value)| Known {
                entry,
                value: sign * value,
            });
            let known: Vec<Known> = known.collect();
            let closed = ranked(scene, cell.part(&scene.whole, measured, true), &known);
            for (all, more) in all.moves.iter_mut().zip(&closed.best.moves) {
                all.unite(more);
            }
            closed_waits.unite(&closed.best.waits);
            unknown.unite(&closed.unknown);
            let open = ranked(scene, cell.part(&scene.whole, measured, false), &known);
            for moves in &open.best.moves {
                acts.unite(moves);
            }
            all.waits.unite(&open.best.waits);
        }
        let stops = acts.minus(&all.waits);
        let at_cuts = closed_waits.minus(&instants::before(&stops, &ClockSet::EMPTY));
        all.waits.unite(&at_cuts);
        all.add_unknown(scene, &unknown);
        if !self.strategy.observation.has_clocks() {
            all.waits.clone_from(&scene.may_wait);
        }
        all
    }
}

impl Plan {
    fn empty(scene: &Scene) -> Plan {
        let nothing = Federation::empty(scene.whole.dimension());
        Plan {
            moves: vec![nothing.clone(); scene.entries.len()],
            waits: nothing,
        }
    }

    /// Allows everything where none of the actions is known. A delay that is drawn there may end
    /// anywhere behind.
    fn add_unknown(&mut self, scene: &Scene, unknown: &Federation) {
        let mut drawn = Federation::empty(unknown.dimension());
        for (moves, entry) in self.moves.iter_mut().zip(&scene.entries) {
            let part = entry.region.intersection(unknown);
            drawn.unite(&part);
            moves.unite(&part);
        }
        self.waits.unite(&unknown.intersection(&scene.may_wait));
        for zone in drawn.intersection(&scene.may_wait).to_zones() {
            let behind = behind(&zone);
            let mut waits = scene.may_wait.clone();
            waits.intersect_zone(behind.bounds());
            self.waits.unite(&waits);
        }
    }
}

/// All that has no clock below the least of a zone. It contains all that time leads to from there,
/// and compares no two clocks.
fn behind(zone: &Zone) -> Zone {
    let mut behind = Zone::universe(zone.dimension());
    for clock in 1..zone.dimension() {
        behind.constrain(0, clock, zone.bound(0, clock));
    }
    behind
}

/// All that is possible.
fn everything(scene: &Scene) -> Plan {
    Plan {
        moves: scene.entries.iter().map(|one| one.region.clone()).collect(),
        waits: scene.may_wait.clone(),
    }
}

/// The best of the actions that are possible, for each part of a cell: the least value.
fn ranked(scene: &Scene, cell: Federation, known: &[Known]) -> Ranked {
    let mut best = Plan::empty(scene);
    let mut rest = cell;
    let mut order = known.to_vec();
    order.sort_by(|one, other| one.value.total_cmp(&other.value));
    for group in order.chunk_by(|one, other| one.value.total_cmp(&other.value).is_eq()) {
        let mut taken = Federation::empty(rest.dimension());
        for one in group {
            if let Some(entry) = one.entry {
                let region = &scene.entries[entry].region;
                best.moves[entry].unite(&rest.intersection(region));
                taken.unite(region);
            } else {
                best.waits.unite(&rest.intersection(&scene.may_wait));
                taken.unite(&scene.surely);
            }
        }
        rest.subtract(&taken);
    }
    Ranked {
        best,
        unknown: rest,
    }
}

/// The decisions of a plan.
fn decisions(scene: Scene, plan: Plan) -> Vec<Decision> {
    let mut decisions = Vec::new();
    let mut decide = |mut zones: Federation, action: Option<Vec<Part>>| {
        zones.merge();
        if !zones.is_empty() {
            decisions.push(Decision {
                zones,
                action,
                rank: 0,
            });
        }
    };
    for (entry, allowed) in scene.entries.into_iter().zip(plan.moves) {
        for (parts, region) in entry.moves {
            decide(region.intersection(&allowed), Some(parts));
        }
    }
    decide(plan.waits, None);
    decisions
}
