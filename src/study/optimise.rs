//! An optimiser that knows nothing of drives: points of a unit cube in, what they come to back, a front of those that none beats.
//!
//! A scan with a low-discrepancy sequence (M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018) comes first, then
//! steps of two kinds in turns that chance decides: differential evolution (R. Storn, K. Price, Journal of Global Optimization 11, 1997,
//! 341-359), and simulated binary crossover with polynomial mutation (K. Deb, R. B. Agrawal, Complex Systems 9, 1995, 115-148; K. Deb,
//! M. Goyal, Computer Science and Informatics 26, 1996, 30-45). Compared is with limits as by K. Deb (IEEE Transactions on Evolutionary
//! Computation 6, 2002, 182-197): a point within all limits beats one beyond, and of two beyond the one that is less so. What nobody beats is
//! kept in an archive, from which most steps begin. Either kind alone finds less in as many steps (docs/studies.md).

use serde::{Deserialize, Serialize};

use crate::random::Stream;

/// Points that evolve.
const POPULATION: usize = 48;

/// Points of the archive at most: of more the most crowded goes.
pub(crate) const MOST_OF_FRONT: usize = 100;

/// Of the steps, the share that begins in the archive, where it has points.
const FROM_ARCHIVE: f64 = 0.9;

/// Distribution indices of crossover and mutation: the larger, the nearer children stay to their parents. Those of K. Deb's NSGA-II.
const CROSSOVER_INDEX: f64 = 15.0;
const MUTATION_INDEX: f64 = 20.0;

/// What a limit that is looked past weighs.
const LOOKED_PAST: f64 = 1e-3;

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
    /// Points that come first.
    given: Vec<Vec<f64>>,
    asked: u64,
    scanned: u64,
    population: Vec<Point>,
    archive: Vec<Point>,
    /// Of each limit, the point that exceeds it least and keeps all others.
    relaxations: Vec<Option<Point>>,
    nearest: Option<Point>,
    parent: Option<usize>,
}

impl Judged {
    fn is_good(&self) -> bool {
        self.violations.iter().all(|&violation| violation <= 0.0)
    }

    fn beyond(&self, looked_past: Option<usize>) -> f64 {
        let weighed = |(limit, violation): (usize, &f64)| {
            if looked_past == Some(limit) { LOOKED_PAST * violation } else { *violation }
        };
        self.violations.iter().enumerate().map(weighed).sum()
    }

    /// Whether it is nowhere worse, and somewhere better or the same everywhere.
    fn covers(&self, other: &Self) -> bool {
        self.objectives.iter().zip(&other.objectives).all(|(one, other)| one <= other)
    }

