//! An optimiser that knows nothing of drives: points of a unit cube in, what they come to back, a front of those that none beats.
//!
//! A scan with a low-discrepancy sequence (M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018) comes first, then
//! steps of two kinds in turns that chance decides: differential evolution (R. Storn, K. Price, Journal of Global Optimization 11, 1997,
//! 341-359), and simulated binary crossover with polynomial mutation (K. Deb, R. B. Agrawal, Complex Systems 9, 1995, 115-148; K. Deb,
//! M. Goyal, Computer Science and Informatics 26, 1996, 30-45). Compared is with limits as by K. Deb (IEEE Transactions on Evolutionary
//! Computation 6, 2002, 182-197): a point within all limits beats one beyond, and of two beyond the one that is less so. What nobody beats is
//! kept in an archive, from which most steps begin. Either kind alone finds less in as many steps (docs/studies.md).
//!
//! If half of the evaluations found nothing within all limits, each limit gets a population of its own: there a point that exceeds the other
//! limits less is better, and of two that exceed them equally the one that exceeds this limit less.

use serde::{Deserialize, Serialize};

use crate::front::Front;
use crate::random::Stream;

/// Points that evolve.
const POPULATION: usize = 48;

/// Points of the archive at most.
pub(crate) const MOST_OF_FRONT: usize = 100;

/// Of the steps, the share that begins in the archive, where it has points.
const FROM_ARCHIVE: f64 = 0.9;

/// Of the steps for a limit that is relaxed, the share that begins at its best point.
const FROM_BEST: f64 = 0.5;

/// Points of a limit that is relaxed that are judged anew, at least: as many as steps need.
const LEAST_JUDGED_ANEW: usize = 8;

/// Distribution indices of crossover and mutation: the larger, the nearer children stay to their parents. Twice those of
/// K. Deb's NSGA-II: parents from the archive are near to the front already.
const CROSSOVER_INDEX: f64 = 30.0;
const MUTATION_INDEX: f64 = 40.0;

/// What a point comes to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Judged {
    /// What is to be least.
    pub objectives: Vec<f64>,
    /// How far each limit is exceeded, as a share of it; 0 where it is kept.
    pub violations: Vec<f64>,
}

/// A point with what it comes to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Point {
    /// Where in the unit cube.
    pub place: Vec<f64>,
    /// What it comes to.
    pub judged: Judged,
    /// Whatever else is known of it.
    pub values: Vec<f64>,
}

impl Point {
    /// About what it takes in memory beside itself.
    pub(crate) fn bytes(&self) -> usize {
        let Judged { violations, objectives } = &self.judged;
        [&self.place, violations, objectives, &self.values].iter().map(|of| size_of_val(of.as_slice())).sum()
    }
}

/// How long each stage is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Plan {
    /// Dimensions of the cube.
    pub dimensions: usize,
    /// Limits.
    pub limits: usize,
    /// Where the scan begins in its sequence.
    pub scan_from: u64,
    /// Points of the scan.
    pub scan: u64,
    /// Points altogether.
    pub evaluations: u64,
}

/// The optimiser: asked for a point, told what it comes to.
#[derive(Debug, Clone)]
pub struct Optimiser {
    plan: Plan,
    stream: Stream,
    shift: Vec<f64>,
    /// Points that come first, each with the population that it begins in.
    given: Vec<(usize, Vec<f64>)>,
    asked: u64,
    scanned: u64,
    /// The one that keeps all limits, then, once they are needed, one for each limit that is relaxed.
    populations: Vec<Vec<Point>>,
    archive: Front,
    /// Of each limit, the point that exceeds it least and keeps all others.
    relaxations: Vec<Option<Point>>,
    nearest: Option<Point>,
    /// The population that the point asked for last is for, and the member whose place it may take.
    population: usize,
    parent: Option<usize>,
}

impl Judged {
    fn is_good(&self) -> bool {
        self.violations.iter().all(|&violation| violation <= 0.0)
    }

