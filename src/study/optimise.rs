//! A general optimiser: it proposes points of a unit cube, receives their objectives, and returns the Pareto front.
//!
//! It starts with a scan of a low-discrepancy sequence (M. Roberts, "The unreasonable effectiveness of quasirandom
//! sequences", 2018). Then it takes random steps of three kinds. One is differential evolution (R. Storn, K. Price,
//! Journal of Global Optimization 11, 1997, 341-359). One is simulated binary crossover with polynomial mutation (K.
//! Deb, R. B. Agrawal, Complex Systems 9, 1995, 115-148; K. Deb, M. Goyal, Computer Science and Informatics 26, 1996,
//! 30-45). Once there is a front, half of the steps are differential evolution among near points of it (H. Li, Q. Zhang,
//! IEEE Transactions on Evolutionary Computation 13, 2009, 284-302). Limits are handled as by K. Deb (the same journal
//! 6, 2002, 182-197): a feasible point beats an infeasible one, and the smaller violation beats the larger one. An
//! archive keeps the non-dominated points, and most steps start there. Each kind of step alone finds less in as many
//! steps (benches/results/searches.md).
//!
//! If half of the evaluations found no feasible point, each limit gets its own population. There the smaller violation
//! of the other limits is better, then the smaller violation of this limit.

use crate::front::Front;
use crate::point::{Judged, Point};
use crate::random::Stream;

/// Size of a population.
const POPULATION: usize = 48;

/// Largest size of the archive.
pub(crate) const MOST_OF_FRONT: usize = 100;

/// Fraction of the steps that start in the archive, if it has points.
const FROM_ARCHIVE: f64 = 0.9;

/// Number of near points of the archive among which a step takes its difference, and the fraction of such steps.
const NEAR: usize = 16;
const AMONG_NEAR: f64 = 0.5;

/// Fraction of the steps for a relaxed limit that start at its best point.
const FROM_BEST: f64 = 0.5;

/// Fewest points of a relaxed limit that are evaluated again: as many as the steps need.
const LEAST_JUDGED_ANEW: usize = 8;

/// Distribution indices of crossover and mutation. A larger index keeps children nearer to their parents. They are
/// twice those of K. Deb's NSGA-II, because parents from the archive are already near the front.
const CROSSOVER_INDEX: f64 = 30.0;
const MUTATION_INDEX: f64 = 40.0;

/// Lengths of the stages.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    /// Dimensions of the cube.
    pub dimensions: usize,
    /// Number of limits.
    pub limits: usize,
    /// Index of the scan's first point in its sequence.
    pub scan_from: u64,
    /// Number of points of the scan.
    pub scan: u64,
    /// Number of all points.
    pub evaluations: u64,
}

/// The optimiser. `ask` proposes a point, and `tell` receives its evaluation.
#[derive(Debug, Clone)]
pub struct Optimiser {
    plan: Plan,
    stream: Stream,
    shift: Vec<f64>,
    /// Steps of the scan along each axis.
    steps: Vec<f64>,
    /// First points, each with its population.
    given: Vec<(usize, Vec<f64>)>,
    asked: u64,
    scanned: u64,
    /// The population for all limits. Later also one for each relaxed limit.
    populations: Vec<Vec<Point>>,
    archive: Front,
    /// For each limit, the point that meets all other limits and violates this one least.
    relaxations: Vec<Option<Point>>,
    nearest: Option<Point>,
    /// The population of the last proposed point, and the member that it may replace.
    population: usize,
    parent: Option<usize>,
}

impl Optimiser {
    /// Starts a run with a seed. The given points come first.
    pub fn new(plan: Plan, given: Vec<Vec<f64>>, seed: u64, stream: u64) -> Self {
        let mut shifts = Stream::new(seed, u64::MAX);
        Self {
            shift: (0..plan.dimensions).map(|_| shifts.share()).collect(),
            steps: scan_steps(plan.dimensions),
            stream: Stream::new(seed, stream),
            relaxations: vec![None; plan.limits],
            plan,
            given: given.into_iter().map(|place| (0, place)).collect(),
            asked: 0,
            scanned: 0,
            populations: vec![Vec::new()],
            archive: Front::new(MOST_OF_FRONT),
            nearest: None,
            population: 0,
            parent: None,
        }
    }

    /// True while the next points belong to the scan and do not depend on evaluations.
    pub fn is_scanning(&self) -> bool {
        self.given.is_empty() && self.scanned < self.plan.scan
    }

