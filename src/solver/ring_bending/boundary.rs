//! Boundary of a piece of the ring, in straight elements.

use std::f64::consts::PI;

use nalgebra::{Point2, Rotation2, Vector2};

use crate::drive::Drive;
use crate::position::Position;
use crate::ring::RingFlank;
use crate::root::NotConverged;

/// Number of elements of either flank of the loaded ring tooth; every other flank is one element. Refinement to 64
/// elements, with 16 on every other flank and one more space on either side, changes the compliance in case 5.2 by 0.13
/// of the 21 units of the ring contact's compliance. In the last twentieth of the flank it is 0.4.
const FINE: usize = 16;

/// Number of elements of either half of the land of a bored tip, denser towards the flank's end; every other half is
/// one element. The half-plane's traction on the land next to a force at the flank's end causes the tooth's bending
/// there.
const FINE_OF_LAND: usize = 8;

/// Largest number of tooth spaces on either side of the one whose flank is loaded.
const SPACES_BESIDE: u64 = 2;

/// Distance of the fixed arc behind the root, in pitches of the ring's teeth.
const HELD_BEHIND: f64 = 1.0;

/// Elements along each side of the piece of ring, and along the fixed arc.
const ALONG_SIDE: u32 = 2;
const ALONG_ARC: u32 = 8;

/// Places of the force: the root and each element of the flank.
pub(super) const KNOTS: usize = FINE + 1;

/// A straight piece of the boundary with the material on its left.
#[derive(Clone, Copy)]
pub(super) struct Element {
    pub(super) middle: Point2<f64>,
    pub(super) along: Vector2<f64>,
    pub(super) outward: Vector2<f64>,
    pub(super) half: f64,
    pub(super) is_held: bool,
}

pub(super) fn flank_point(flank: &RingFlank, position: Position) -> Result<Point2<f64>, NotConverged> {
    let tooth = flank.locus().at(position)?;
    Ok(flank.point(&tooth, &flank.at(&tooth)))
}

/// Piece of the ring, in pitches: teeth on either side of a tooth space, and the fixed arc.
pub(super) struct Piece {
    /// Elements around the piece, the material on their left. The last [`KNOTS`] are loaded by a tooth, from the
    /// flank's end to the root, which is loaded in the middle of its space.
    pub(super) elements: Vec<Element>,
}

impl Piece {
    pub(super) fn of(drive: &Drive, pitch_mm: f64) -> Result<Self, NotConverged> {
        let (flank, limit) = (drive.flank(), drive.flank_limit());
        let (lobes, ring_teeth) = (drive.lobes(), drive.parameters().ring_teeth.unsigned_abs());
        let mut fine = Vec::with_capacity(FINE + 1);
        for step in 0..FINE {
            // The root's element extends from one flank to the other; towards the end elements become shorter.
            let from_end = 1.0 - (step as f64 + 0.5) / (FINE as f64 + 0.5);
            let position_rad = limit.position.from_lobe_rad * (1.0 - from_end * from_end);
            fine.push(flank_point(flank, Position::from_lobe(position_rad, lobes))? / pitch_mm);
        }
        fine.push(flank_point(flank, limit.position)? / pitch_mm);
        let coarse = [fine[0], fine[FINE]];
        let half_pitch_rad = PI / ring_teeth as f64;
        // From the middle of the tip; beyond the flank is a land or nothing.
        let at_tip =
            |angle_rad: f64| Point2::new(angle_rad.cos(), angle_rad.sin()) * (drive.tip_radius_mm() / pitch_mm);
        let end_rad = fine[FINE].y.atan2(fine[FINE].x);
        let has_land = (at_tip(half_pitch_rad) - fine[FINE]).norm() > 1e-9;
        let land = |is_fine: bool| {
            let steps = if is_fine { FINE_OF_LAND } else { 1 };
            let shares = (1..=if has_land { steps } else { 0 }).rev().map(move |step| step as f64 / steps as f64);
            shares.map(move |share| at_tip(end_rad + (half_pitch_rad - end_rad) * share * share)).collect::<Vec<_>>()
        };
        let mirrored = |point: Point2<f64>| Point2::new(point.x, -point.y);
        let mut elements = Vec::new();
        let mut first_pressed = 0;
        // The piece's ends stay apart.
        let pressed_space = SPACES_BESIDE.min(ring_teeth.saturating_sub(2) / 2);
        for space in (0..=2 * pressed_space).rev() {
            let turn = Rotation2::new(2.0 * half_pitch_rad * (space as f64 - pressed_space as f64));
            let points = |is_fine: bool| if is_fine { &fine[..] } else { &coarse[..] };
            let (is_pressed, is_behind) = (space == pressed_space, space == pressed_space + 1);
            let (land_before, land_behind) = (land(is_pressed), land(is_behind));
            if is_pressed {
                first_pressed = elements.len() + land_before.len();
            }
            // Clockwise about the axis, so that the material is on the left.
            let forward = land_before.into_iter().chain(points(is_pressed).iter().rev().copied());
            let backward = points(is_behind).iter().copied().chain(land_behind.into_iter().rev()).map(mirrored);
            let outline: Vec<_> = forward.chain(backward).map(|point| turn * point).collect();
            elements.extend(outline.windows(2).map(|ends| Element::new(ends[0], ends[1], false)));
        }
        if let [first, .., last] = elements[..] {
            elements.extend(held_around(last.end(), first.start(), drive.root_radius_mm() / pitch_mm + HELD_BEHIND));
        }
        elements.rotate_left(first_pressed + KNOTS);
        Ok(Self { elements })
    }

    /// Returns the elements that a tooth loads.
    pub(super) fn pressed(&self) -> &[Element] {
        &self.elements[self.elements.len() - KNOTS..]
    }
}

/// Returns the elements outward from the end of the inner boundary, along the arc and inward to its start.
fn held_around(from: Point2<f64>, to: Point2<f64>, radius: f64) -> impl Iterator<Item = Element> {
    let on_arc = |angle_rad: f64| Point2::new(angle_rad.cos(), angle_rad.sin()) * radius;
    let [start_rad, end_rad] = [from, to].map(|point| point.y.atan2(point.x));
    let share = |step: u32, steps: u32| f64::from(step) / f64::from(steps);
    let outward = (0..ALONG_SIDE).map(move |step| from + (on_arc(start_rad) - from) * share(step, ALONG_SIDE));
    let around = (0..ALONG_ARC).map(move |step| on_arc(start_rad + (end_rad - start_rad) * share(step, ALONG_ARC)));
    let inward = (0..=ALONG_SIDE).map(move |step| on_arc(end_rad) + (to - on_arc(end_rad)) * share(step, ALONG_SIDE));
    let points: Vec<_> = outward.chain(around).chain(inward).collect();
    (1..points.len()).map(move |end| Element::new(points[end - 1], points[end], true))
}

impl Element {
    fn new(from: Point2<f64>, to: Point2<f64>, is_held: bool) -> Self {
        let way = to - from;
        let along = way.normalize();
        let outward = Vector2::new(along.y, -along.x);
        Self { middle: from + 0.5 * way, along, outward, half: 0.5 * way.norm(), is_held }
    }

    fn start(&self) -> Point2<f64> {
        self.middle - self.half * self.along
    }

    fn end(&self) -> Point2<f64> {
        self.middle + self.half * self.along
    }
}
