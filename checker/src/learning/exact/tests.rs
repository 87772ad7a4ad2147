//! Random processes against all their strategies, and what has no best strategy.

use super::process::{NOBODY, Process};
use super::solution::Unsolved;
use super::solve::solve;

/// Numbers that look random.
struct Numbers(u64);

impl Numbers {
    fn below(&mut self, count: u64) -> u64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1);
        (self.0 >> 33) % count
    }
}

/// Each node has up to three choices with up to two ways; the last node ends.
fn random(seed: u64, nodes: u64, costs: &[f64]) -> Process {
    let mut numbers = Numbers(seed);
    let mut process = Process::new();
    for _ in 0..nodes - 1 {
        for choice in 0..=numbers.below(3) {
            let targets = [numbers.below(nodes), numbers.below(nodes)];
            if targets[0] == targets[1] {
                process.add_way(targets[0] as u32, 1.0);
            } else {
                let chance = (1 + numbers.below(9)) as f64 / 10.0;
                process.add_way(targets[0] as u32, chance);
                process.add_way(targets[1] as u32, 1.0 - chance);
            }
            let cost = costs[numbers.below(costs.len() as u64) as usize];
            process.end_choice(choice as u32, cost);
        }
        process.end_node();
    }
    process.end_choice(NOBODY, 0.0);
    process.end_node();
    process
}

/// What a strategy costs from the first node; `None` if it does not end almost surely.
fn cost(process: &Process, policy: &[usize]) -> Option<f64> {
    let nodes = policy.len();
    let reachable = |from: usize| {
        let mut seen = vec![false; nodes];
        let mut open = vec![from];
        while let Some(node) = open.pop() {
            if !std::mem::replace(&mut seen[node], true) {
                open.extend(process.outcomes(policy[node]).map(|one| one.0 as usize));
            }
        }
        seen
    };
    let from_start = reachable(0);
    let ends = (0..nodes).all(|node| !from_start[node] || reachable(node)[nodes - 1]);
    if !ends {
        return None;
    }
    // Gaussian elimination, from the last node down: costs and chances of what is left.
    let mut rows: Vec<(Vec<f64>, f64)> = (0..nodes)
        .map(|node| {
            let mut row = vec![0.0; nodes];
            for (target, chance) in process.outcomes(policy[node]) {
                row[target as usize] += chance;
            }
            (row, process.costs[policy[node]])
        })
        .collect();
    for node in (0..nodes).rev() {
        let stays = rows[node].0[node];
        if stays >= 1.0 {
            // It is not reached.
            continue;
        }
        let (row, cost) = rows[node].clone();
        let row: Vec<f64> = row.iter().map(|chance| chance / (1.0 - stays)).collect();
        let cost = cost / (1.0 - stays);
        for (other, (its, its_cost)) in rows.iter_mut().enumerate() {
            let weight = its[node];
            if other == node || weight == 0.0 {
                continue;
            }
            its[node] = 0.0;
            *its_cost += weight * cost;
            for (place, chance) in row.iter().enumerate() {
                if place != node {
                    its[place] += weight * chance;
                }
            }
        }
        rows[node] = (row, cost);
        rows[node].0[node] = 0.0;
    }
    Some(rows[0].1)
}

/// The least cost of all strategies without memory.
fn least(process: &Process) -> Option<f64> {
    let nodes = process.nodes();
    let mut policy: Vec<usize> = (0..nodes as u32)
        .map(|node| process.choices(node).start)
        .collect();
    let mut best: Option<f64> = None;
    loop {
        if let Some(cost) = cost(process, &policy) {
            best = Some(best.map_or(cost, |best| best.min(cost)));
        }
        let mut node = 0;
        loop {
            if node == nodes {
                return best;
            }
            let choices = process.choices(node as u32);
            if policy[node] + 1 < choices.end {
                policy[node] += 1;
                break;
            }
            policy[node] = choices.start;
            node += 1;
        }
    }
}

fn agrees(process: &Process, seed: u64) {
    let solution = match solve(process) {
        Ok(solution) => solution,
        Err(reason) => {
            assert_ne!(reason, Unsolved::Slow, "seed {seed}: {process:?}");
            let all = &process.costs;
            assert!(
                all.iter().any(|&cost| cost < 0.0),
                "seed {seed}: {reason:?}"
            );
            return;
        }
    };
    let (lower, upper) = (solution.lower[0], solution.upper[0]);
    let Some(exact) = least(process) else {
        assert!(
            upper.is_infinite(),
            "seed {seed}: no strategy ends, {upper}"
        );
        return;
    };
    let slack = 1e-9 * exact.abs().max(1.0);
    assert!(lower <= exact + slack, "seed {seed}: {lower} > {exact}");
    assert!(exact <= upper + slack, "seed {seed}: {exact} > {upper}");
    assert!(
        upper - lower <= 1e-6 * exact.abs() + slack,
        "seed {seed}: {lower}, {upper}"
    );
    let policy: Vec<usize> = solution
        .policy
        .iter()
        .zip(0..)
        .map(|(&choice, node)| match choice {
            u32::MAX => process.choices(node).start,
            choice => choice as usize,
        })
        .collect();
    let own = cost(process, &policy).expect("the best strategy ends");
    assert!(own <= upper + slack, "seed {seed}: {own} > {upper}");
}

#[test]
fn random_processes_agree_with_all_their_strategies() {
    for seed in 0..3000 {
        agrees(&random(seed, 3 + seed % 4, &[1.0, 2.0, 5.0]), seed);
        agrees(&random(seed, 3 + seed % 4, &[0.0, 0.0, 1.0]), seed);
        agrees(&random(seed, 3 + seed % 4, &[0.0]), seed);
        agrees(&random(seed, 3 + seed % 4, &[0.0, 1.0, -1.0]), seed);
        agrees(&random(seed, 3 + seed % 4, &[-1.0, -2.0]), seed);
    }
}

/// A node with a choice that costs this and returns, and one that ends.
fn circle(cost: f64) -> Process {
    let mut process = Process::new();
    process.add_way(0, 1.0);
    process.end_choice(0, cost);
    process.add_way(1, 1.0);
    process.end_choice(1, 3.0);
    process.end_node();
    process.end_choice(NOBODY, 0.0);
    process.end_node();
    process
}

#[test]
fn a_circle_that_costs_less_than_nothing_has_no_best_strategy() {
    assert_eq!(solve(&circle(-1.0)).err(), Some(Unsolved::Unbounded));
}

#[test]
fn a_circle_for_nothing_is_left() {
    for cost in [0.0, 1.0] {
        let solution = solve(&circle(cost)).expect("it has bounds");
        assert_eq!((solution.lower[0], solution.upper[0]), (3.0, 3.0));
        assert_eq!(solution.policy[0], 1);
    }
}

#[test]
fn where_no_run_ends_there_is_no_value() {
    let mut process = Process::new();
    process.add_way(0, 1.0);
    process.end_choice(0, 0.0);
    process.end_node();
    assert!(solve(&process).is_ok_and(|solution| solution.upper[0].is_infinite()));
}
