//! Fresh runs under a shield: in how many of them it does not keep what it must.

use std::ops::Range;
use std::sync::Arc;

use super::options::Manner;
use super::strategy::{Barrier, Shield};
use crate::ir::Path;
use crate::stochastic::statistics::{Interval, Method, clopper_pearson};
use crate::stochastic::{
    Behaviour, Estimate, Failure, Fence as _, RunId, Runner, Scouts, StepEnd, runs_by,
};

/// The numbers of the runs: none of them was made for the shield.
const RUNS: Range<u64> = (1 << 41)..(1 << 41) + 1_000;

/// A run ends after so many choices.
pub const CHOICES: usize = 100;

/// Makes runs in which each choice is one of the moves that are allowed, all as likely; estimates
/// how likely it is that what must be kept is broken. `None` if it was ended before the first one.
///
/// # Errors
/// A run failed.
pub fn trial(
    behaviour: Behaviour<'_>,
    shield: &Arc<Shield>,
    keep: &Path,
    manner: Manner,
    alpha: f64,
    ends: impl FnMut(u64) -> bool,
) -> Result<Option<Estimate>, Failure> {
    let behaviour = Behaviour {
        guidance: Some(&Scouts),
        ..behaviour
    };
    let mut runners = Runner::several(behaviour, manner.threads);
    let barrier = Barrier::new(shield, &runners[0].moves_of_controller());
    let seed = manner.seed;
    let (mut runs, mut broken) = (0, 0);
    let is_complete = runs_by(
        &mut runners,
        RUNS,
        |runner, run| is_broken(runner, RunId { seed, run }, &barrier, keep),
        |is_broken| {
            runs += 1;
            broken += u64::from(is_broken);
        },
        ends,
    )?;
    if runs == 0 {
        return Ok(None);
    }
    let Interval { lower, upper } = clopper_pearson(broken, runs, alpha);
    Ok(Some(Estimate {
        value: broken as f64 / runs as f64,
        lower,
        upper,
        confidence: 1.0 - alpha,
        method: Method::ClopperPearson,
        runs,
        satisfied_runs: Some(broken),
        decision: None,
        compared: None,
        is_complete,
    }))
}

/// Whether a run breaks what must be kept.
fn is_broken(
    runner: &mut Runner<'_>,
    id: RunId,
    barrier: &Barrier,
    keep: &Path,
) -> Result<bool, Failure> {
    runner.begin_steps(id)?;
    let mut first = None;
    for _ in 0..CHOICES {
        match runner.step(first, keep)? {
            StepEnd::Broken => return Ok(true),
            StepEnd::Never | StepEnd::Stuck => return Ok(false),
            StepEnd::Choice => {}
        }
        let mut moves = runner.enabled_moves()?;
        let mut view = runner.view();
        barrier.keep_allowed(&view, &mut moves);
        let drawn = view.stream().below(moves.len() as u32) as usize;
        first = Some(moves[drawn]);
    }
    Ok(false)
}