    /// Whether it takes the place of another one.
    fn is_no_worse(&self, other: &Self, looked_past: Option<usize>) -> bool {
        let (own, others) = (self.beyond(looked_past), other.beyond(looked_past));
        if own > 0.0 || others > 0.0 { own <= others } else { !other.covers(self) || self.covers(other) }
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
            given,
            asked: 0,
            scanned: 0,
            population: Vec::new(),
            archive: Vec::new(),
            nearest: None,
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

    /// The limit that is looked past at this time: where nothing good was found for long, each in turn.
    fn looked_past(&self) -> Option<usize> {
        let rest = self.asked.checked_sub(self.plan.evaluations / 2)?;
        let limits = self.plan.limits as u64;
        if !self.archive.is_empty() || limits == 0 {
            return None;
        }
        let each = (self.plan.evaluations.div_ceil(2) / limits).max(1);
        usize::try_from(rest / each).ok().filter(|&limit| limit < self.plan.limits)
    }

    /// The next point.
    pub fn ask(&mut self) -> Vec<f64> {
        self.asked += 1;
        self.parent = None;
        if let Some(given) = self.given.pop() {
            return given;
        }
        if self.scanned < self.plan.scan {
            self.scanned += 1;
            return self.scan_point(self.plan.scan_from + self.scanned - 1);
        }
        if self.population.len() < 4 {
            return (0..self.plan.dimensions).map(|_| self.stream.share()).collect();
        }
        self.offspring()
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
        let target = self.stream.below(self.population.len());
        self.parent = Some(target);
        // Past a limit there are few steps, and those of the population are the more varied ones.
        if self.looked_past().is_none() && self.stream.share() < 0.5 { self.crossed() } else { self.differed(target) }
    }

    /// Where a step begins.
    fn begin(&mut self) -> Vec<f64> {
        let is_archived = !self.archive.is_empty() && self.stream.share() < FROM_ARCHIVE;
        let pool = if is_archived { &self.archive } else { &self.population };
        pool[self.stream.below(pool.len())].place.clone()
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
        let count = self.population.len();
        let base = self.begin();
        let (one, other) = (self.stream.below(count), self.stream.below(count));
        let pool = |index: usize, archive: &[Point], population: &[Point]| match archive.get(index) {
            Some(point) => point.place.clone(),
            None => population[index % population.len()].place.clone(),
        };
        let from_archive = self.archive.len() > 8 && self.stream.share() < 0.5;
        let archive = if from_archive { self.archive.as_slice() } else { &[] };
        let (one, other) = (pool(one, archive, &self.population), pool(other, archive, &self.population));
        let scale = 0.1 + 0.8 * self.stream.share();
        let crossing = if self.stream.share() < 0.5 { 0.9 } else { 0.3 };
        let forced = self.stream.below(self.plan.dimensions);
        let mut child = self.population[target].place.clone();
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
            insert(&mut self.archive, point.clone());
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
        let looked_past = self.looked_past();
        match self.parent.take() {
            Some(parent) => {
                if point.judged.is_no_worse(&self.population[parent].judged, looked_past) {
                    self.population[parent] = point;
                }
            }
            None if self.population.len() < POPULATION => self.population.push(point),
            // Of the scan the best begin: each takes the place of the worst.
            None => {
                let beyond = |point: &Point| point.judged.beyond(looked_past);
                let worst = (0..POPULATION)
                    .max_by(|&one, &other| beyond(&self.population[one]).total_cmp(&beyond(&self.population[other])));
                if let Some(worst) = worst.filter(|&worst| beyond(&point) < beyond(&self.population[worst])) {
                    self.population[worst] = point;
                }
            }
        }
    }

    /// Begins again from the same points, to be judged anew, with so many more after them.
    pub fn judge_anew(&mut self, more: u64) {
        self.given.extend(self.population.drain(..).chain(self.archive.drain(..)).map(|point| point.place));
        self.given.extend(self.relaxations.iter_mut().filter_map(Option::take).map(|point| point.place));
        self.given.extend(self.nearest.take().map(|point| point.place));
        self.plan.evaluations = self.asked + self.given.len() as u64 + more;
    }

    /// The points that nobody beats.
    pub fn front(&self) -> &[Point] {
        &self.archive
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

/// Adds a point to a front, if nothing there is as good, and takes away what it beats.
pub(crate) fn insert(front: &mut Vec<Point>, point: Point) {
    if front.iter().any(|other| other.judged.covers(&point.judged)) {
        return;
    }
    front.retain(|other| !point.judged.covers(&other.judged));
    front.push(point);
    thin(front, MOST_OF_FRONT);
}

/// Takes the most crowded away until no more than so many are left; the ends of each objective stay.
pub(crate) fn thin(front: &mut Vec<Point>, most: usize) {
    let mut rooms = Vec::new();
    let mut before = Vec::new();
    while front.len() > most {
        let ranges = ranges(front);
        // What was measured by other ranges is measured anew; else only what the last to go was nearest to.
        let is_new = ranges != before;
        if is_new {
            rooms.clear();
            rooms.extend((0..front.len()).map(|index| Room::of(index, front, &ranges)));
            before.clone_from(&ranges);
        }
        let is_end = |point: &Point| {
            ranges.iter().zip(&point.judged.objectives).any(|(Span { least, .. }, value)| value <= least)
        };
        let inner = (0..front.len()).filter(|&index| !is_end(&front[index]));
        // Of equal ones the later.
        let crowded =
            inner.min_by(|&one, &other| rooms[one].squared.total_cmp(&rooms[other].squared).then(other.cmp(&one)));
        let Some(crowded) = crowded else {
            front.truncate(most);
            return;
        };
        front.remove(crowded);
        rooms.remove(crowded);
        for (index, room) in rooms.iter_mut().enumerate() {
            match room.nearest {
                Some(nearest) if nearest == crowded => *room = Room::of(index, front, &ranges),
                Some(nearest) if nearest > crowded => room.nearest = Some(nearest - 1),
                _ => {}
            }
        }
    }
}

/// Where the values of an objective lie.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Span {
    least: f64,
    width: f64,
}

fn ranges(front: &[Point]) -> Vec<Span> {
    let objectives = front.first().map_or(0, |point| point.judged.objectives.len());
    let range = |objective: usize| {
        let values = front.iter().map(|point| point.judged.objectives[objective]);
        let (least, largest) = values
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(least, largest), value| (least.min(value), largest.max(value)));
        Span { least, width: (largest - least).max(f64::MIN_POSITIVE) }
    };
    (0..objectives).map(range).collect()
}

/// How far a point of a front is from the nearest other one.
#[derive(Debug, Clone, Copy)]
struct Room {
    /// The square of the distance, objectives over their ranges.
    squared: f64,
    nearest: Option<usize>,
}

impl Room {
    fn of(index: usize, front: &[Point], ranges: &[Span]) -> Self {
        let own = &front[index].judged.objectives;
        let mut room = Self { squared: f64::INFINITY, nearest: None };
        for (other, point) in front.iter().enumerate().filter(|&(other, _)| other != index) {
            let pairs = own.iter().zip(&point.judged.objectives).zip(ranges);
            let squared = pairs.map(|((one, other), range)| ((one - other) / range.width).powi(2)).sum();
            if squared < room.squared {
                room = Self { squared, nearest: Some(other) };
            }
        }
        room
    }
}

/// Points of several fronts that are looked at together, at most: of more the front is thinned to half of them first.
const MOST_AT_ONCE: usize = 2048;

/// The front of several. It depends on their order only where there are more points than are looked at together: whoever merges gives the fronts
/// by their numbers.
pub fn merged(fronts: impl IntoIterator<Item = Point>) -> Vec<Point> {
    let mut points = Vec::new();
    for point in fronts {
        points.push(point);
        if points.len() == MOST_AT_ONCE {
            points = front_of(points);
            thin(&mut points, MOST_AT_ONCE / 2);
        }
    }
    let mut front = front_of(points);
    thin(&mut front, 2 * MOST_OF_FRONT);
    front
}

/// Those that no other beats, by their objectives, then by their places.
fn front_of(mut points: Vec<Point>) -> Vec<Point> {
    points.sort_by(|one, other| {
        let objectives = one.judged.objectives.iter().zip(&other.judged.objectives);
        let places = one.place.iter().zip(&other.place);
        objectives
            .chain(places)
            .map(|(one, other)| one.total_cmp(other))
            .find(|order| order.is_ne())
            .unwrap_or(std::cmp::Ordering::Equal)
    });
    let mut front: Vec<Point> = Vec::new();
    for point in points {
        // What comes later is nowhere better in the first objective that differs, so that it beats none before.
        if !front.iter().any(|other| other.judged.covers(&point.judged)) {
            front.push(point);
        }
    }
    front
}

#[cfg(test)]
mod tests {
    use super::{
        CROSSOVER_INDEX, Judged, MUTATION_INDEX, Optimiser, Plan, Point, Stream, merged, offset, spread, thin,
    };

