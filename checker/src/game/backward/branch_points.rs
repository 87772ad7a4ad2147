//! What is won through branch points ([`crate::game::forward::branch_points`]). By an entry, the
//! controller gets into given valuations where at least one leg is possible and all possible legs
//! lead into them.

use crate::zones::Federation;

use crate::game::Player;
use crate::game::backward::winning_sets::Win;
use crate::game::solver::Solver;

impl Solver<'_, '_, '_> {
    /// The valuations from which all legs of an entry that are possible lead into the given
    /// valuations of their targets, and some leg is possible.
    pub(in crate::game) fn before_all<'w>(
        &self,
        legs: impl IntoIterator<Item = (u32, &'w Win)>,
    ) -> Federation {
        let mut into = Federation::empty(self.graph.dimension());
        let mut past = Federation::empty(self.graph.dimension());
        for (leg, hit) in legs {
            let edge = &self.graph.edges[leg as usize];
            into.unite(&self.before(edge, hit));
            past.unite(&self.missing(edge, hit, None));
        }
        into.subtract(&past);
        into
    }

    /// The valuations from which all legs of an entry that are possible lead into valuations that
    /// the seeker is not known to win, and some leg is possible. The controller is the evader.
    pub(in crate::game) fn spoiling_all(&self, legs: &[u32]) -> Federation {
        let mut away = Federation::empty(self.graph.dimension());
        let mut back = Federation::empty(self.graph.dimension());
        for &leg in legs {
            let edge = &self.graph.edges[leg as usize];
            away.unite(&self.spoiling(edge));
            back.unite(&self.won_by_leg(leg, &self.won.win[edge.target as usize]));
        }
        away.subtract(&back);
        away
    }

    /// The valuations from which the environment, as the seeker, gets into some of the target of a
    /// leg by picking it. There are none if the controller may wait in between.
    pub(in crate::game) fn won_by_leg(&self, leg: u32, hit: &Win) -> Federation {
        let edge = &self.graph.edges[leg as usize];
        if self.graph.programs.waits(edge.program) {
            return Federation::empty(self.graph.dimension());
        }
        self.before(edge, hit)
    }

    /// The legs of an entry, each with what is known of its target.
    pub(in crate::game) fn targets_of<'w>(
        &self,
        legs: &[u32],
        known: &'w [Win],
    ) -> impl Iterator<Item = (u32, &'w Win)> {
        legs.iter().map(|&leg| {
            let target = self.graph.edges[leg as usize].target;
            (leg, &known[target as usize])
        })
    }

    /// Whether the controller, which seeks something, gets into won nodes by an entry from
    /// everywhere in a node. It decides this by words alone.
    pub(in crate::game) fn wins_by_an_entry(&self, node: u32) -> bool {
        let is_won = |leg: &u32| {
            let edge = &self.graph.edges[*leg as usize];
            let is_whole = edge.is_total || edge.length == 1;
            is_whole && matches!(self.won.win[edge.target as usize], Win::Everything)
        };
        let is_total = |leg: &u32| self.graph.edges[*leg as usize].is_total;
        let mut entries = self.graph.branch_points.of(node).iter();
        self.seeker == Player::Controller
            && entries.any(|legs| legs.iter().all(is_won) && legs.iter().any(is_total))
    }
}
