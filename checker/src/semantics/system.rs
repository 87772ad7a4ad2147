//! A whole model: the order in which its parts are checked, what concerns all processes, and the
//! finished network.

use super::Reading;
use super::checker::Checker;
use super::codes;
use super::layout::{Relocation, chance_words};
use super::offsets::state_offset;
use super::scope::{Entity, Scope};
use super::typed::Expr;
use super::types::Memory;
use crate::diagnostics::{Diagnostic, Span};
use crate::ir::{AssignedValue, Chances, Clock, ClockAtom, Features, Location, Network};
use crate::syntax::ast::{Declaration, Document, SystemItem, UnsupportedPart};

impl Checker<'_> {
    /// Checks and lowers a model. Returns what its provisional offsets of words stand for.
    pub(super) fn document(&mut self, document: &Document, prelude: &[Declaration]) -> Relocation {
        self.world.network.clocks.push(Clock {
            name: String::from("0"),
            owner: None,
            hybrid: false,
            coordinates: Vec::new(),
        });
        self.world.network.initial_clocks.push(0);
        if self.reading == Reading::Stochastic {
            self.world.initial = vec![0; chance_words::COUNT as usize];
            self.world.network.chances = Chances {
                stream: chance_words::STREAM,
                result: chance_words::RESULT,
                ahead: chance_words::AHEAD,
                signature: chance_words::SIGNATURE,
                clocks: Vec::new(),
            };
        }
        self.declarations(prelude);
        self.scopes.push(Scope::default());
        self.declarations(&document.declarations);
        for (i, template) in document.templates.iter().enumerate() {
            self.declare(&template.name, Entity::Template(i));
        }
        self.charts(document);
        self.scopes.push(Scope::default());
        self.system_is_open = true;
        self.system(document);
        self.whole_system(document);
        self.spawned_writes();
        let relocation = self.finish();
        self.hooks();
        self.world.query_scopes = std::mem::take(&mut self.scopes);
        relocation
    }

    /// Declares the live sequence charts: they observe the system, and are left out.
    fn charts(&mut self, document: &Document) {
        for construct in &document.unsupported {
            let UnsupportedPart::Chart(name) = &construct.part else {
                continue;
            };
            if !name.text.is_empty() {
                self.declare(name, Entity::Chart);
            }
            self.report(
                Diagnostic::new(
                    codes::CHART_IGNORED,
                    construct.span,
                    format!("the {} is left out", construct.text),
                )
                .note("charts observe a system and do not change it; `sat:` queries are not supported")
                .help("do nothing for other queries"),
            );
        }
    }

    /// Priorities, hooks and progress measures.
    fn whole_system(&mut self, document: &Document) {
        let in_system = document.system.items.iter().filter_map(|item| match item {
            SystemItem::Declaration(declaration) => Some(declaration),
            SystemItem::Instantiation { .. } => None,
        });
        let mut has_priorities = false;
        for declaration in document.declarations.iter().chain(in_system) {
            match declaration {
                Declaration::ChannelPriority { levels, span } => {
                    if std::mem::replace(&mut has_priorities, true) {
                        self.declared_again(*span, "chan priority");
                    }
                    self.channel_priorities(levels);
                }
                Declaration::BeforeUpdate(exprs, span) => {
                    self.locals.clear();
                    let update = self.update(exprs, &[], "before_update");
                    if self.world.network.before_update.replace(update).is_some() {
                        self.declared_again(*span, "before_update");
                    }
                }
                Declaration::AfterUpdate(exprs, span) => {
                    self.locals.clear();
                    let update = self.update(exprs, &[], "after_update");
                    if self.world.network.after_update.replace(update).is_some() {
                        self.declared_again(*span, "after_update");
                    }
                }
                _ => {}
            }
        }
        self.locals.clear();
        for measure in &document.system.progress {
            let measure = self.expression(measure);
            self.expect_pure(&measure, "a progress measure");
            self.expect_integer(&measure, "a progress measure");
        }
    }

    fn declared_again(&mut self, span: Span, what: &str) {
        self.error(
            codes::NAME_DECLARED_TWICE,
            span,
            format!("{what} is declared twice"),
            "join the two declarations",
        );
    }

    fn channel_priorities(&mut self, levels: &[Vec<Option<crate::syntax::ast::Expr>>]) {
        self.world.network.features.priorities = true;
        // Without `default`, unlisted channels and internal edges come below all others.
        let default = levels
            .iter()
            .position(|level| level.iter().any(Option::is_none));
        let shift = u32::from(default.is_none());
        let default = default.map_or(0, |level| level as u32);
        self.world.network.features.default_priority = default;
        for channel in &mut self.world.network.channels {
            channel.priority = default;
        }
        let mut listed = vec![false; self.world.network.channels.len()];
        for (level, channels) in levels.iter().enumerate() {
            for channel in channels.iter().flatten() {
                let expr = self.expression(channel);
                let Some((first, count)) = self.channel_range(&expr) else {
                    continue;
                };
                for i in first..first + count {
                    if std::mem::replace(&mut listed[i as usize], true) {
                        self.error(
                            codes::PRIORITY_TWICE,
                            expr.span,
                            "this channel has a priority already",
                            "list every channel once",
                        );
                        break;
                    }
                    self.world.network.channels[i as usize].priority = level as u32 + shift;
                }
            }
        }
    }

    /// The channels that an expression means, all known.
    fn channel_range(&mut self, expr: &Expr) -> Option<(u32, u32)> {
        if expr.is_error() {
            return None;
        }
        let known = state_offset(expr, Memory::Channels).filter(|_| expr.ty.size().channels > 0);
        if known.is_none() {
            self.error(
                codes::CHANNEL_EXPECTED,
                expr.span,
                "a channel that is known when the model is loaded is needed here",
                "name a channel, an array of channels, or a part with a constant index",
            );
        }
        known.map(|first| (first, expr.ty.size().channels))
    }

    /// Puts the parts of the state into their final order and sums up what the model uses.
    fn finish(&mut self) -> Relocation {
        let network = &self.world.network;
        let relocation = Relocation {
            locations: network.processes.len() as u32,
            variables: self.world.initial.len() as u32,
        };
        if !self.can_lower() {
            return relocation;
        }
        for (name, span) in std::mem::take(&mut self.hybrid_clocks) {
            self.report(
                Diagnostic::new(
                    codes::HYBRID_CLOCK_IGNORED,
                    span,
                    format!("the hybrid clock '{name}' is ignored in symbolic and game queries"),
                )
                .note("its rates and assignments have no effect there; nothing that a query sees depends on it")
                .help("use an ordinary clock if it matters"),
            );
        }
        self.report_left_out();
        let network = &mut self.world.network;
        network.initial = network
            .processes
            .iter()
            .map(|p| p.initial.0 as i32)
            .collect();
        network.initial.append(&mut self.world.initial);
        network.layout.identity_words = network.initial.len() as u32;
        network.initial.append(&mut self.world.initial_meta);
        network.layout.words = network.initial.len() as u32;
        relocation.network(network);
        let features = features(network);
        network.features = features;
        relocation
    }
}

