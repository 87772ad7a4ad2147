//! Machines of games under partial observation in C: compiled, they propose and go on as the
//! machine that they were made of.
//!
//! Of each, all states are asked for all observations.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;
use std::sync::Arc;

use checker::engine::LoadedModel;
use checker::engine::format::{machine_c, machine_json};
use checker::game::partial_observation::Machine;

use crate::c_programs::{compiled, games, in_folder};
use crate::solved::solved;

/// Writes what each state proposes, and where it goes on, observation by observation.
const DRIVER: &str = r#"
#include <stdio.h>
int main(void)
{
    int state, i;
    unsigned long bits;
    unsigned char seen[CONTROLLER_OBSERVATIONS + 1] = {0};
    for (state = 0; state < CONTROLLER_STATES; state++) {
        int action = controller_propose(state);
        printf("%s\n", action == CONTROLLER_WAIT ? "wait" : controller_texts[action]);
        for (bits = 0; bits < 1ul << CONTROLLER_OBSERVATIONS; bits++) {
            for (i = 0; i < CONTROLLER_OBSERVATIONS; i++)
                seen[i] = (unsigned char)(bits >> i & 1);
            printf("%d\n", controller_next(state, seen));
        }
    }
    printf("%d %d\n", controller_propose(-1), controller_next(CONTROLLER_STATES, seen));
    return 0;
}
"#;

/// The machine of a game, and the same in C.
struct Case {
    model: LoadedModel,
    machine: Arc<Machine>,
    text: String,
}

fn solve(path: &Path, query: &str) -> Option<Case> {
    let (model, answer) = solved(path, query)?;
    let machine = answer.evidence.machine?;
    let text = machine_c::write(model.network(), &machine, query);
    Some(Case {
        model,
        machine,
        text,
    })
}

impl Case {
    /// What the driver is to write.
    fn expected(&self) -> String {
        let mut text = String::new();
        for (number, state) in self.machine.states.iter().enumerate() {
            let own = &state.knowledge.observation;
            let action = machine_json::action_text(self.model.network(), state.action);
            let _ = writeln!(text, "{action}");
            for bits in 0..1_u64 << own.len() {
                let seen: Vec<bool> = (0..own.len()).map(|index| bits >> index & 1 == 1).collect();
                let next = state.next.iter().find(|(one, _)| one[..] == seen[..]);
                let next = match next {
                    _ if own[..] == seen[..] => number as i64,
                    Some((_, next)) => *next as i64,
                    None => -3,
                };
                let _ = writeln!(text, "{next}");
            }
        }
        text.push_str("-3 -3\n");
        text
    }
}

fn run(folder: &Path, text: &str) -> String {
    let program = compiled(folder, &format!("{text}{DRIVER}"), "machine");
    let output = Command::new(&program).output().expect("the machine runs");
    String::from_utf8(output.stdout).expect("it writes text")
}

#[test]
fn machines_in_c_do_as_their_machines() {
    let mut machines = 0;
    in_folder("machines", |folder| {
        for (path, query) in games("{") {
            let Some(case) = solve(&path, &query) else {
                continue;
            };
            let output = run(folder, &case.text);
            assert_eq!(output, case.expected(), "{query}\n{}", case.text);
            machines += 1;
        }
    });
    assert!(machines >= 10, "only {machines} machines");
}
