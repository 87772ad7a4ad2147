//! Which processes may be in conflict while time stands still. This is computed on demand.
//!
//! A *situation* of a process is its location, and whether its sleeping edges still sleep; the
//! analysis depends on situations only.

use crate::ir::{LocationId, Network};
use crate::zones::{Zone, dbm};

use crate::analysis::dependence::{Footprint, Footprints, Ground, Sleeper, Start};

/// A situation: twice the number of the location among all, plus one if edges sleep.
pub(super) type Situation = u32;

/// What is known about the processes of a network.
#[derive(Debug)]
pub(super) struct Interference {
    footprints: Footprints,
    /// For each process: the number of its first location among all.
    first: Vec<u32>,
    /// For each location: its process.
    owners: Vec<u32>,
    /// What is known for each of the reasons why time stands still.
    tables: [Table; 2],
}

/// What is known for one of the reasons why time stands still.
#[derive(Debug, Default)]
struct Table {
    /// For each location: what keeps those edges asleep that the process may reach.
    sleepers: Vec<Option<Vec<Sleeper>>>,
    /// For each situation: the footprints now and in the future.
    now: Vec<Option<Box<Footprint>>>,
    future: Vec<Option<Box<Footprint>>>,
    /// For two situations of different processes: whether what the second process may do is in
    /// conflict with what the first can do now.
    meets: Vec<Vec<Option<bool>>>,
}

impl Table {
    fn new(locations: usize) -> Table {
        Table {
            sleepers: vec![None; locations],
            now: vec![None; 2 * locations],
            future: vec![None; 2 * locations],
            meets: vec![Vec::new(); 2 * locations],
        }
    }
}

impl Interference {
    pub(super) fn new(network: &Network) -> Interference {
        let (mut first, mut owners) = (Vec::new(), Vec::new());
        for (index, process) in (0..).zip(&network.processes) {
            first.push(owners.len() as u32);
            owners.resize(owners.len() + process.locations.len(), index);
        }
        Interference {
            footprints: Footprints::default(),
            first,
            tables: std::array::from_fn(|_| Table::new(owners.len())),
            owners,
        }
    }

    /// For each process: its situation in a state with these words and this zone.
    pub(super) fn situations(
        &mut self,
        ground: Ground<'_>,
        words: &[i32],
        zone: &Zone,
        out: &mut Vec<Situation>,
    ) {
        out.clear();
        for (process, &location) in words[..self.first.len()].iter().enumerate() {
            let number = self.first[process] + location as u32;
            let sleeps = |one: &Sleeper| !dbm::satisfies(zone.bounds(), zone.dimension(), one);
            let sleepers = self.sleepers(ground, number);
            let are_asleep = !sleepers.is_empty() && sleepers.iter().all(sleeps);
            out.push(2 * number + u32::from(are_asleep));
        }
    }

    fn sleepers(&mut self, ground: Ground<'_>, location: u32) -> &[Sleeper] {
        let still = ground.still;
        if self.tables[still as usize].sleepers[location as usize].is_none() {
            let found = self.future(ground, 2 * location).sleepers.clone();
            self.tables[still as usize].sleepers[location as usize] = Some(found);
        }
        self.tables[still as usize].sleepers[location as usize]
            .as_deref()
            .unwrap_or_default()
    }

    /// Whether what a process in the situation `other` may do is in conflict with what a process in
    /// the situation `member` can do now.
    #[inline]
    pub(super) fn meets(
        &mut self,
        ground: Ground<'_>,
        member: Situation,
        other: Situation,
    ) -> bool {
        let row = &self.tables[ground.still as usize].meets[member as usize];
        match row.get(other as usize) {
            Some(&Some(known)) => known,
            _ => self.learn(ground, member, other),
        }
    }

    #[cold]
    fn learn(&mut self, ground: Ground<'_>, member: Situation, other: Situation) -> bool {
        let still = ground.still;
        self.now(ground, member);
        self.future(ground, other);
        let situations = 2 * self.owners.len();
        let table = &mut self.tables[still as usize];
        let now = &table.now[member as usize];
        let future = &table.future[other as usize];
        let meets = now
            .iter()
            .zip(future)
            .any(|(now, future)| now.meets(future, still));
        let row = &mut table.meets[member as usize];
        row.resize(situations, None);
        row[other as usize] = Some(meets);
        meets
    }

    /// What a process in the situation can do now.
    pub(super) fn now(&mut self, ground: Ground<'_>, situation: Situation) -> &Footprint {
        let start = self.start(situation);
        let footprints = &mut self.footprints;
        self.tables[ground.still as usize].now[situation as usize]
            .get_or_insert_with(|| Box::new(footprints.now(ground, start)))
    }

    /// What a process in the situation may do while time stands still.
    pub(super) fn future(&mut self, ground: Ground<'_>, situation: Situation) -> &Footprint {
        let start = self.start(situation);
        let footprints = &mut self.footprints;
        self.tables[ground.still as usize].future[situation as usize]
            .get_or_insert_with(|| Box::new(footprints.future(ground, start)))
    }

    fn start(&self, situation: Situation) -> Start {
        let number = situation / 2;
        let process = self.owners[number as usize] as usize;
        Start {
            process,
            location: LocationId(number - self.first[process]),
            is_asleep: situation % 2 == 1,
        }
    }
}
