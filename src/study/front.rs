//! A bounded Pareto front: of the non-dominated points it keeps those with the most hypervolume together.
//!
//! If the front is full, the point with the least hypervolume contribution is removed, as in SMS-EMOA (N. Beume, B.
//! Naujoks, M. Emmerich, European Journal of Operational Research 181, 2007, 1653-1669). The best point of each
//! objective always stays. So further points never worsen the best value of an objective. While these best points stay
//! the same, the hypervolume does not fall.

use crate::point::Point;

/// Most objectives.
pub(crate) const MOST_OBJECTIVES: usize = 4;

/// Distance of the reference point from the worst value of each objective, as a fraction of the range of values.
const MARGIN: f64 = 0.1;

/// Objective values. Unused objectives are 0, and 1 in the reference point.
type Place = [f64; MOST_OBJECTIVES];

/// Points that do not dominate each other.
#[derive(Debug, Clone)]
pub(crate) struct Front {
    most: usize,
    points: Vec<Point>,
    places: Vec<Place>,
    /// Hypervolume contribution of each point. Empty until one is needed.
    volumes: Vec<f64>,
    corner: Place,
}

impl Front {
    /// Makes an empty front for at most this many points.
    pub(crate) const fn new(most: usize) -> Self {
        Self { most, points: Vec::new(), places: Vec::new(), volumes: Vec::new(), corner: [1.0; MOST_OBJECTIVES] }
    }

    pub(crate) fn points(&self) -> &[Point] {
        &self.points
    }

    /// Removes and returns all points.
    pub(crate) fn take(&mut self) -> Vec<Point> {
        std::mem::replace(self, Self::new(self.most)).points
    }

    /// Returns the points in the order of their objectives.
    pub(crate) fn into_sorted(mut self) -> Vec<Point> {
        self.points.sort_by(|one, other| {
            let pairs = one.judged.objectives.iter().zip(&other.judged.objectives);
            pairs
                .map(|(one, other)| one.total_cmp(other))
                .find(|order| order.is_ne())
                .unwrap_or(std::cmp::Ordering::Equal)
        });
        self.points
    }

    /// Adds a point if no other covers it, and removes the points that it covers.
    pub(crate) fn insert(&mut self, point: Point) {
        let mut place = [0.0; MOST_OBJECTIVES];
        for (at, value) in place.iter_mut().zip(&point.judged.objectives) {
            *at = *value;
        }
        if self.places.iter().any(|other| covers(other, &place)) {
            return;
        }
        for index in (0..self.points.len()).rev() {
            if covers(&place, &self.places[index]) {
                self.remove(index);
            }
        }
        self.points.push(point);
        self.places.push(place);
        let is_measured = self.volumes.len() + 1 == self.points.len() && self.points.len() > 1;
        if is_measured {
            self.volumes.push(0.0);
            self.measure_beside(&place);
        }
        if self.points.len() > self.most {
            if self.fit_corner() || !is_measured {
                self.volumes = (0..self.points.len()).map(|index| self.volume(index)).collect();
            }
            let least = self.least();
            let place = self.places[least];
            self.remove(least);
            self.measure_beside(&place);
        }
    }

    fn remove(&mut self, index: usize) {
        self.points.swap_remove(index);
        self.places.swap_remove(index);
        if !self.volumes.is_empty() {
            self.volumes.swap_remove(index);
        }
    }

    /// Moves the reference point if it is too near to the points or too far from them. Returns true if it moved.
    fn fit_corner(&mut self) -> bool {
        let mut has_moved = false;
        for (objective, corner) in self.corner.iter_mut().enumerate() {
            let values = || self.places.iter().map(|place| place[objective]);
            let (least, worst) = (values().fold(f64::INFINITY, f64::min), values().fold(f64::NEG_INFINITY, f64::max));
            let margin = if worst > least { MARGIN * (worst - least) } else { 1.0 };
            if !(0.5 * margin..=2.0 * margin).contains(&(*corner - worst)) {
                *corner = worst + margin;
                has_moved = true;
            }
        }
        has_moved
    }

