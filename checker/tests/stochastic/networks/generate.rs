//! Random networks of three families, with queries.

use super::{
    Assignment, Atom, Bound, Branch, Compare, Condition, Edge, Location, Net, Number, Path,
    Process, Query, Urgency,
};
use crate::random::Random;

/// What a network is like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Family {
    /// Exponential delays and no clocks.
    Exponential,
    /// Exponential and uniform delays, windows in guards, clocks that are kept over moves.
    Timed,
    /// All delays are known moments; who moves first there is a matter of chance.
    Ticking,
}

/// A random network, with a query.
pub(crate) fn network(random: &mut Random, family: Family) -> (Net, Query) {
    let closes = family == Family::Timed && random.chance(50);
    let mut net = Net {
        greatest: (0..=random.below(2))
            .map(|_| 1 + random.below(2) as i32)
            .collect(),
        clocks: match family {
            Family::Exponential => 0,
            Family::Timed => 1 + random.below(3),
            Family::Ticking => 2 + random.below(2),
        },
        closes,
        channels: (0..=random.below(2))
            .map(|_| !closes && random.chance(30))
            .collect(),
        processes: Vec::new(),
    };
    let processes = match family {
        Family::Timed => 2,
        _ => 2 + random.below(2),
    };
    for number in 0..processes {
        let process = process(random, family, &net, number);
        net.processes.push(process);
    }
    let query = query(random, family, &net);
    (net, query)
}

fn process(random: &mut Random, family: Family, net: &Net, number: usize) -> Process {
    let count = 2 + random.below(3);
    let mut process = Process::default();
    // The clock that most of its locations look at.
    let own = if net.clocks > 0 {
        number % net.clocks
    } else {
        0
    };
    for location in 0..count {
        // The first location is none that stops time, and there is always a way to it.
        let urgency = match random.below(12) {
            0 if location > 0 => Urgency::Urgent,
            1 if location > 0 => Urgency::Committed,
            _ => Urgency::Normal,
        };
        let is_bounded = match family {
            Family::Exponential => false,
            Family::Timed => random.chance(60),
            Family::Ticking => true,
        };
        let clock = if net.clocks > 0 && random.chance(15) {
            random.below(net.clocks)
        } else {
            own
        };
        let normal = urgency == Urgency::Normal;
        let bound = (normal && is_bounded).then(|| (clock, 1 + random.below(3) as i32));
        let rate = (normal && !is_bounded).then(|| (rate(random, net), 1 + random.below(2) as i32));
        process.locations.push(Location {
            urgency,
            bound,
            rate,
        });
    }
    for source in 0..count {
        let location = process.locations[source];
        if location.urgency != Urgency::Normal {
            let exit = edge(
                random,
                family,
                net,
                &process.locations,
                source,
                Role::Exit(0),
            );
            process.edges.push(exit);
        }
        if let Some(bound) = location.bound {
            let exit = Role::Bounded(bound);
            let exit = edge(random, family, net, &process.locations, source, exit);
            process.edges.push(exit);
        }
        for _ in 0..=random.below(3) {
            let role = if random.chance(40) {
                Role::Receiver
            } else {
                Role::Output
            };
            let more = edge(random, family, net, &process.locations, source, role);
            process.edges.push(more);
        }
    }
    process
}

fn rate(random: &mut Random, net: &Net) -> Number {
    match random.below(6) {
        0 => Number::Plus(1, random.below(net.greatest.len())),
        1 => Number::Plus(0, random.below(net.greatest.len())),
        _ => Number::Constant(1 + random.below(3) as i32),
    }
}

#[derive(Clone, Copy)]
enum Role {
    /// Always enabled; leads to this location.
    Exit(usize),
    /// Enabled when the invariant, which bounds this clock by that, gets to its end.
    Bounded((usize, i32)),
    Receiver,
    Output,
}