/// What a network uses.
fn features(network: &Network) -> Features {
    let (edges, locations) = (|| network.edges(), || network.locations());
    let atoms = || {
        let guards = edges().map(|edge| &edge.guard);
        let invariants = locations().map(|location| &location.invariant);
        guards.chain(invariants).flat_map(|guard| &guard.atoms)
    };
    let synchronises = |with: fn(&crate::ir::Channel, bool) -> bool| {
        edges().any(|edge| {
            edge.sync.is_some_and(|sync| {
                let mut channels = sync.channels().map(|one| &network.channels[one as usize]);
                !edge.guard.atoms.is_empty() && channels.any(|one| with(one, sync.send))
            })
        })
    };
    let mut levels = network.processes.iter().map(|process| process.priority);
    Features {
        priorities: network.features.priorities || levels.any(|level| level > 0),
        default_priority: network.features.default_priority,
        diagonals: atoms().any(ClockAtom::is_difference),
        stopwatches: locations().any(|location: &Location| !location.rates.is_empty()),
        strict_invariants: locations()
            .flat_map(|location| &location.invariant.atoms)
            .any(ClockAtom::is_strict_upper),
        guarded_receivers: synchronises(|channel, send| channel.broadcast && !send),
        clock_guarded_urgent: synchronises(|channel, _| channel.urgent),
        clock_copies: network.updates().any(|update| {
            let mut values = update
                .assignments
                .iter()
                .map(|assignment| &assignment.value);
            values.any(|value| matches!(value, AssignedValue::Clock(..)))
        }),
        doubles: network
            .layout
            .variables
            .iter()
            .any(|variable| has_double(&variable.shape)),
        hybrid_clocks: network.clocks.iter().any(|clock| clock.hybrid),
        uncontrollable: edges().any(|edge| !edge.controllable),
        legs: edges().any(|edge| edge.leg.is_some()),
    }
}

fn has_double(shape: &crate::ir::Shape) -> bool {
    match shape {
        crate::ir::Shape::Double => true,
        crate::ir::Shape::Array { part, .. } => has_double(part),
        crate::ir::Shape::Struct(fields) => fields.iter().any(|(_, shape)| has_double(shape)),
        _ => false,
    }
}