    /// Returns the point with the least contribution, apart from the best of each objective.
    fn least(&self) -> usize {
        let best = |objective: usize| {
            let by = |index: &usize| {
                let place = &self.places[*index];
                (place[objective], place)
            };
            (0..self.places.len()).min_by(|one, other| {
                let (one, other) = (by(one), by(other));
                let rest = one.1.iter().zip(other.1).map(|(one, other)| one.total_cmp(other));
                one.0.total_cmp(&other.0).then(rest.fold(std::cmp::Ordering::Equal, std::cmp::Ordering::then))
            })
        };
        let ends: [Option<usize>; MOST_OBJECTIVES] = std::array::from_fn(best);
        let inner = (0..self.places.len()).filter(|&index| !ends.contains(&Some(index)));
        // The later one of equal contributions.
        let least =
            inner.min_by(|&one, &other| self.volumes[one].total_cmp(&self.volumes[other]).then(other.cmp(&one)));
        least.unwrap_or(self.places.len() - 1)
    }

    /// Updates the contributions of the points that share hypervolume with this place and with no other point.
    fn measure_beside(&mut self, place: &Place) {
        for index in 0..self.places.len() {
            let shared = worse(&self.places[index], place);
            let mut others = self.places.iter().enumerate();
            if !others.any(|(other, by)| other != index && !covers(place, by) && covers(by, &shared)) {
                self.volumes[index] = self.volume(index);
            }
        }
    }

    /// Computes the hypervolume contribution of a point.
    fn volume(&self, index: usize) -> f64 {
        let own = &self.places[index];
        let mut shared: Vec<Place> = Vec::new();
        for (_, other) in self.places.iter().enumerate().filter(|&(other, _)| other != index) {
            let both = worse(own, other);
            if !shared.iter().any(|known| covers(known, &both)) {
                shared.retain(|known| !covers(&both, known));
                shared.push(both);
            }
        }
        let all: f64 = own.iter().zip(&self.corner).map(|(own, corner)| (corner - own).max(0.0)).product();
        all - hypervolume(&mut shared, &self.corner, MOST_OBJECTIVES)
    }
}

/// True if no objective of `one` is worse.
fn covers(one: &Place, other: &Place) -> bool {
    one.iter().zip(other).all(|(one, other)| one <= other)
}

/// Returns the worst of both in each objective. Its region is dominated by both points.
fn worse(one: &Place, other: &Place) -> Place {
    std::array::from_fn(|objective| one[objective].max(other[objective]))
}