    /// True if all points were proposed.
    pub const fn is_over(&self) -> bool {
        self.asked >= self.plan.evaluations
    }

    /// Returns the limit that a population relaxes.
    const fn relaxed(population: usize) -> Option<usize> {
        population.checked_sub(1)
    }

    /// Returns the population of the next step. If half of the evaluations found no feasible point, the populations of
    /// the limits take turns.
    fn next_population(&mut self) -> usize {
        let is_late = 2 * self.asked > self.plan.evaluations;
        if self.plan.limits == 0 || !is_late || !self.archive.points().is_empty() {
            return 0;
        }
        if self.populations.len() == 1 {
            self.populations = vec![self.populations.swap_remove(0); 1 + self.plan.limits];
        }
        1 + usize::try_from(self.asked % self.plan.limits as u64).unwrap_or_default()
    }

    /// Proposes the next point.
    pub fn ask(&mut self) -> Vec<f64> {
        self.asked += 1;
        self.parent = None;
        self.population = 0;
        if let Some((population, place)) = self.given.pop() {
            self.population = population;
            return place;
        }
        if self.scanned < self.plan.scan {
            self.scanned += 1;
            return self.scan_point(self.plan.scan_from + self.scanned - 1);
        }
        self.population = self.next_population();
        if self.members().len() < 4 {
            return (0..self.plan.dimensions).map(|_| self.stream.share()).collect();
        }
        self.offspring()
    }

    /// Returns the current population.
    fn members(&self) -> &[Point] {
        &self.populations[self.population]
    }

    /// Returns a point of the sequence: multiples of the steps, shifted, modulo 1.
    fn scan_point(&self, index: u64) -> Vec<f64> {
        self.steps.iter().zip(&self.shift).map(|(step, shift)| (shift + (index + 1) as f64 * step).fract()).collect()
    }

    fn offspring(&mut self) -> Vec<f64> {
        if self.archive.points().len() >= NEAR && self.stream.share() < AMONG_NEAR {
            return self.differed_among_near();
        }
        let target = self.stream.below(self.members().len());
        self.parent = Some(target);
        // A limit's own population gets few steps, and differential evolution varies more.
        if self.population == 0 && self.stream.share() < 0.5 { self.crossed() } else { self.differed(target) }
    }

    /// Returns the start of a step: mostly one of the best known points.
    fn begin(&mut self) -> Vec<f64> {
        let archive = self.archive.points();
        if !archive.is_empty() && self.stream.share() < FROM_ARCHIVE {
            return archive[self.stream.below(archive.len())].place.clone();
        }
        let members = &self.populations[self.population];
        let chosen = self.stream.below(members.len());
        match Self::relaxed(self.population) {
            Some(_) if self.stream.share() < FROM_BEST => {
                let by = |point: &&Point| point.judged.beyond(Self::relaxed(self.population));
                let best = members.iter().min_by(|one, other| order(by(one), by(other)));
                best.unwrap_or(&members[chosen]).place.clone()
            }
            _ => members[chosen].place.clone(),
        }
    }

    /// Crossover of two points with mutation.
    fn crossed(&mut self) -> Vec<f64> {
        let (mut child, other) = (self.begin(), self.begin());
        for (own, other) in child.iter_mut().zip(other) {
            if self.stream.share() < 0.5 {
                let spread = spread(self.stream.share());
                *own = 0.5 * ((1.0 + spread) * *own + (1.0 - spread) * other);
            }
            if self.stream.below(self.plan.dimensions) == 0 {
                *own += offset(self.stream.share());
            }
            *own = own.clamp(0.0, 1.0);
        }
        child
    }

    /// Differential evolution: a point plus a scaled difference of two others, crossed with a member of the population.
    fn differed(&mut self, target: usize) -> Vec<f64> {
        let count = self.members().len();
        let base = self.begin();
        let two = [self.stream.below(count), self.stream.below(count)];
        let [one, other] = two.map(|index| self.members()[index].place.clone());
        let scale = 0.1 + 0.8 * self.stream.share();
        let crossing = if self.stream.share() < 0.5 { 0.9 } else { 0.3 };
        let forced = self.stream.below(self.plan.dimensions);
        let mut child = self.members()[target].place.clone();
        for axis in 0..self.plan.dimensions {
            if axis == forced || self.stream.share() < crossing {
                let moved = base[axis] + scale * (one[axis] - other[axis]);
                // Beyond a face of the cube: a random point between that face and the start.
                child[axis] = if moved < 0.0 {
                    base[axis] * self.stream.share()
                } else if moved > 1.0 {
                    1.0 - (1.0 - base[axis]) * self.stream.share()
                } else {
                    moved
                };
            }
        }
        // A choice with few values can make all differences zero, so sometimes an axis is random.
        if self.stream.share() < 0.1 {
            child[forced] = self.stream.share();
        }
        child
    }

