//! From the moves of a way to its states: the way is taken again, without extrapolation.

use crate::network::{Failure, Moves, Part, Permutation, Symbolic};
use crate::zones::Zone;

use super::canonical::unfold;
use super::goal::Goal;
use crate::search::outcome::{Step, Trace};

/// A step, and by what the members of the state that it is a step of differ from those of the state
/// of the trace, if they do.
type Taken = (Step, Option<Permutation>);

/// The words of a state that was entered, and its zones.
type Entered = (Vec<i32>, Vec<Zone>);

/// Takes the steps from the initial state. Where a state has several zones, the first is taken from
/// which the rest of the way is possible, up to a state that the goal confirms if there is one.
/// What cannot be computed again is the failure that the trace leads to, and is left out. Moves of
/// representatives are led back to those that they stand for.
pub(in crate::search) fn retrace(
    symbolic: &mut Symbolic<'_>,
    steps: &[Step],
    goal: Option<&mut dyn Goal>,
) -> Trace {
    let mut trace = Trace::default();
    let steps: Vec<Taken> = match symbolic.symmetry() {
        None => steps.iter().map(|&step| (step, None)).collect(),
        Some(symmetry) => {
            let steps = unfold(symmetry, steps).into_iter();
            steps
                .map(|(step, exchanged)| (step, Some(exchanged)))
                .collect()
        }
    };
    let _ = take_all(symbolic, &steps, goal, &mut trace);
    trace
}

fn take_all(
    symbolic: &mut Symbolic<'_>,
    steps: &[Taken],
    mut goal: Option<&mut dyn Goal>,
    trace: &mut Trace,
) -> Result<(), Failure> {
    let (mut words, zone, invariant) = symbolic.start()?;
    let mut zones = vec![zone];
    symbolic.let_time_pass(&mut words, &invariant, &mut zones)?;
    zones.reverse();
    let mut open = vec![(words, zones)];
    while let Some((words, zones)) = open.last_mut() {
        let Some(zone) = zones.pop() else {
            open.pop();
            continue;
        };
        let mut words = words.clone();
        trace.states.truncate(open.len() - 1);
        trace.states.push((words.clone(), zone.clone()));
        let Some(step) = steps.get(open.len() - 1) else {
            let is_end = match &mut goal {
                None => true,
                Some(goal) => goal.confirms(symbolic, &mut words, &zone)?,
            };
            if is_end {
                return Ok(());
            }
            continue;
        };
        trace.moves.truncate(open.len() - 1);
        if let Some((parts, next)) = take(symbolic, step, words, &zone)? {
            trace.moves.push(parts);
            open.push(next);
        }
    }
    Ok(())
}

/// Takes one step: the parts of the move, the words after it, and the zones that it leads to, last
/// first.
fn take(
    symbolic: &mut Symbolic<'_>,
    (step, exchanged): &Taken,
    mut words: Vec<i32>,
    zone: &Zone,
) -> Result<Option<(Vec<Part>, Entered)>, Failure> {
    let mut moves = Moves::default();
    symbolic.moves_within(&mut words, zone.bounds(), &mut moves)?;
    // The zone is within the one of the search, where extrapolation let moves look possible that
    // are not.
    let one = match exchanged {
        None => moves.with_rank(*step),
        Some(exchanged) => original(symbolic, (*step, exchanged), (&words, zone), &moves)?
            .map(|index| moves.get(index)),
    };
    let Some(one) = one else {
        return Ok(None);
    };
    let Some(effect) = symbolic.fire(one, &mut words)? else {
        return Ok(None);
    };
    let mut entries = Vec::new();
    effect.entry_zones(zone.bounds(), symbolic.dimension(), &mut entries);
    symbolic.let_time_pass(&mut words, &effect.invariant, &mut entries)?;
    // What extrapolation adds is simulated by what was there, so that the same moves are possible.
    if entries.iter().any(|zone| symbolic.has_grown(zone.bounds())) {
        symbolic.extrapolate_all(&words, &mut entries);
    }
    entries.reverse();
    Ok(Some((one.parts.to_vec(), (words, entries))))
}

/// Which of the moves of a state a step of the state with exchanged members stands for.
fn original(
    symbolic: &mut Symbolic<'_>,
    (step, exchanged): (Step, &Permutation),
    (words, zone): (&[i32], &Zone),
    moves: &Moves,
) -> Result<Option<usize>, Failure> {
    let Some(symmetry) = symbolic.symmetry().cloned() else {
        return Ok(None);
    };
    let (mut words, mut zone) = (words.to_vec(), zone.clone());
    symmetry.permute(exchanged, &mut words, zone.bounds_mut());
    let mut images = Moves::default();
    symbolic.moves_within(&mut words, zone.bounds(), &mut images)?;
    let network = symbolic.stepper.network();
    let image = images.with_rank(step);
    Ok(image.and_then(|image| symmetry.find_original(exchanged, network, moves, image)))
}
