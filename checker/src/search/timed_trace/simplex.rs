//! Exact durations of waits under linear bounds, for runs in which clocks stand still at times.
//!
//! A clock's value is the sum of the durations of the waits in which it ran since it was set. So
//! bounds on clocks are linear in durations, with coefficients -1, 0 and 1. A number is a fraction
//! plus a multiple of an infinitesimal, which makes strict bounds weak ones. In the end the
//! infinitesimal becomes small enough for all of them.
//!
//! Invariants:
//! * Every row is a basic variable as a sum of multiples of the others, which are not basic and at
//!   or above their least values; `value` satisfies all rows.
//! * A row holds the coefficients that are not 0, by ascending variable.
//!
//! Source: B. Dutertre, L. de Moura, "A Fast Linear-Arithmetic Solver for DPLL(T)", CAV 2006 (the
//! tableau, bounds that come and go, and infinitesimals); R. G. Bland, "New finite pivoting rules
//! for the simplex method", 1977 (why it ends).
//!
//! Cost: a step takes at most rows times columns, and hardly more than the coefficients that are
//! not 0. Rows have few of these. Numbers that outgrow 128 bits end it.

use crate::cancellation;

/// A number outgrew its bits, or there were too many steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct TooHard;

/// Steps of one search for durations, at most.
const MOST_PIVOTS: u32 = 20_000;
/// Coefficients of all rows, at most.
const MOST_CELLS: usize = 1_000_000;

/// This many are allocated only after asking for memory.
const MANY_CELLS: usize = 1 << 15;

/// The work of adding a multiple of a fraction: see [`cancellation::work`].
const UNITS_FOR_CELL: usize = 16;

/// A fraction in lowest terms, with a positive denominator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Fraction {
    over: i128,
    under: i128,
}

impl Fraction {
    const ZERO: Fraction = Fraction { over: 0, under: 1 };
    const ONE: Fraction = Fraction { over: 1, under: 1 };

    fn new(over: i128, under: i128) -> Result<Fraction, TooHard> {
        let divisor = greatest_common_divisor(over.unsigned_abs(), under.unsigned_abs());
        let divisor = i128::try_from(divisor).map_err(|_| TooHard)?;
        let divisor = if under < 0 { -divisor } else { divisor };
        Ok(Fraction {
            over: over / divisor,
            under: under / divisor,
        })
    }

    fn whole(value: i64) -> Fraction {
        Fraction {
            over: i128::from(value),
            under: 1,
        }
    }

    fn plus(self, other: Fraction) -> Result<Fraction, TooHard> {
        if self.under == 1 && other.under == 1 {
            let over = self.over.checked_add(other.over).ok_or(TooHard)?;
            return Ok(Fraction { over, under: 1 });
        }
        let left = self.over.checked_mul(other.under).ok_or(TooHard)?;
        let right = other.over.checked_mul(self.under).ok_or(TooHard)?;
        let under = self.under.checked_mul(other.under).ok_or(TooHard)?;
        Fraction::new(left.checked_add(right).ok_or(TooHard)?, under)
    }

    fn times(self, other: Fraction) -> Result<Fraction, TooHard> {
        let over = self.over.checked_mul(other.over).ok_or(TooHard)?;
        let under = self.under.checked_mul(other.under).ok_or(TooHard)?;
        Fraction::new(over, under)
    }

    fn negated(self) -> Fraction {
        Fraction {
            over: -self.over,
            under: self.under,
        }
    }

    /// One over it; it is not 0.
    fn inverse(self) -> Result<Fraction, TooHard> {
        Fraction::new(self.under, self.over)
    }

    fn is_zero(self) -> bool {
        self.over == 0
    }

    fn is_positive(self) -> bool {
        self.over > 0
    }

    fn is_less(self, other: Fraction) -> Result<bool, TooHard> {
        let difference = self.plus(other.negated())?;
        Ok(difference.over < 0)
    }
}

