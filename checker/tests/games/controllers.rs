//! Controllers in C: compiled, they decide as the strategy does that they were made of.
//!
//! Each is asked in all discrete states of its strategy and in some beside them, at all clock
//! values of a grid and at random ones. What is expected is looked up in the strategy itself,
//! decision by decision.

use std::collections::HashMap;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use checker::engine::format::{strategy_c, text};
use checker::engine::query::time_clock;
use checker::game::Player;
use checker::game::strategy::closed_loop;
use checker::game::strategy::{Decision, Selection, Strategy};
use checker::network::{Part, is_same_entry};

use crate::c_programs::{compiled, games, in_folder};
use crate::solved::solved;

/// Ticks of a unit of time. Clock values are whole numbers of two of them, so that every bound and
/// the middle between is met.
const TICKS_PER_UNIT: i64 = 4;

/// The greatest clock value that is asked about, in ticks.
const GREATEST: i64 = 7 * TICKS_PER_UNIT;

/// Reads states with clock values, and writes of each the decision, the wait, and what is allowed.
const DRIVER: &str = r#"
#include <stdio.h>
int main(void)
{
    int32_t state[CONTROLLER_STATE_WORDS + 1];
    controller_time clocks[CONTROLLER_CLOCKS + 1];
    for (;;) {
        int i, value;
        controller_decision decision;
        for (i = 0; i < CONTROLLER_STATE_WORDS; i++) {
            if (scanf("%d", &value) != 1)
                return 0;
            state[i] = value;
        }
        for (i = 0; i < CONTROLLER_CLOCKS; i++) {
            if (scanf("%d", &value) != 1)
                return 1;
            clocks[i] = (controller_time)value;
        }
        decision = controller_decide(state, clocks);
        printf("%d %ld %d", decision.action, (long)decision.wait, decision.is_open);
        for (i = -1; i < CONTROLLER_ACTIONS; i++)
            printf(" %d", controller_allows(state, clocks, i));
        printf("\n");
    }
}
"#;

struct Case {
    name: String,
    text: String,
    strategy: Strategy,
    /// By the words that make a state: whether play has ended there, the decisions, and the legs.
    decided: HashMap<Vec<i32>, (bool, Vec<Decision>, Vec<Decision>)>,
    words: usize,
    clocks: usize,
    /// By number of the controller, the text of its edges.
    actions: Vec<String>,
    network: checker::ir::Network,
}

fn solve(path: &Path, query: &str) -> Option<Case> {
    let (model, answer) = solved(path, query)?;
    let strategy = answer.evidence.strategy?;
    let text = strategy_c::write(model.network(), &strategy, query).ok()?;
    let again = strategy_c::write(model.network(), &strategy, query);
    assert_eq!(again.as_ref(), Ok(&text), "the text is always the same");
    let (_, after) = text.split_once("controller_texts[] = {\n")?;
    let (list, _) = after.split_once("};")?;
    let actions = list.lines().filter_map(|line| {
        let line = line.trim().strip_prefix('"')?.strip_suffix("\",")?;
        Some(line.replace("\\\"", "\"").replace("\\?", "?"))
    });
    let network = time_clock::network_of(model.network(), &strategy).into_owned();
    let words = network.layout.identity_words as usize;
    let decided = closed_loop::joined(&network, &strategy).into_iter();
    let decided = decided.map(|one| {
        let decisions = one.decisions.into_iter().cloned().collect();
        let legs = one.legs.into_iter().cloned().collect();
        (one.words[..words].to_vec(), (one.is_goal, decisions, legs))
    });
    Some(Case {
        decided: decided.collect(),
        name: format!("{}: {query}", path.display()),
        actions: actions.collect(),
        text,
        strategy: (*strategy).clone(),
        words,
        clocks: network.clocks.len().saturating_sub(1),
        network,
    })
}

/// What the strategy says at a point.
struct Expected<'s> {
    is_known: bool,
    is_goal: bool,
    /// The decisions that apply.
    decisions: Vec<&'s Decision>,
    /// The legs that are picked.
    legs: Vec<&'s [Part]>,
}