fn edge(
    random: &mut Random,
    family: Family,
    net: &Net,
    locations: &[Location],
    source: usize,
    role: Role,
) -> Edge {
    let mut edge = Edge {
        source,
        select: None,
        guard: Vec::new(),
        sync: None,
        updates: Vec::new(),
        branches: Vec::new(),
    };
    if random.chance(25) {
        edge.select = Some(1 + random.below(2) as i32);
    }
    match role {
        Role::Exit(_) => {}
        Role::Bounded((clock, most)) => match family {
            Family::Ticking => edge.guard.push(Atom::Clock(clock, Compare::AtLeast, most)),
            _ if random.chance(70) => {
                let least = random.below(most as usize) as i32;
                edge.guard.push(Atom::Clock(clock, Compare::AtLeast, least));
            }
            _ => {}
        },
        Role::Receiver => {
            edge.sync = Some((random.below(net.channels.len()), false));
            let guard = conditions(
                random,
                family,
                net,
                locations[source],
                edge.select.is_some(),
                edge.sync,
            );
            edge.guard.extend(guard);
        }
        Role::Output => {
            if random.chance(50) {
                edge.sync = Some((random.below(net.channels.len()), true));
            }
            let guard = conditions(
                random,
                family,
                net,
                locations[source],
                edge.select.is_some(),
                edge.sync,
            );
            edge.guard.extend(guard);
        }
    }
    if matches!(role, Role::Bounded(_) | Role::Exit(_)) && random.chance(30) {
        let plain: Vec<usize> = (0..net.channels.len())
            .filter(|&channel| !net.channels[channel])
            .collect();
        if !plain.is_empty() {
            edge.sync = Some((plain[random.below(plain.len())], true));
        }
    }
    for _ in 0..random.below(3) {
        edge.updates
            .push(assignment(random, net, edge.select.is_some()));
    }
    let branches = if random.chance(25) { 2 } else { 1 };
    for branch in 0..branches {
        let target = match role {
            Role::Exit(to) if branch == 0 => to,
            _ => random.below(locations.len()),
        };
        let mut updates = Vec::new();
        if random.chance(30) {
            updates.push(assignment(random, net, false));
        }
        if let Some((clock, most)) = locations[target].bound {
            // Mostly the clock is restarted, else the delay goes on from where it was.
            let is_kept = family == Family::Timed && random.chance(40);
            if !is_kept {
                let value = if family == Family::Timed && !net.closes && random.chance(15) {
                    random.below(most as usize) as i32
                } else {
                    0
                };
                updates.push(Assignment::Clock(clock, value));
            }
        }
        let weight = if random.chance(25) {
            Number::Plus(1, random.below(net.greatest.len()))
        } else {
            Number::Constant(1 + random.below(4) as i32)
        };
        edge.branches.push(Branch {
            weight: (!random.chance(10)).then_some(weight),
            guard: Vec::new(),
            sync: None,
            target,
            updates,
        });
    }
    if edge.branches.len() > 1 && random.chance(50) {
        label_legs(random, family, net, locations[source], role, &mut edge);
    }
    edge
}

/// Gives legs guards and synchronisations. The first leg of an edge that must be enabled stays so.
fn label_legs(
    random: &mut Random,
    family: Family,
    net: &Net,
    location: Location,
    role: Role,
    edge: &mut Edge,
) {
    let must_be_enabled = matches!(role, Role::Exit(_) | Role::Bounded(_));
    let is_moved = edge.sync.is_some() && random.chance(70);
    let moved = if is_moved { edge.sync.take() } else { None };
    let may_sync = edge.sync.is_none();
    for (place, leg) in edge.branches.iter_mut().enumerate() {
        leg.sync = moved;
        if place > 0 && may_sync && random.chance(50) {
            let channel = random.below(net.channels.len());
            leg.sync = Some((channel, random.chance(60)));
        }
        let is_free = must_be_enabled && place == 0;
        let is_urgent = leg
            .sync
            .is_some_and(|(channel, sends)| sends && net.channels[channel]);
        if !is_free && (is_urgent || random.chance(50)) {
            leg.guard = conditions(random, family, net, location, false, leg.sync);
        }
        if !is_free && random.chance(10) {
            leg.weight = Some(Number::Constant(0));
        }
    }
}