fn greatest_common_divisor(mut one: u128, mut other: u128) -> u128 {
    while other != 0 {
        (one, other) = (other, one % other);
    }
    one.max(1)
}

/// A fraction, and how many infinitesimals more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Amount(Fraction, Fraction);

impl Amount {
    const ZERO: Amount = Amount(Fraction::ZERO, Fraction::ZERO);

    fn plus(self, other: Amount) -> Result<Amount, TooHard> {
        Ok(Amount(self.0.plus(other.0)?, self.1.plus(other.1)?))
    }

    fn times(self, factor: Fraction) -> Result<Amount, TooHard> {
        Ok(Amount(self.0.times(factor)?, self.1.times(factor)?))
    }

    fn minus(self, other: Amount) -> Result<Amount, TooHard> {
        self.plus(Amount(other.0.negated(), other.1.negated()))
    }

    fn is_less(self, other: Amount) -> Result<bool, TooHard> {
        let Amount(difference, infinitesimals) = self.minus(other)?;
        Ok(difference.over < 0 || difference.is_zero() && infinitesimals.over < 0)
    }
}

/// A sum of durations with a lower bound: the waits that count positively, those that count
/// negatively, and the least value with its number of infinitesimals.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct LinearBound {
    pub(super) plus: Vec<usize>,
    pub(super) minus: Vec<usize>,
    pub(super) least: (i64, i64),
}

impl LinearBound {
    fn least(&self) -> Amount {
        let (whole, infinitesimals) = self.least;
        Amount(Fraction::whole(whole), Fraction::whole(infinitesimals))
    }
}

/// Multiples of variables, by ascending variable; none is 0.
type Row = Vec<(usize, Fraction)>;

/// Durations under bounds, with a way back.
#[derive(Debug, Default)]
pub(super) struct Durations {
    /// For each variable: its value, and its least value. Those of waits are in the order in which
    /// they were added.
    value: Vec<Amount>,
    least: Vec<Option<Amount>>,
    /// The variables of the waits.
    waits: Vec<usize>,
    /// For each row: its basic variable, and the sum that equals it.
    rows: Vec<(usize, Row)>,
    /// For each variable: its row, if it is basic.
    row_of: Vec<Option<usize>>,
    /// The variables of bounds in the order in which they were required.
    required: Vec<usize>,
    pivots: u32,
}

impl Durations {
    /// Adds a wait; returns its number, from 0.
    pub(super) fn add_wait(&mut self) -> usize {
        let variable = self.add_variable();
        self.least[variable] = Some(Amount::ZERO);
        self.waits.push(variable);
        self.waits.len() - 1
    }

    fn add_variable(&mut self) -> usize {
        self.value.push(Amount::ZERO);
        self.least.push(None);
        self.row_of.push(None);
        self.value.len() - 1
    }

    /// Where to go back to.
    pub(super) fn mark(&self) -> usize {
        self.required.len()
    }

    /// Undoes what was required since then; what was required before could be satisfied.
    pub(super) fn undo(&mut self, mark: usize) -> Result<(), TooHard> {
        for variable in self.required.drain(mark..) {
            self.least[variable] = None;
        }
        self.repair().map(|_| ())
    }

    /// Whether the current durations satisfy a bound.
    pub(super) fn is_met(&self, bound: &LinearBound) -> Result<bool, TooHard> {
        Ok(!self.left_side(bound)?.is_less(bound.least())?)
    }

    /// The sum that a bound is about.
    fn left_side(&self, bound: &LinearBound) -> Result<Amount, TooHard> {
        let mut sum = Amount::ZERO;
        for &wait in &bound.plus {
            sum = sum.plus(self.value[self.waits[wait]])?;
        }
        for &wait in &bound.minus {
            sum = sum.minus(self.value[self.waits[wait]])?;
        }
        Ok(sum)
    }