    /// Differential evolution along the front: a point of the archive plus a scaled difference of two near it. Such
    /// differences shrink with the gaps of the front, and mostly stay at one combination of whole numbers.
    fn differed_among_near(&mut self) -> Vec<f64> {
        let archive = self.archive.points();
        let base = &archive[self.stream.below(archive.len())].place;
        let distance = |place: &[f64]| place.iter().zip(base).map(|(one, other)| (one - other).powi(2)).sum::<f64>();
        let mut near: Vec<_> = archive.iter().map(|point| distance(&point.place)).enumerate().collect();
        let by = |one: &(usize, f64), other: &(usize, f64)| one.1.total_cmp(&other.1).then(one.0.cmp(&other.0));
        near.select_nth_unstable_by(NEAR - 1, by);
        near[..NEAR].sort_unstable_by(by);
        let one = self.stream.below(NEAR);
        let other = (one + 1 + self.stream.below(NEAR - 1)) % NEAR;
        let scale = 0.1 + 0.8 * self.stream.share();
        let [one, other] = [one, other].map(|at| &archive[near[at].0].place);
        let difference = one.iter().zip(other).map(|(one, other)| scale * (one - other));
        base.iter().zip(difference).map(|(at, difference)| (at + difference).clamp(0.0, 1.0)).collect()
    }

    /// Returns true if the last proposed point cannot improve the search, given lower bounds of its violations: [`Self::tell`] would
    /// change nothing.
    pub fn cannot_improve(&self, least: &Judged) -> bool {
        let is_nearer = |nearest: &Point| least.beyond(None) < nearest.judged.beyond(None);
        let mut exceeded = least.violations.iter().enumerate().filter(|(_, violation)| **violation > 0.0);
        let is_relaxation = match (exceeded.next(), exceeded.next()) {
            (None, _) => return false,
            (Some((limit, &violation)), None) => {
                self.relaxations[limit].as_ref().is_none_or(|before| violation < before.judged.violations[limit])
            }
            _ => false,
        };
        let relaxed = Self::relaxed(self.population);
        let members = self.members();
        let (own, beyond) = (least.beyond(relaxed), |member: &Point| member.judged.beyond(relaxed));
        let is_worse = match self.parent {
            Some(parent) => own > beyond(&members[parent]),
            None => members.len() >= POPULATION && members.iter().all(|member| own >= beyond(member)),
        };
        is_worse && !is_relaxation && !self.nearest.as_ref().is_none_or(is_nearer)
    }

    /// Receives the evaluation of the last proposed point, or none if it is impossible.
    pub fn tell(&mut self, point: Option<Point>) {
        let Some(point) = point else { return };
        if point.judged.is_good() {
            self.archive.insert(point.clone());
        } else {
            let beyond = point.judged.beyond(None);
            if self.nearest.as_ref().is_none_or(|nearest| beyond < nearest.judged.beyond(None)) {
                self.nearest = Some(point.clone());
            }
            let mut exceeded = point.judged.violations.iter().enumerate().filter(|(_, violation)| **violation > 0.0);
            if let (Some((limit, &violation)), None) = (exceeded.next(), exceeded.next()) {
                let least = self.relaxations[limit].as_ref().map(|before| before.judged.violations[limit]);
                if least.is_none_or(|least| violation < least) {
                    self.relaxations[limit] = Some(point.clone());
                }
            }
        }
        let relaxed = Self::relaxed(self.population);
        let members = &mut self.populations[self.population];
        let beyond = |point: &Point| point.judged.beyond(relaxed);
        match self.parent.take() {
            Some(parent) => {
                if point.judged.is_no_worse(&members[parent].judged, relaxed) {
                    members[parent] = point;
                }
            }
            None if members.len() < POPULATION => members.push(point),
            // Only the best points of the scan stay: each replaces the worst.
            None => {
                let worst = members.iter_mut().max_by(|one, other| order(beyond(one), beyond(other)));
                if let Some(worst) = worst.filter(|worst| beyond(&point) < beyond(worst)) {
                    *worst = point;
                }
            }
        }
    }

