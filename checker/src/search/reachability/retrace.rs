//! Computes the states of a path from its moves: the moves are taken again, without extrapolation.

use crate::cancellation::{self, Room};
use crate::network::{Failure, Moves, Part, Permutation, Symbolic};
use crate::zones::Zone;

use super::canonical::unfold;
use super::goal::Goal;
use crate::search::outcome::{Step, Trace};

/// The steps of the path. They are many: nothing is held beside them that is not needed.
#[derive(Clone, Copy)]
enum Path<'s> {
    /// Of states as they are.
    Same(&'s [Step]),
    /// Each with the permutation of members between its state and the state of the trace.
    Exchanged(&'s [(Step, Permutation)]),
}

impl<'s> Path<'s> {
    fn get(self, index: usize) -> Option<(Step, Option<&'s Permutation>)> {
        match self {
            Path::Same(steps) => steps.get(index).map(|&step| (step, None)),
            Path::Exchanged(steps) => steps.get(index).map(|(step, one)| (*step, Some(one))),
        }
    }
}

/// The words of a state that was entered, and its zones.
type Entered = (Vec<i32>, Vec<Zone>);

/// A state is in the trace, and among those that other ways may start from.
const STATES_AT_HAND: usize = 2;

/// What a state of the trace takes beside its words and bounds: six blocks of memory with their
/// vectors.
const BYTES_OF_A_STEP: usize = 6 * 40;

/// Takes the steps from the initial state. If a state has several zones, it takes the first one
/// from which the rest of the path is possible, up to a state that the goal confirms if there is
/// one. A step that cannot be computed again is the failure to which the trace leads, and is left
/// out. Moves of representatives are translated back to the moves that they stand for.
pub(in crate::search) fn retrace(
    symbolic: &mut Symbolic<'_>,
    steps: &[Step],
    goal: Option<&mut dyn Goal>,
) -> Trace {
    let mut trace = Trace::default();
    let unfolded = symbolic.symmetry().map(|symmetry| unfold(symmetry, steps));
    let path = match &unfolded {
        None => Path::Same(steps),
        Some(steps) => Path::Exchanged(steps),
    };
    let _ = take_all(symbolic, path, goal, &mut trace);
    trace
}

fn take_all(
    symbolic: &mut Symbolic<'_>,
    path: Path<'_>,
    mut goal: Option<&mut dyn Goal>,
    trace: &mut Trace,
) -> Result<(), Failure> {
    let (mut words, zone, invariant) = symbolic.start()?;
    let mut zones = vec![zone];
    symbolic.let_time_pass(&mut words, &invariant, &mut zones)?;
    zones.reverse();
    let mut open = vec![(words, zones)];
    let mut room = Room::default();
    while let Some((words, zones)) = open.last_mut() {
        let Some(zone) = zones.pop() else {
            open.pop();
            continue;
        };
        let mut words = words.clone();
        let bytes = size_of_val(&*words) + size_of_val(zone.bounds());
        room.take(STATES_AT_HAND * bytes + BYTES_OF_A_STEP);
        cancellation::work(bytes);
        trace.states.truncate(open.len() - 1);
        trace.states.push((words.clone(), zone.clone()));
        let Some((step, exchanged)) = path.get(open.len() - 1) else {
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
        if let Some((parts, next)) = take(symbolic, step, exchanged, words, &zone)? {
            trace.moves.push(parts);
            open.push(next);
        }
    }
    Ok(())
}

/// Takes one step: returns the parts of the move, the words after it, and the zones that it leads
/// to, the last first.
fn take(
    symbolic: &mut Symbolic<'_>,
    step: Step,
    exchanged: Option<&Permutation>,
    mut words: Vec<i32>,
    zone: &Zone,
) -> Result<Option<(Vec<Part>, Entered)>, Failure> {
    let mut moves = Moves::default();
    symbolic.moves_within(&mut words, zone.bounds(), &mut moves)?;
    // The zone is within that of the search. There extrapolation made some impossible moves look
    // possible.
    let one = match exchanged {
        None => moves.with_rank(step),
        Some(exchanged) => {
            original(symbolic, step, exchanged, &words, zone, &moves)?.map(|index| moves.get(index))
        }
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
    // What extrapolation adds is simulated by what was there, so the same moves are possible.
    if entries.iter().any(|zone| symbolic.has_grown(zone.bounds())) {
        symbolic.extrapolate_all(&words, &mut entries);
    }
    entries.reverse();
    Ok(Some((one.parts.to_vec(), (words, entries))))
}

/// Which of the moves of a state a step of the state with exchanged members stands for.
fn original(
    symbolic: &mut Symbolic<'_>,
    step: Step,
    exchanged: &Permutation,
    words: &[i32],
    zone: &Zone,
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