    /// Adds a bound and finds durations that satisfy all; returns false if there are none, and then
    /// they mean nothing until it is undone.
    pub(super) fn require(&mut self, bound: &LinearBound) -> Result<bool, TooHard> {
        let cells = self.rows.iter().map(|(_, row)| row.len()).sum::<usize>();
        if cells > MOST_CELLS {
            return Err(TooHard);
        }
        if cells > MANY_CELLS {
            cancellation::ask_for(cells * size_of::<(usize, Fraction)>());
        }
        let variable = self.add_variable();
        let (mut row, mut waits) = (Row::new(), Row::new());
        let signed = bound.plus.iter().map(|&wait| (wait, Fraction::ONE));
        let minus = bound
            .minus
            .iter()
            .map(|&wait| (wait, Fraction::ONE.negated()));
        for (wait, factor) in signed.chain(minus) {
            let wait = self.waits[wait];
            match self.row_of[wait] {
                None => waits.push((wait, factor)),
                Some(other) => add_multiple(&mut row, &self.rows[other].1, factor)?,
            }
        }
        waits.sort_by_key(|&(wait, _)| wait);
        add_multiple(&mut row, &waits, Fraction::ONE)?;
        self.value[variable] = self.sum(&row)?;
        self.least[variable] = Some(bound.least());
        self.row_of[variable] = Some(self.rows.len());
        self.rows.push((variable, row));
        self.required.push(variable);
        self.repair()
    }

    fn sum(&self, row: &Row) -> Result<Amount, TooHard> {
        let mut sum = Amount::ZERO;
        for &(variable, factor) in row {
            sum = sum.plus(self.value[variable].times(factor)?)?;
        }
        Ok(sum)
    }

    fn is_below(&self, variable: usize) -> Result<bool, TooHard> {
        self.least[variable].map_or(Ok(false), |least| self.value[variable].is_less(least))
    }

    /// Moves variables until all have their least values; returns false if they cannot.
    fn repair(&mut self) -> Result<bool, TooHard> {
        loop {
            // The first basic variable that is too small.
            let mut lowest: Option<usize> = None;
            for &(basic, _) in &self.rows {
                if lowest.is_none_or(|lowest| basic < lowest) && self.is_below(basic)? {
                    lowest = Some(basic);
                }
            }
            let Some(low) = lowest else {
                return Ok(true);
            };
            let Some(row) = self.row_of[low] else {
                return Err(TooHard);
            };
            let Some(helper) = self.helper(row)? else {
                return Ok(false);
            };
            self.pivots += 1;
            if self.pivots > MOST_PIVOTS {
                return Err(TooHard);
            }
            self.pivot(row, helper)?;
        }
    }

    /// The first variable that can change so that the sum of a row grows.
    fn helper(&self, row: usize) -> Result<Option<usize>, TooHard> {
        for &(variable, factor) in &self.rows[row].1 {
            let can_sink = || match self.least[variable] {
                None => Ok(true),
                Some(least) => least.is_less(self.value[variable]),
            };
            if factor.is_positive() || can_sink()? {
                return Ok(Some(variable));
            }
        }
        Ok(None)
    }

    /// Makes the basic variable of a row its least value, by changing another one, which becomes
    /// basic.
    fn pivot(&mut self, row: usize, helper: usize) -> Result<(), TooHard> {
        let basic = self.rows[row].0;
        let (Some(least), Some(place)) = (self.least[basic], place_in(&self.rows[row].1, helper))
        else {
            return Err(TooHard);
        };
        let mut own = std::mem::take(&mut self.rows[row].1);
        let factor = own.remove(place).1.inverse()?;
        let change = least.minus(self.value[basic])?.times(factor)?;
        // The row solved for the helper.
        for (_, one) in &mut own {
            *one = one.times(factor.negated())?;
        }
        let place_of_basic = own.partition_point(|&(variable, _)| variable < basic);
        own.insert(place_of_basic, (basic, factor));
        self.value[basic] = least;
        self.value[helper] = self.value[helper].plus(change)?;
        for (variable, other) in &mut self.rows {
            let Some(place) = place_in(other, helper) else {
                continue;
            };
            let share = other.remove(place).1;
            self.value[*variable] = self.value[*variable].plus(change.times(share)?)?;
            add_multiple(other, &own, share)?;
        }
        self.rows[row] = (helper, own);
        self.row_of[helper] = Some(row);
        self.row_of[basic] = None;
        Ok(())
    }