/// Conditions of an edge or a leg with this synchronisation.
fn conditions(
    random: &mut Random,
    family: Family,
    net: &Net,
    location: Location,
    selects: bool,
    sync: Option<(usize, bool)>,
) -> Vec<Atom> {
    let mut guard = Vec::new();
    let is_receiver = sync.is_some_and(|(_, sends)| !sends);
    let is_urgent = sync.is_some_and(|(channel, sends)| sends && net.channels[channel]);
    // An urgent output that is always enabled lets no time pass.
    let least = usize::from(is_urgent && (net.clocks == 0 || random.chance(50)));
    for _ in 0..least.max(random.below(2)) {
        guard.push(comparison(random, net, selects));
    }
    if net.clocks > 0 && (random.chance(40) || is_urgent) {
        let clock = random.below(net.clocks);
        let constant = random.below(4) as i32;
        let may_close = match family {
            _ if is_receiver => true,
            _ if is_urgent => constant > 0,
            Family::Ticking => false,
            _ => location.bound.is_some() || net.closes && constant > 0,
        };
        let compare = if may_close && random.chance(40) {
            Compare::AtMost
        } else {
            Compare::AtLeast
        };
        guard.push(Atom::Clock(clock, compare, constant));
    }
    if family == Family::Ticking && !is_receiver && !is_urgent {
        // Whatever it does happens at the end of the bound.
        guard.extend(
            location
                .bound
                .map(|(clock, most)| Atom::Clock(clock, Compare::AtLeast, most)),
        );
    }
    guard
}

fn comparison(random: &mut Random, net: &Net, selects: bool) -> Atom {
    let variable = random.below(net.greatest.len());
    let compare = match random.below(3) {
        0 => Compare::AtLeast,
        1 => Compare::AtMost,
        _ => Compare::Equal,
    };
    let number = if selects && random.chance(50) {
        Number::Selected
    } else {
        Number::Constant(random.below(net.greatest[variable] as usize + 1) as i32)
    };
    Atom::Variable(variable, compare, number)
}

fn assignment(random: &mut Random, net: &Net, selects: bool) -> Assignment {
    if net.clocks > 0 && random.chance(25) {
        return Assignment::Clock(random.below(net.clocks), 0);
    }
    let variable = random.below(net.greatest.len());
    let number = match random.below(4) {
        0 if selects => Number::Selected,
        1 => Number::Plus(0, random.below(net.greatest.len())),
        _ => Number::Constant(random.below(3) as i32),
    };
    if random.chance(50) {
        Assignment::Set(variable, number)
    } else {
        Assignment::Add(variable, number)
    }
}

fn query(random: &mut Random, family: Family, net: &Net) -> Query {
    let bound = match family {
        Family::Exponential if random.chance(40) => Bound::Moves(1 + random.below(12) as u32),
        // No move of known moment falls on the bound.
        _ => Bound::HalfUnits(1 + 2 * random.below(4) as u32),
    };
    let path = match random.below(5) {
        0 | 1 => Path::Eventually(condition(random, net, 2)),
        2 | 3 => Path::Always(condition(random, net, 2)),
        _ => Path::Until(condition(random, net, 1), condition(random, net, 2)),
    };
    Query { bound, path }
}

fn condition(random: &mut Random, net: &Net, depth: usize) -> Condition {
    if depth > 0 && random.chance(50) {
        let parts = vec![
            condition(random, net, depth - 1),
            condition(random, net, depth - 1),
        ];
        return if random.chance(50) {
            Condition::All(parts)
        } else {
            Condition::Any(parts)
        };
    }
    match random.below(5) {
        0 | 1 => Condition::Is(comparison(random, net, false)),
        2 if net.clocks > 0 => {
            let compare = if random.chance(50) {
                Compare::AtLeast
            } else {
                Compare::AtMost
            };
            let constant = 1 + random.below(3) as i32;
            Condition::Is(Atom::Clock(random.below(net.clocks), compare, constant))
        }
        _ => {
            let process = random.below(net.processes.len());
            let locations = net.processes[process].locations.len();
            Condition::At(process, random.below(locations))
        }
    }
}