    /// How far the limits are exceeded together, the relaxed one apart, and how far that one is.
    fn beyond(&self, relaxed: Option<usize>) -> (f64, f64) {
        let own = relaxed.map_or(0.0, |limit| self.violations[limit]);
        let others = self.violations.iter().enumerate().filter(|&(limit, _)| Some(limit) != relaxed);
        (others.map(|(_, violation)| violation).sum(), own)
    }

    /// Whether it is nowhere worse, and somewhere better or the same everywhere.
    fn covers(&self, other: &Self) -> bool {
        self.objectives.iter().zip(&other.objectives).all(|(one, other)| one <= other)
    }

    /// Whether it takes the place of another one.
    fn is_no_worse(&self, other: &Self, relaxed: Option<usize>) -> bool {
        let (own, others) = (self.beyond(relaxed), other.beyond(relaxed));
        if own > (0.0, 0.0) || others > (0.0, 0.0) { own <= others } else { !other.covers(self) || self.covers(other) }
    }
}

impl Optimiser {
    /// A run of its own, from a seed; points that are given come first.
    pub fn new(plan: Plan, given: Vec<Vec<f64>>, seed: u64, stream: u64) -> Self {
        let mut shifts = Stream::new(seed, u64::MAX);
        Self {
            shift: (0..plan.dimensions).map(|_| shifts.share()).collect(),
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

    /// Whether the points asked for next are those of the scan, which nothing has led to.
    pub fn is_scanning(&self) -> bool {
        self.given.is_empty() && self.scanned < self.plan.scan
    }

    /// Whether all points were asked for.
    pub const fn is_over(&self) -> bool {
        self.asked >= self.plan.evaluations
    }

    /// The limit that a population relaxes.
    const fn relaxed(population: usize) -> Option<usize> {
        population.checked_sub(1)
    }

    /// The population whose turn it is: that which keeps all limits, or, where nothing good was found for long, those of the limits in turns.
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

    /// The next point.
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

    /// Those of the population whose turn it is.
    fn members(&self) -> &[Point] {
        &self.populations[self.population]
    }

    /// A point of the sequence: multiples of the powers of 1/φ, `φ^(d+1) = φ + 1`, shifted, modulo 1.
    fn scan_point(&self, index: u64) -> Vec<f64> {
        let dimensions = i32::try_from(self.plan.dimensions).unwrap_or(i32::MAX);
        let mut phi = 1.5_f64;
        // A contraction: after these steps nothing changes.
        for _ in 0..64 {
            phi = (1.0 + phi).powf(1.0 / f64::from(dimensions.saturating_add(1)));
        }
        let steps = (1..=dimensions).map(|power| phi.powi(-power));
        steps.zip(&self.shift).map(|(step, shift)| (shift + (index + 1) as f64 * step).fract()).collect()
    }

    fn offspring(&mut self) -> Vec<f64> {
        let target = self.stream.below(self.members().len());
        self.parent = Some(target);
        // For one limit there are few steps, and those of the population are the more varied ones.
        if self.population == 0 && self.stream.share() < 0.5 { self.crossed() } else { self.differed(target) }
    }

    /// Where a step begins: mostly at the best that are known.
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

    /// Between and around two points, here and there a little off.
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

    /// From a point along the difference of two others, as far as it is taken over into a member of the population.
    fn differed(&mut self, target: usize) -> Vec<f64> {
        let count = self.members().len();
        let base = self.begin();
        let (one, other) = (self.stream.below(count), self.stream.below(count));
        let from_archive = self.archive.points().len() > 8 && self.stream.share() < 0.5;
        let archive = if from_archive { self.archive.points() } else { &[] };
        let place = |index: usize| archive.get(index).unwrap_or(&self.members()[index]).place.clone();
        let (one, other) = (place(one), place(other));
        let scale = 0.1 + 0.8 * self.stream.share();
        let crossing = if self.stream.share() < 0.5 { 0.9 } else { 0.3 };
        let forced = self.stream.below(self.plan.dimensions);
        let mut child = self.members()[target].place.clone();
        for axis in 0..self.plan.dimensions {
            if axis == forced || self.stream.share() < crossing {
                let moved = base[axis] + scale * (one[axis] - other[axis]);
                // Beyond an end of the cube, somewhere between that end and where the step began.
                child[axis] = if moved < 0.0 {
                    base[axis] * self.stream.share()
                } else if moved > 1.0 {
                    1.0 - (1.0 - base[axis]) * self.stream.share()
                } else {
                    moved
                };
            }
        }
        // Choices of few values hold a difference still: now and then an axis is drawn anew.
        if self.stream.share() < 0.1 {
            child[forced] = self.stream.share();
        }
        child
    }

    /// What the point asked for last comes to; nothing where it is impossible.
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
            // Of the scan the best begin: each takes the place of the worst.
            None => {
                let worst = members.iter_mut().max_by(|one, other| order(beyond(one), beyond(other)));
                if let Some(worst) = worst.filter(|worst| beyond(&point) < beyond(worst)) {
                    *worst = point;
                }
            }
        }
    }