    /// The durations as whole numbers of ticks, and the number of ticks in a unit. They satisfy the
    /// requirements, and those other bounds that the current durations satisfy.
    pub(super) fn in_ticks(&self, others: &[LinearBound]) -> Result<(Vec<i64>, i64), TooHard> {
        let epsilon = self.epsilon(others)?;
        let mut durations = Vec::new();
        let mut ticks_per_unit = 1_i128;
        for &wait in &self.waits {
            let Amount(whole, infinitesimals) = self.value[wait];
            let duration = whole.plus(infinitesimals.times(epsilon)?)?;
            let common = greatest_common_divisor(
                ticks_per_unit.unsigned_abs(),
                duration.under.unsigned_abs(),
            );
            let common = i128::try_from(common).map_err(|_| TooHard)?;
            ticks_per_unit = ticks_per_unit
                .checked_mul(duration.under / common)
                .filter(|&ticks| ticks < 1 << 40)
                .ok_or(TooHard)?;
            durations.push(duration);
        }
        let ticks = durations.iter().map(|one| {
            let ticks = one.over.checked_mul(ticks_per_unit / one.under);
            ticks
                .and_then(|ticks| i64::try_from(ticks).ok())
                .ok_or(TooHard)
        });
        let ticks = ticks.collect::<Result<_, _>>()?;
        Ok((ticks, i64::try_from(ticks_per_unit).map_err(|_| TooHard)?))
    }

    /// A number for the infinitesimal that keeps every variable at or above its least value, and
    /// the sums of other bounds above theirs.
    fn epsilon(&self, others: &[LinearBound]) -> Result<Fraction, TooHard> {
        let mut epsilon = Fraction::ONE;
        let variables = self.value.iter().zip(&self.least);
        let required = variables.filter_map(|(value, least)| Some(Ok((*value, (*least)?))));
        let others = others
            .iter()
            .map(|bound| Ok((self.left_side(bound)?, bound.least())));
        for pair in required.chain(others) {
            let (value, least) = pair?;
            let Amount(room, infinitesimals) = value.minus(least)?;
            if room.is_positive() && infinitesimals.over < 0 {
                let most = room.times(infinitesimals.negated().inverse()?)?;
                if most.is_less(epsilon)? {
                    epsilon = most;
                }
            }
        }
        Ok(epsilon)
    }
}

/// Where the multiple of a variable stands.
fn place_in(row: &Row, variable: usize) -> Option<usize> {
    row.binary_search_by_key(&variable, |&(one, _)| one).ok()
}