    fn points(count: usize, objectives: usize, seed: u64) -> Vec<Point> {
        let mut stream = Stream::new(seed, 0);
        let mut point = || {
            let objectives: Vec<_> = (0..objectives).map(|_| (64.0 * stream.share()).floor() + 1.0).collect();
            // On a sphere nobody beats another; whole numbers before bring equal distances.
            let length = objectives.iter().map(|value| value * value).sum::<f64>().sqrt();
            let objectives = objectives.iter().map(|value| -value / length).collect();
            Point {
                place: vec![stream.share()],
                judged: Judged { objectives, violations: Vec::new() },
                values: Vec::new(),
            }
        };
        (0..count).map(|_| point()).collect()
    }

    /// As it is defined: all distances anew whenever one has gone.
    fn thinned_slowly(front: &mut Vec<Point>, most: usize) {
        while front.len() > most {
            let objectives = front[0].judged.objectives.len();
            let of = |objective: usize| front.iter().map(move |point| point.judged.objectives[objective]);
            let least: Vec<f64> =
                (0..objectives).map(|objective| of(objective).fold(f64::INFINITY, f64::min)).collect();
            let widths: Vec<f64> = (0..objectives)
                .map(|objective| of(objective).fold(f64::NEG_INFINITY, f64::max) - least[objective])
                .collect();
            let distance = |one: &Point, other: &Point| -> f64 {
                (0..objectives)
                    .map(|at| ((one.judged.objectives[at] - other.judged.objectives[at]) / widths[at]).powi(2))
                    .sum()
            };
            let room = |index: usize| {
                let others = (0..front.len()).filter(|&other| other != index);
                others.map(|other| distance(&front[index], &front[other])).fold(f64::INFINITY, f64::min)
            };
            let is_end = |index: usize| (0..objectives).any(|at| front[index].judged.objectives[at] <= least[at]);
            let crowded = (0..front.len()).filter(|&index| !is_end(index)).map(|index| (room(index), index));
            let crowded = crowded.min_by(|one, other| one.0.total_cmp(&other.0).then(other.1.cmp(&one.1)));
            front.remove(crowded.expect("a front that is thinned has members").1);
        }
    }

