//! Judgement of a piece: where its curves may exceed the largest values seen.

use std::cell::OnceCell;

use super::seen::Seen;
use super::summit::{Nodes, Run, Summit, margins};
use super::{
    CAPACITY, COARSE_BEND, COARSE_CORNER, CORNERS_AT_ONCE, NODES, OFF_BY_POWERS, OFF_SMOOTH, QUANTITIES, QUARTERS,
    SHORT, SMOOTH_ROUNDS, STIFFNESSES, SURE, SearchedDrive, TOWARDS_START,
};

/// Criteria of a round for the intervals between moments.
pub(super) struct Judge<'a> {
    pub(super) drive: &'a SearchedDrive<'a>,
    /// Largest values so far.
    pub(super) best: [f64; QUANTITIES],
    /// Relative tolerance.
    pub(super) relative: f64,
    /// Largest error of linear interpolation between the moments, over the peaks. None if only the peaks are needed.
    pub(super) lines: Option<f64>,
    pub(super) round: u32,
}

/// An interval on which a quantity may exceed its largest value.
struct Candidate {
    /// Upper bound of the quantity.
    bound: f64,
    /// Fractions to evaluate next.
    fractions: [f64; 3],
}

impl Judge<'_> {
    /// Records the fractions to evaluate next. Returns the relative amount by which a quantity may still rise.
    pub(super) fn want(&self, all: &mut [Seen]) -> f64 {
        let mut most = 0.0_f64;
        for seen in all {
            if self.drive.has_gaps {
                self.close_in_on_changes(seen);
            }
            most = most.max(self.want_of_piece(seen));
            seen.wanted.sort_by(f64::total_cmp);
            seen.wanted.dedup_by(|one, other| (*one - *other).abs() <= f64::EPSILON);
        }
        most
    }

    /// Returns the part of a lap below which intervals need no evaluation.
    fn nearest(&self) -> f64 {
        (1e-3 * self.relative).max(16.0 * f64::EPSILON)
    }

    /// Returns true if the smooth rounds are over: intervals are halved from then on.
    const fn is_late(&self) -> bool {
        self.round >= SMOOTH_ROUNDS
    }

    /// Narrows the intervals in which the set of carrying teeth changes. For the first tooth that changes, it
    /// extrapolates the line through the two moments on one side.
    fn close_in_on_changes(&self, seen: &mut Seen) {
        let (nearest, is_late) = (self.nearest(), self.is_late());
        for at in 1..seen.order.len() {
            let (one, other) = (seen.order[at - 1], seen.order[at]);
            let Some(tooth) = seen.tooth_changed(one, other) else {
                if seen.fractions[other] - seen.fractions[one] > nearest {
                    let suspected = seen.suspected_change(at - 1);
                    seen.wanted.extend(suspected);
                }
                continue;
            };
            let (low, high) = (seen.fractions[one], seen.fractions[other]);
            if !self.change_matters(seen, one, other) {
                continue;
            }
            let pressed = |moment: usize| (seen.fractions[moment], seen.pressed(moment)[tooth]);
            let by_line = |(x, y): (f64, f64), (from, to): (f64, f64)| x - y * (x - from) / (y - to);
            let from_side = |near: usize, beyond: Option<usize>| {
                let far = beyond.filter(|&far| seen.tooth_changed(far, near).is_none())?;
                Some(by_line(pressed(near), pressed(far))).filter(|&root| root > low && root < high)
            };
            let before = from_side(one, at.checked_sub(2).map(|before| seen.order[before]));
            let after = from_side(other, seen.order.get(at + 1).copied());
            let is_low_nearer = pressed(one).1.abs() < pressed(other).1.abs();
            let by_side = if is_low_nearer { before.or(after) } else { after.or(before) };
            let root = by_side.unwrap_or_else(|| by_line(pressed(one), pressed(other)));
            let root = Some(root).filter(|root| root.is_finite());
            // Every third round bisects, and finally every round, so that no kink prevents convergence.
            let halves = is_late || self.round % 3 == 2 || root.is_none();
            seen.wanted.extend(halves.then_some(0.5 * (low + high)));
            let step = (0.25 * nearest).min(0.25 * (high - low));
            seen.wanted.extend(root.filter(|_| is_late || !halves).map(|root| root.clamp(low + step, high - step)));
        }
    }

    /// Returns true if two moments at a change are far enough apart for a value between them to matter.
    fn change_matters(&self, seen: &Seen, one: usize, other: usize) -> bool {
        let width = seen.fractions[other] - seen.fractions[one];
        if width <= 16.0 * f64::EPSILON {
            return false;
        }
        if width > self.nearest() {
            return true;
        }
        // The stiffness may jump there.
        (0..QUANTITIES).filter(|quantity| !STIFFNESSES.contains(quantity)).any(|quantity| {
            let most = self.best[quantity];
            seen.curves(quantity).any(|curve| {
                let (one, other) = (seen.value(one, curve), seen.value(other, curve));
                let rise = (one - other).abs();
                rise > 0.125 * self.relative * most && one.max(other) + rise > most
            })
        })
    }

    /// Records the fractions to evaluate next in a piece. Returns the relative amount by which a quantity may still rise.
    fn want_of_piece(&self, seen: &mut Seen) -> f64 {
        let mut candidates: [Vec<Candidate>; QUANTITIES] = Default::default();
        let (mut wanted, mut settled) = (std::mem::take(&mut seen.wanted), Vec::new());
        let mut start = 0;
        for end in 1..=seen.order.len() {
            let goes_on = end < seen.order.len() && seen.tooth_changed(seen.order[end - 1], seen.order[end]).is_none();
            if !goes_on {
                let (is_first, is_last) = (start == 0, end == seen.order.len());
                let run = Run { seen, moments: &seen.order[start..end], is_first, is_last };
                self.judge(&run, &mut candidates, &mut wanted, &mut settled);
                start = end;
            }
        }
        let mut most = 0.0_f64;
        let at_once = if self.is_late() { CORNERS_AT_ONCE } else { 1 };
        for (candidates, best) in candidates.iter_mut().zip(self.best) {
            candidates.sort_by(|one, other| other.bound.total_cmp(&one.bound));
            most = candidates.first().map_or(most, |highest| most.max(highest.bound / best - 1.0));
            wanted.extend(candidates.iter().take(at_once).flat_map(|candidate| candidate.fractions));
        }
        settled.into_iter().for_each(|moment: usize| seen.is_settled[moment] = true);
        seen.wanted = wanted;
        most
    }

    /// Judges the intervals of a run against the peaks so far.
    fn judge(
        &self,
        run: &Run<'_>,
        candidates: &mut [Vec<Candidate>; QUANTITIES],
        wanted: &mut Vec<f64>,
        settled: &mut Vec<usize>,
    ) {
        let seen = run.seen;
        let count = run.moments.len();
        let (nearest, is_linear, is_late) = (self.nearest(), self.drive.is_linear, self.is_late());
        if count < 2 || run.fraction(count - 1) - run.fraction(0) <= nearest {
            return;
        }
        if count < NODES {
            // Too few moments for a bound.
            let cuts: &[f64] = if count < 3 { &[0.25, 0.5, 0.75] } else { &[0.5] };
            for [low, high] in (1..count).map(|at| [run.fraction(at - 1), run.fraction(at)]) {
                if high - low > nearest {
                    wanted.extend(cuts.iter().map(|cut| low + cut * (high - low)));
                }
            }
            return;
        }
        let mut coarse = vec![0.0; seen.stride()];
        for (quantity, best) in self.best.iter().enumerate() {
            let share = if quantity == CAPACITY { COARSE_CORNER } else { COARSE_BEND };
            coarse[seen.curves(quantity)].fill(share * best);
        }
        let (mut curve_bends, mut curve_bounds) = (coarse.clone(), coarse.clone());
        for at in 0..count - 1 {
            let moment = run.moments[at];
            let (low, high) = (run.fraction(at), run.fraction(at + 1));
            if seen.is_settled[moment] || high - low <= nearest {
                continue;
            }
            margins(run, at, &coarse, &mut curve_bends, &mut curve_bounds);
            let nodes = OnceCell::new();
            let may_leave_by_powers = !is_linear && (at < 2 || at + 3 >= count);
            let off = if may_leave_by_powers { OFF_BY_POWERS } else { OFF_SMOOTH };
            let towards_end = match (at == 0, at + 2 == count) {
                _ if is_linear => None,
                (true, _) => Some(TOWARDS_START),
                (_, true) => Some(TOWARDS_START.map(|cut| 1.0 - cut)),
                _ => None,
            };
            let is_beside_change = (at == 0 && !run.is_first || at + 2 == count && !run.is_last) && high - low <= SHORT;
            let (mut is_settled, mut bends_too_much) = (true, false);
            let leaves_out_stiffness = self.drive.is_in_proportion || is_beside_change;
            for (quantity, &best) in self.best.iter().enumerate() {
                if best <= 0.0 || leaves_out_stiffness && STIFFNESSES.contains(&quantity) {
                    continue;
                }
                let limit = best * (1.0 + 0.25 * self.relative);
                let curves = seen.curves(quantity);
                bends_too_much |=
                    self.lines.is_some_and(|lines| curve_bends[curves.clone()].iter().any(|&bend| bend > lines * best));
                for curve in curves {
                    let of_curve = curve_bounds[curve];
                    if of_curve <= limit {
                        continue;
                    }
                    let (bound, cuts) = match towards_end {
                        Some(cuts) => (of_curve, cuts),
                        None if quantity == CAPACITY => (of_curve, QUARTERS),
                        None => match nodes.get_or_init(|| Nodes::of(run, at)) {
                            None => (f64::INFINITY, QUARTERS),
                            Some(nodes) => match nodes.summit(seen, curve, off) {
                                Summit { bound, .. } if bound <= limit => continue,
                                Summit { bound, error, .. } if error > SURE * best || is_late => (bound, QUARTERS),
                                Summit { bound, top, at, .. } => {
                                    let is_seen = top <= best * (1.0 + 0.125 * self.relative);
                                    (bound, [if is_seen { 0.5 } else { at.clamp(1e-3, 1.0 - 1e-3) }; 3])
                                }
                            },
                        },
                    };
                    is_settled = false;
                    candidates[quantity].push(Candidate { bound, fractions: cuts.map(|cut| low + cut * (high - low)) });
                }
            }
            if bends_too_much {
                wanted.push(0.5 * (low + high));
            } else if is_settled {
                settled.push(moment);
            }
        }
    }
}