/// Adds a multiple of a sum. A variable may come several times in it, one after the other.
fn add_multiple(
    row: &mut Row,
    other: &[(usize, Fraction)],
    factor: Fraction,
) -> Result<(), TooHard> {
    cancellation::work(UNITS_FOR_CELL * (row.len() + other.len()));
    let mut sum = Row::with_capacity(row.len() + other.len());
    let mut own = row.iter().copied().peekable();
    for &(variable, multiple) in other {
        while let Some(one) = own.next_if(|&(one, _)| one <= variable) {
            sum.push(one);
        }
        let more = multiple.times(factor)?;
        match sum.last_mut() {
            Some((last, multiple)) if *last == variable => *multiple = multiple.plus(more)?,
            _ => sum.push((variable, more)),
        }
    }
    sum.extend(own);
    sum.retain(|(_, multiple)| !multiple.is_zero());
    sum.shrink_to_fit();
    *row = sum;
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::{Durations, LinearBound};

    fn bound(plus: &[usize], minus: &[usize], least: (i64, i64)) -> LinearBound {
        LinearBound {
            plus: plus.to_vec(),
            minus: minus.to_vec(),
            least,
        }
    }

    /// A walk through all small half-unit durations finds some exactly if the tableau does.
    #[test]
    fn durations_are_found_if_there_are_any() {
        let mut random = 0x9e37_79b9_7f4a_7c15_u64;
        let mut below = |limit: u64| {
            random ^= random << 13;
            random ^= random >> 7;
            random ^= random << 17;
            (random >> 20) % limit
        };
        let (mut found, mut none) = (0, 0);
        for _ in 0..400 {
            let mut durations = Durations::default();
            for _ in 0..3 {
                durations.add_wait();
            }
            let mut bounds = Vec::new();
            let mut is_possible = true;
            for _ in 0..2 + below(5) {
                let (mut plus, mut minus) = (Vec::new(), Vec::new());
                for wait in 0..3 {
                    match below(3) {
                        0 => plus.push(wait),
                        1 => minus.push(wait),
                        _ => {}
                    }
                }
                let one = bound(&plus, &minus, (below(7) as i64 - 3, below(2) as i64));
                is_possible = durations.require(&one).expect("numbers are small");
                bounds.push(one);
                if !is_possible {
                    break;
                }
            }
            // A bound of each wait keeps the walk small; fourths are fine enough for three
            // variables with strict bounds.
            let is_met = |values: [i64; 3], per_unit: i64| {
                bounds.iter().all(|one| {
                    let sum = |waits: &[usize]| waits.iter().map(|&wait| values[wait]).sum::<i64>();
                    let sum = sum(&one.plus) - sum(&one.minus);
                    let least = one.least.0 * per_unit;
                    sum > least || sum == least && one.least.1 == 0
                })
            };
            if is_possible {
                let (ticks, per_unit) = durations.in_ticks(&[]).expect("numbers are small");
                assert!(ticks.iter().all(|&one| one >= 0), "{ticks:?}");
                assert!(
                    is_met([ticks[0], ticks[1], ticks[2]], per_unit),
                    "{bounds:?} {ticks:?}"
                );
                found += 1;
            } else {
                let quarters = 0..=48;
                let some = quarters.clone().any(|a| {
                    quarters
                        .clone()
                        .any(|b| quarters.clone().any(|c| is_met([a, b, c], 4)))
                });
                assert!(!some, "{bounds:?}");
                none += 1;
            }
        }
        assert!(
            found > 50 && none > 50,
            "{found} with durations, {none} without"
        );
    }

    #[test]
    fn rows_take_no_more_than_what_bounds_speak_of() {
        let mut durations = Durations::default();
        for index in 0..200 {
            let wait = durations.add_wait();
            assert_eq!(durations.require(&bound(&[wait], &[], (1, 0))), Ok(true));
            if index > 0 {
                let both = bound(&[wait - 1], &[wait], (0, 0));
                assert_eq!(durations.require(&both), Ok(true));
            }
        }
        let cells: usize = durations.rows.iter().map(|(_, row)| row.len()).sum();
        let rows = durations.rows.len();
        assert!(cells <= 4 * rows, "{cells} coefficients in {rows} rows");
    }

    #[test]
    fn what_is_taken_back_no_longer_counts() {
        let mut durations = Durations::default();
        let wait = durations.add_wait();
        assert_eq!(durations.require(&bound(&[], &[wait], (-3, 0))), Ok(true));
        let mark = durations.mark();
        assert_eq!(durations.require(&bound(&[wait], &[], (4, 0))), Ok(false));
        assert_eq!(durations.undo(mark), Ok(()));
        assert_eq!(durations.require(&bound(&[wait], &[], (2, 1))), Ok(true));
        let (ticks, per_unit) = durations.in_ticks(&[]).expect("numbers are small");
        assert!(ticks[0] > 2 * per_unit && ticks[0] <= 3 * per_unit);
    }
}