    /// By Deb and Agrawal the density of the spread is `(η + 1) β^η / 2` below 1 and `(η + 1) / (2 β^(η + 2))` above.
    #[test]
    fn children_are_as_often_nearer_to_each_other_than_their_parents_as_farther() {
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
    fn mutations_go_either_way_alike_and_as_far_as_their_range() {
        assert!((offset(0.0) + 1.0).abs() < 1e-15 && offset(0.5).abs() < 1e-15);
        for share in [0.01, 0.1, 0.3, 0.45] {
            assert!((offset(share) + offset(1.0 - share)).abs() < 1e-12);
            assert!((0.5 * (1.0 + offset(share)).powf(MUTATION_INDEX + 1.0) - share).abs() < 1e-12);
        }
    }

    /// Of points that lie on one face of the cube and are alike elsewhere, children lie there too, but for mutations.
    #[test]
    fn a_child_stays_where_both_of_its_parents_are_and_within_the_cube() {
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
        // A quarter is mutated; of half that is crossed half is of unlike parents.
        assert!(moved.abs_diff(TRIES / 4) < 120, "{moved}");
        assert!(crossed.abs_diff(TRIES * 7 / 16) < 130, "{crossed}");
    }

    #[test]
    fn the_crowded_go_as_if_all_distances_were_measured_anew() {
        for (objectives, seed) in [(2, 1), (2, 2), (3, 3), (4, 4)] {
            let mut front = points(150, objectives, seed);
            let mut slowly = front.clone();
            thin(&mut front, 40);
            thinned_slowly(&mut slowly, 40);
            assert_eq!(front, slowly, "{objectives} objectives");
        }
    }

    /// As many as the islands of the largest search bring: it took hours.
    #[test]
    fn a_front_of_hundreds_of_thousands_is_merged() {
        let front = merged(points(200_000, 2, 5));
        assert!(front.len() > 100 && front.len() <= 200, "{}", front.len());
        let objective =
            |front: &[Point], at: usize| front.iter().map(|point| point.judged.objectives[at]).fold(0.0, f64::min);
        let all = points(200_000, 2, 5);
        for at in 0..2 {
            assert_eq!(objective(&front, at).to_bits(), objective(&all, at).to_bits(), "the ends stay");
        }
    }
}