/// Computes the hypervolume between points and the reference point in the first `objectives` objectives, by slices of
/// the last one.
fn hypervolume(points: &mut [Place], corner: &Place, objectives: usize) -> f64 {
    let mut sum = 0.0;
    if objectives == 2 {
        points.sort_unstable_by(|one, other| one[0].total_cmp(&other[0]));
        let mut lowest = corner[1];
        for point in points.iter().filter(|point| point[0] < corner[0]) {
            sum += (corner[0] - point[0]) * (lowest - point[1]).max(0.0);
            lowest = lowest.min(point[1]);
        }
        return sum;
    }
    let last = objectives - 1;
    points.sort_unstable_by(|one, other| one[last].total_cmp(&other[last]));
    for index in 0..points.len() {
        let to = points.get(index + 1).map_or(corner[last], |next| next[last]).min(corner[last]);
        let depth = to - points[index][last];
        if depth > 0.0 {
            sum += depth * hypervolume(&mut points[..=index].to_vec(), corner, last);
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::{Front, MOST_OBJECTIVES, Place, hypervolume};
    use crate::optimise::merged;
    use crate::point::{Judged, Point};
    use crate::random::Stream;

    fn point(objectives: Vec<f64>) -> Point {
        Point { place: Vec::new(), judged: Judged { objectives, violations: Vec::new() }, values: Vec::new() }
    }

    /// Points on a sphere do not dominate each other. Whole numbers in front give equal values.
    fn points(count: usize, objectives: usize, seed: u64) -> Vec<Point> {
        let mut stream = Stream::new(seed, 0);
        let mut one = || {
            let objectives: Vec<_> = (0..objectives).map(|_| (64.0 * stream.share()).floor() + 1.0).collect();
            let length = objectives.iter().map(|value| value * value).sum::<f64>().sqrt();
            point(objectives.iter().map(|value| -value / length).collect())
        };
        (0..count).map(|_| one()).collect()
    }

    fn volume(front: &Front, corner: &Place) -> f64 {
        hypervolume(&mut front.places.clone(), corner, MOST_OBJECTIVES)
    }

    fn best(front: &Front) -> Place {
        let least = |objective: usize| front.places.iter().map(|place| place[objective]).fold(f64::INFINITY, f64::min);
        std::array::from_fn(least)
    }

    /// The expected value is counted in cells of a grid.
    #[test]
    fn hypervolume_is_count_of_cells() {
        const SIDE: u32 = 8;
        let mut stream = Stream::new(3, 0);
        for objectives in 2..=4_usize {
            let mut places: Vec<Place> = Vec::new();
            for _ in 0..12 {
                places.push(std::array::from_fn(|at| {
                    if at < objectives { (f64::from(SIDE) * stream.share()).floor() } else { 0.0 }
                }));
            }
            let corner: Place = std::array::from_fn(|at| if at < objectives { f64::from(SIDE) } else { 1.0 });
            let sides = [1, SIDE, SIDE.pow(2), SIDE.pow(3), SIDE.pow(4)];
            let cells = (0..sides[objectives]).filter(|cell| {
                let digit = |at: usize| f64::from(cell / sides[at] % SIDE);
                places.iter().any(|place| (0..objectives).all(|at| place[at] <= digit(at)))
            });
            let cells = cells.count() as f64;
            assert!((hypervolume(&mut places.clone(), &corner, MOST_OBJECTIVES) - cells).abs() < 1e-9);
        }
    }

    #[test]
    fn more_points_never_make_front_worse() {
        for objectives in 2..=4 {
            let (mut front, mut stream) = (Front::new(30), Stream::new(8, 0));
            for mut point in points(2000, objectives, 7) {
                let length = 0.8 + 0.2 * stream.share();
                point.judged.objectives.iter_mut().for_each(|value| *value *= length);
                let before = front.clone();
                front.insert(point);
                assert!(
                    best(&front).iter().zip(best(&before)).all(|(now, before)| *now <= before || before.is_infinite())
                );
                let (now, then) = (volume(&front, &front.corner), volume(&before, &front.corner));
                assert!(
                    now >= then * (1.0 - 1e-12) || best(&front).map(f64::to_bits) != best(&before).map(f64::to_bits),
                    "{objectives}: {then} to {now}"
                );
            }
            let anew: Vec<_> = (0..30).map(|index| front.volume(index)).collect();
            let differs = anew.iter().zip(&front.volumes).any(|(anew, kept)| (anew - kept).abs() > 1e-12);
            assert!(!differs, "{objectives}: updated contributions differ from new ones");
        }
    }

    /// All points are equal in the third objective. Only one of them is kept for it.
    #[test]
    fn best_point_of_each_objective_stays() {
        let tied = |point: Point| Point {
            judged: Judged { objectives: [point.judged.objectives, vec![-14.0]].concat(), ..point.judged },
            ..point
        };
        let mut bounded = Front::new(100);
        let mut whole = Front::new(usize::MAX);
        for point in points(3000, 2, 5) {
            bounded.insert(tied(point.clone()));
            whole.insert(tied(point));
        }
        assert_eq!((bounded.points().len(), best(&bounded)), (100, best(&whole)));
        let (share, all) = (volume(&bounded, &bounded.corner), volume(&whole, &bounded.corner));
        assert!(whole.points().len() > 1000 && share > 0.995 * all, "{share} of {all}");
    }

    /// The islands of the largest search give this many points, so the merge must not be quadratic.
    #[test]
    fn merges_hundreds_of_thousands_of_points() {
        let front = merged(points(200_000, 2, 5));
        assert!(front.len() > 100 && front.len() <= 200, "{}", front.len());
        let objective =
            |front: &[Point], at: usize| front.iter().map(|point| point.judged.objectives[at]).fold(0.0, f64::min);
        let all = points(200_000, 2, 5);
        for at in 0..2 {
            assert_eq!(objective(&front, at).to_bits(), objective(&all, at).to_bits(), "the best values stay");
        }
    }
}