    /// Begins again from the best points, to be judged anew, with so many more after them.
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

    /// The points that nobody beats.
    pub fn front(&self) -> &[Point] {
        self.archive.points()
    }

    /// Of each limit, the point that exceeds it least and keeps all others.
    pub fn relaxations(&self) -> &[Option<Point>] {
        &self.relaxations
    }

    /// The point that exceeds limits least.
    pub const fn nearest(&self) -> Option<&Point> {
        self.nearest.as_ref()
    }
}

fn order(one: (f64, f64), other: (f64, f64)) -> std::cmp::Ordering {
    one.0.total_cmp(&other.0).then(one.1.total_cmp(&other.1))
}

/// How far apart two children of a crossing lie, over the distance of their parents, at a share of the probability.
fn spread(share: f64) -> f64 {
    let times = if share <= 0.5 { 2.0 * share } else { 0.5 / (1.0 - share) };
    times.powf(1.0 / (CROSSOVER_INDEX + 1.0))
}

/// By how much of its range a mutation moves a coordinate, at a share of the probability.
fn offset(share: f64) -> f64 {
    let off = |share: f64| 1.0 - (2.0 * share).powf(1.0 / (MUTATION_INDEX + 1.0));
    if share < 0.5 { -off(share) } else { off(1.0 - share) }
}

/// The front of several. Whoever merges gives them by their numbers, since it depends on their order: so that the front of more islands is that
/// of fewer with points added.
pub fn merged(fronts: impl IntoIterator<Item = Point>) -> Vec<Point> {
    let mut front = Front::new(2 * MOST_OF_FRONT);
    for point in fronts {
        front.insert(point);
    }
    front.into_sorted()
}

#[cfg(test)]
mod tests {
    use super::{CROSSOVER_INDEX, Judged, MUTATION_INDEX, Optimiser, Plan, Point, offset, spread};

    /// By Deb and Agrawal the density of the spread is `(η + 1) β^η / 2` below 1 and `(η + 1) / (2 β^(η + 2))` above.
    #[test]
    fn crossover_spread_is_symmetric() {
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

    /// By Deb and Goyal the density of the offset is `(η + 1) (1 - |δ|)^η / 2`.
    #[test]
    fn mutation_offset_is_symmetric_and_fills_range() {
        assert!((offset(0.0) + 1.0).abs() < 1e-15 && offset(0.5).abs() < 1e-15);
        for share in [0.01, 0.1, 0.3, 0.45] {
            assert!((offset(share) + offset(1.0 - share)).abs() < 1e-12);
            assert!((0.5 * (1.0 + offset(share)).powf(MUTATION_INDEX + 1.0) - share).abs() < 1e-12);
        }
    }

    /// If all points lie on one face of the cube, children lie there too, except for mutations.
    #[test]
    fn child_keeps_shared_coordinates_and_stays_in_cube() {
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
        // A quarter is mutated. Half is crossed, and half of that has unlike parents.
        assert!(moved.abs_diff(TRIES / 4) < 120, "{moved}");
        assert!(crossed.abs_diff(TRIES * 7 / 16) < 130, "{crossed}");
    }
}
