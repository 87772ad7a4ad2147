//! Queries for shields, `acontrol: A[] p {…}`: their static rules, and lowering.

use super::checker::Checker;
use super::codes;
use crate::diagnostics::Span;
use crate::ir::{Axis, Feature, Path, ProcessId, Seen, Shield};
use crate::syntax::ast;

/// The most cells of an axis: each has a number of 32 bits.
const MOST_CELLS: f64 = 4_000_000_000.0;

impl Checker<'_> {
    /// Checks and lowers a query for a shield.
    pub(super) fn shield(&mut self, asked: &ast::Shield, query: &ast::Query) -> Option<Shield> {
        self.refuse_priorities(query.span)?;
        if let Some(under) = &query.under {
            self.error(
                codes::QUERY_UNSUPPORTED,
                under.span,
                "a shield is made for all that the controller can do, so it has no `under`",
                "leave `under` out, and put what must hold, too, into the condition behind A[]",
            );
        }
        if query.strategy.is_none() {
            self.error(
                codes::STRATEGY_WITHOUT_NAME,
                query.span,
                "a shield needs a name",
                "write strategy S = acontrol: …, and ask later queries under S",
            );
        }
        let keep = self.state_condition(&asked.invariant).map(Path::Always);
        let axes: Vec<Option<Axis>> = asked.axes.iter().map(|one| self.axis(one)).collect();
        let axes: Vec<Axis> = axes.into_iter().collect::<Option<_>>()?;
        self.refuse_repetition(&axes, &asked.axes);
        self.warn_without_choice(query.span);
        Some(Shield { keep: keep?, axes })
    }

    fn axis(&mut self, asked: &ast::ShieldAxis) -> Option<Axis> {
        let feature = self.feature(&asked.place, false)?;
        match feature.seen {
            Seen::Computed(_) => self.bad_axis(
                asked.place.span,
                "cells are made of variables, and this is none",
                "name an integer, a double, a clock, or P.location; put what is computed into a variable of its own",
            ),
            Seen::Location(process) => self.axis_of_locations(asked, feature, process),
            Seen::Integer(_) => self.axis_of_integers(asked, feature),
            Seen::Double(_) | Seen::Clock(_) => self.axis_of_cells(asked, feature),
        }
    }

    fn axis_of_locations(
        &mut self,
        asked: &ast::ShieldAxis,
        feature: Feature,
        ProcessId(process): ProcessId,
    ) -> Option<Axis> {
        if asked.bounds.is_some() || asked.cells.is_some() {
            return self.bad_axis(
                asked.span,
                "each location is a cell of its own, so there are no bounds here",
                "write P.location alone",
            );
        }
        let cells = self.world.network.processes[process as usize]
            .locations
            .len() as u32;
        Some(Axis {
            feature,
            low: 0.0,
            high: f64::from(cells) - 1.0,
            cells,
        })
    }

    fn axis_of_integers(&mut self, asked: &ast::ShieldAxis, feature: Feature) -> Option<Axis> {
        let text = &feature.text;
        if asked.cells.is_some() {
            let help = format!("write {text}[0,5] alone");
            let message = "each value of an integer is a cell of its own, so their number is known";
            return self.bad_axis(asked.span, message, &help);
        }
        let help = format!("write {text}[0,5] for the values from 0 to 5");
        let (low, high) = self.bounds_of(asked, &help)?;
        let is_integer = |value: f64| f64::from(value as i32).total_cmp(&(value + 0.0)).is_eq();
        if !is_integer(low) || !is_integer(high) {
            return self.bad_axis(asked.span, "the bounds of an integer are integers", &help);
        }
        if low > high {
            let message = format!("there is no value from {low} to {high}");
            return self.bad_axis(asked.span, &message, "write the least value first");
        }
        let cells = high - low + 1.0;
        if cells > MOST_CELLS {
            let message = format!("an axis has at most {MOST_CELLS} cells, and this has {cells}");
            return self.bad_axis(asked.span, &message, "write narrower bounds");
        }
        Some(Axis {
            feature,
            low,
            high,
            cells: cells as u32,
        })
    }

    fn axis_of_cells(&mut self, asked: &ast::ShieldAxis, feature: Feature) -> Option<Axis> {
        let help = format!(
            "write {}[0,10]:100 for 100 cells from 0 to 10",
            feature.text
        );
        let (low, high) = self.bounds_of(asked, &help)?;
        let Some(cells) = &asked.cells else {
            let message = "the number of cells is missing behind the bounds";
            return self.bad_axis(asked.span, message, &help);
        };
        let span = cells.span;
        let cells = self.known_real(cells, "a number of cells", (1.0, MOST_CELLS))?;
        if cells.fract() != 0.0 {
            let message = format!("{cells} is no number of cells");
            return self.bad_axis(span, &message, "write an integer");
        }
        if low >= high {
            let message = format!("nothing lies between {low} and {high}");
            return self.bad_axis(asked.span, &message, "write the lesser bound first");
        }
        Some(Axis {
            feature,
            low,
            high,
            cells: cells as u32,
        })
    }

    /// The bounds of an axis.
    fn bounds_of(&mut self, asked: &ast::ShieldAxis, help: &str) -> Option<(f64, f64)> {
        let Some(bounds) = &asked.bounds else {
            return self.bad_axis(asked.span, "the bounds are missing", help);
        };
        let [low, high] = &**bounds;
        let finite = (f64::MIN, f64::MAX);
        let low = self.known_real(low, "a bound of the cells", finite);
        let high = self.known_real(high, "a bound of the cells", finite);
        Some((low?, high?))
    }

    /// Refuses an axis that comes twice.
    fn refuse_repetition(&mut self, axes: &[Axis], asked: &[ast::ShieldAxis]) {
        for (number, axis) in axes.iter().enumerate() {
            let seen = axis.feature.seen;
            if axes[..number].iter().any(|one| one.feature.seen == seen) {
                let message = format!("{} is here twice", axis.feature.text);
                self.bad_axis::<()>(asked[number].span, &message, "leave one of them out");
            }
        }
    }

    fn bad_axis<T>(&mut self, span: Span, message: &str, help: &str) -> Option<T> {
        self.refused(codes::SHIELD_AXIS, span, message, help)
    }
}