impl Case {
    fn at(&self, words: &[i32], clocks: &[i64]) -> Expected<'_> {
        let Some((is_goal, decisions, legs)) = self.decided.get(&words[..self.words]) else {
            return Expected {
                is_known: false,
                is_goal: false,
                decisions: Vec::new(),
                legs: Vec::new(),
            };
        };
        let most = match self.strategy.selection {
            Selection::First => 1,
            Selection::Any => usize::MAX,
        };
        let mut values = vec![0];
        values.extend_from_slice(clocks);
        let applies = decisions
            .iter()
            .filter(|one| one.zones.contains(&values, TICKS_PER_UNIT));
        let mut picked: Vec<&[Part]> = Vec::new();
        for leg in legs {
            let parts = leg.action.as_deref().expect("a leg is a move");
            if leg.zones.contains(&values, TICKS_PER_UNIT)
                && !picked
                    .iter()
                    .any(|one| is_same_entry(&self.network, one, parts))
            {
                picked.push(parts);
            }
        }
        Expected {
            is_known: true,
            is_goal: *is_goal,
            decisions: applies.take(most).collect(),
            legs: picked,
        }
    }

    fn waits_at(&self, words: &[i32], clocks: &[i64], ticks: i64) -> bool {
        let later: Vec<i64> = clocks.iter().map(|value| value + ticks).collect();
        let expected = self.at(words, &later);
        expected.decisions.iter().any(|one| one.action.is_none())
    }

    fn number(&self, parts: &[Part]) -> i64 {
        let edges = parts.iter().map(|&part| match self.strategy.owner {
            Player::Controller => text::entry_text(&self.network, part),
            Player::Environment => text::part_text(&self.network, part),
        });
        let text = edges.collect::<Vec<_>>().join(" ");
        let number = self.actions.iter().position(|one| *one == text);
        number.unwrap_or_else(|| panic!("{}: no {text}", self.name)) as i64
    }

    /// Compares a line of the driver with the strategy.
    fn check(&self, words: &[i32], clocks: &[i64], line: &str) {
        let got: Vec<i64> = line
            .split(' ')
            .map(|number| number.parse().expect("the driver writes numbers"))
            .collect();
        let place = format!("{}: {words:?} at {clocks:?}: {line}", self.name);
        let expected = self.at(words, clocks);
        let (action, wait, is_open, allowed) = (got[0], got[1], got[2] == 1, &got[3..]);
        if !expected.is_known || (expected.decisions.is_empty() && !expected.is_goal) {
            assert_eq!(action, -3, "{place}");
        } else if expected.is_goal {
            assert_eq!(action, -2, "{place}");
        } else {
            let one_of = expected.decisions.iter().any(|one| match &one.action {
                None => action == -1,
                Some(parts) => action == self.number(parts),
            });
            assert!(one_of, "{place}");
        }
        for (index, &is_allowed) in allowed.iter().enumerate() {
            let action = index as i64 - 1;
            let mut decisions = expected.decisions.iter().filter(|_| !expected.is_goal);
            let wanted = decisions.any(|one| match &one.action {
                None => action == -1,
                Some(parts) => action == self.number(parts),
            });
            let mut legs = expected.legs.iter().filter(|_| !expected.is_goal);
            let is_picked = legs.any(|leg| action == self.number(leg));
            assert_eq!(is_allowed == 1, wanted || is_picked, "{place}: {action}");
        }
        if action == -1 {
            // Every bound is a whole number of ticks, so looking at each tick and between is
            // enough.
            let end = if wait < 0 { 3 * GREATEST } else { wait };
            for ticks in 0..end {
                assert!(
                    self.waits_at(words, clocks, ticks),
                    "{place}: after {ticks}"
                );
            }
            if wait >= 0 {
                assert_eq!(
                    self.waits_at(words, clocks, wait),
                    !is_open,
                    "{place}: at the end"
                );
                assert!(
                    is_open || !self.waits_at(words, clocks, wait + 1),
                    "{place}: after the end"
                );
            }
        }
    }

    /// The points that are asked about.
    fn points(&self) -> Vec<(Vec<i32>, Vec<i64>)> {
        let mut random = 0x9e37_79b9_u64;
        let mut below = |limit: i64| {
            random ^= random << 13;
            random ^= random >> 7;
            random ^= random << 17;
            (random % limit as u64) as i64
        };
        let mut points = Vec::new();
        for one in closed_loop::joined(&self.network, &self.strategy) {
            let words = one.words;
            let mut beside = words.to_vec();
            let word = below(self.words as i64) as usize;
            beside[word] = beside[word].wrapping_add(below(5) as i32 - 2);
            for words in [words.to_vec(), beside] {
                let mut clocks = vec![0; self.clocks];
                loop {
                    points.push((words.clone(), clocks.clone()));
                    let step = if self.clocks > 2 { TICKS_PER_UNIT } else { 2 };
                    let Some(index) = clocks.iter().position(|&value| value + step <= GREATEST)
                    else {
                        break;
                    };
                    clocks[..index].fill(0);
                    clocks[index] += step;
                }
                for _ in 0..20 {
                    let clocks = (0..self.clocks).map(|_| 2 * below(GREATEST / 2));
                    points.push((words.clone(), clocks.collect()));
                }
            }
        }
        points
    }

    fn run(&self, folder: &Path) -> usize {
        // Clock values are asked in ticks, as integers.
        let settings =
            format!("#define CONTROLLER_TIME long\n#define CONTROLLER_UNIT {TICKS_PER_UNIT}\n");
        let program = compiled(folder, &(settings + &self.text + DRIVER), &self.name);

        let points = self.points();
        let mut input = String::new();
        for (words, clocks) in &points {
            for word in &words[..self.words] {
                let _ = write!(input, "{word} ");
            }
            for value in clocks {
                let _ = write!(input, "{value} ");
            }
            input.push('\n');
        }
        let mut child = Command::new(&program)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("the controller runs");
        let mut stdin = child.stdin.take().expect("its input is a pipe");
        let writer = std::thread::spawn(move || stdin.write_all(input.as_bytes()));
        let output = child.wait_with_output().expect("the controller ends");
        writer.join().expect("writing ends").expect("all is read");
        let output = String::from_utf8(output.stdout).expect("it writes numbers");
        assert_eq!(output.lines().count(), points.len(), "{}", self.name);
        for ((words, clocks), line) in points.iter().zip(output.lines()) {
            self.check(words, clocks, line);
        }
        points.len()
    }
}

/// Every second game, from this one on.
fn check_every_second(first: usize) {
    let (mut controllers, mut points) = (0, 0);
    in_folder(&format!("controllers_{first}"), |folder| {
        for (path, query) in games("control").into_iter().skip(first).step_by(2) {
            if let Some(case) = solve(&path, &query) {
                points += case.run(folder);
                controllers += 1;
            }
        }
    });
    assert!(controllers >= 20, "only {controllers} controllers");
    assert!(points >= 7_500, "only {points} points");
}

#[test]
fn controllers_decide_as_their_strategies() {
    check_every_second(0);
}

#[test]
fn other_controllers_do_too() {
    check_every_second(1);
}