    /// Restarts from the best points, which are evaluated again, with `more` points after them.
    pub fn judge_anew(&mut self, more: u64) {
        let mut populations = std::mem::replace(&mut self.populations, vec![Vec::new()]);
        if self.archive.points().is_empty() && populations.len() > 1 {
            self.populations.resize(populations.len(), Vec::new());
            let each = (POPULATION / self.plan.limits).max(LEAST_JUDGED_ANEW);
            for (population, members) in populations.iter_mut().enumerate().skip(1) {
                let by = |point: &Point| point.judged.beyond(Self::relaxed(population));
                members.sort_by(|one, other| order(by(one), by(other)));
                self.given.extend(members.drain(..).take(each).map(|point| (population, point.place)));
            }
        } else {
            let main = populations.swap_remove(0).into_iter().chain(self.archive.take());
            self.given.extend(main.map(|point| (0, point.place)));
        }
        let nearest = self.relaxations.iter_mut().filter_map(Option::take).chain(self.nearest.take());
        self.given.extend(nearest.map(|point| (0, point.place)));
        self.plan.evaluations = self.asked + self.given.len() as u64 + more;
    }

    /// Returns the non-dominated points.
    pub fn front(&self) -> &[Point] {
        self.archive.points()
    }

    /// Returns, for each limit, the point that meets all others and violates this one least.
    pub fn relaxations(&self) -> &[Option<Point>] {
        &self.relaxations
    }

    /// Returns the point with the smallest violation.
    pub const fn nearest(&self) -> Option<&Point> {
        self.nearest.as_ref()
    }
}

/// Returns the powers of 1/φ with `φ^(d+1) = φ + 1`.
fn scan_steps(dimensions: usize) -> Vec<f64> {
    let dimensions = i32::try_from(dimensions).unwrap_or(i32::MAX);
    let mut phi = 1.5_f64;
    // The iteration is a contraction and has converged after these steps.
    for _ in 0..64 {
        phi = (1.0 + phi).powf(1.0 / f64::from(dimensions.saturating_add(1)));
    }
    (1..=dimensions).map(|power| phi.powi(-power)).collect()
}

fn order(one: (f64, f64), other: (f64, f64)) -> std::cmp::Ordering {
    one.0.total_cmp(&other.0).then(one.1.total_cmp(&other.1))
}

/// Returns the distance of two children over the distance of their parents, at this quantile.
fn spread(share: f64) -> f64 {
    let times = if share <= 0.5 { 2.0 * share } else { 0.5 / (1.0 - share) };
    times.powf(1.0 / (CROSSOVER_INDEX + 1.0))
}

/// Returns the shift of a coordinate by mutation as a fraction of its range, at this quantile.
fn offset(share: f64) -> f64 {
    let off = |share: f64| 1.0 - (2.0 * share).powf(1.0 / (MUTATION_INDEX + 1.0));
    if share < 0.5 { -off(share) } else { off(1.0 - share) }
}

/// Merges several fronts. The result depends on their order. In the order of the islands, more islands give the same
/// front as fewer islands with more points.
pub fn merged(fronts: impl IntoIterator<Item = Point>) -> Vec<Point> {
    let mut front = Front::new(2 * MOST_OF_FRONT);
    for point in fronts {
        front.insert(point);
    }
    front.into_sorted()
}

#[cfg(test)]
mod tests {
    use super::{CROSSOVER_INDEX, MUTATION_INDEX, NEAR, Optimiser, Plan, offset, spread};
    use crate::point::{Judged, Point};

    /// Density of the spread by Deb and Agrawal: `(η + 1) β^η / 2` below 1, and `(η + 1) / (2 β^(η + 2))` above.
    #[test]
    fn crossover_follows_published_distribution() {
        assert!((spread(0.5) - 1.0).abs() < 1e-15);
        for share in [0.01, 0.1, 0.3, 0.45] {
            let (nearer, farther) = (spread(share), spread(1.0 - share));
            assert!((nearer * farther - 1.0).abs() < 1e-12);
            assert!(
                (0.5 * nearer.powf(CROSSOVER_INDEX + 1.0) - share).abs() < 1e-12,
                "the distribution up to {nearer}"
            );
        }
    }

    /// Density of the offset by Deb and Goyal: `(η + 1) (1 - |δ|)^η / 2`.
    #[test]
    fn mutation_follows_published_distribution() {
        assert!((offset(0.0) + 1.0).abs() < 1e-15 && offset(0.5).abs() < 1e-15);
        for share in [0.01, 0.1, 0.3, 0.45] {
            assert!((offset(share) + offset(1.0 - share)).abs() < 1e-12);
            assert!((0.5 * (1.0 + offset(share)).powf(MUTATION_INDEX + 1.0) - share).abs() < 1e-12);
        }
    }

    #[test]
    fn differences_of_near_points_keep_whole_number() {
        let plan = Plan { dimensions: 2, limits: 0, scan_from: 0, scan: 0, evaluations: u64::MAX };
        let mut optimiser = Optimiser::new(plan, Vec::new(), 9, 0);
        for index in 0..2 * NEAR {
            let place = vec![if index < NEAR { 0.25 } else { 0.75 }, index as f64 / (4 * NEAR) as f64];
            let judged = Judged { objectives: vec![place[1], -place[1]], violations: Vec::new() };
            optimiser.tell(Some(Point { place, judged, values: Vec::new() }));
        }
        let children: Vec<_> = (0..1000).map(|_| optimiser.differed_among_near()).collect();
        assert!(children.iter().all(|child| ((child[0] - 0.5).abs() - 0.25).abs() < 1e-15));
        assert!(children.iter().any(|child| child[1] > 0.5));
    }

    /// The first of two limits is known early. Both together cannot be met if the second needs 1.9.
    #[test]
    fn skipping_such_points_changes_nothing() {
        let plan = Plan { dimensions: 2, limits: 2, scan_from: 0, scan: 60, evaluations: 1500 };
        for needed in [1.0, 1.9] {
            let run = |skips: bool| {
                let (mut optimiser, mut skipped) = (Optimiser::new(plan, Vec::new(), 7, 0), 0);
                while !optimiser.is_over() {
                    let is_scanning = optimiser.is_scanning();
                    let place = optimiser.ask();
                    let (early, late) = ((5.0 * place[0] - 3.0).max(0.0), (needed - place[0] - place[1]).max(0.0));
                    let least = Judged { objectives: Vec::new(), violations: vec![early, 0.0] };
                    if skips && !is_scanning && optimiser.cannot_improve(&least) {
                        skipped += 1;
                        optimiser.tell(None);
                        continue;
                    }
                    let judged = Judged { objectives: vec![place[0], place[1]], violations: vec![early, late] };
                    optimiser.tell(Some(Point { place, judged, values: Vec::new() }));
                }
                let Optimiser { archive, relaxations, nearest, populations, .. } = optimiser;
                ((archive.points().to_vec(), relaxations, nearest, populations), skipped)
            };
            let ((all, _), (without, skipped)) = (run(false), run(true));
            assert!(all == without, "needed {needed}, {skipped} skipped");
            assert!(skipped > 20, "{skipped} skipped");
        }
    }

    /// If all points lie on one face of the cube, children lie there too, except for mutations.
    #[test]
    fn children_stay_on_face_of_parents() {
        const TRIES: u32 = 4000;
        let plan = Plan { dimensions: 4, limits: 0, scan_from: 0, scan: 0, evaluations: u64::MAX };
        let mut optimiser = Optimiser::new(plan, Vec::new(), 9, 0);
        for place in [[0.0, 1.0, 0.5, 0.2], [0.0, 1.0, 0.5, 0.7]] {
            let judged = Judged { objectives: vec![place[3], -place[3]], violations: Vec::new() };
            optimiser.tell(Some(Point { place: place.to_vec(), judged, values: Vec::new() }));
        }
        let (mut moved, mut crossed) = (0, 0);
        for _ in 0..TRIES {
            let child = optimiser.crossed();
            assert!(child.iter().all(|at| (0.0..=1.0).contains(at)), "{child:?}");
            let is_at = |axis: usize, place: f64| (child[axis] - place).abs() < 1e-12;
            moved += u32::from(!is_at(2, 0.5));
            crossed += u32::from(!is_at(3, 0.2) && !is_at(3, 0.7));
        }
        // A quarter is mutated. Half is crossed, and half of that has unequal parents.
        assert!(moved.abs_diff(TRIES / 4) < 120, "{moved}");
        assert!(crossed.abs_diff(TRIES * 7 / 16) < 130, "{crossed}");
    }
}
