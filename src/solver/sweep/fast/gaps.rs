//! Closing angles of gaps, in columns (docs/explanation/theory.md sections 4.4 and 4.8). The formulas are those of
//! [`crate::gaps`], split into a part of the position and a part of the items, so that positions that repeat in every
//! lap are evaluated once.

use std::f64::consts::PI;

use super::laps::{LapTeeth, whole};
use super::sharing::Weights;
use super::tile::Tile;
use crate::contact::PerContact;
use crate::gaps::{Deviations, MM_PER_UM, RAD_PER_ARCSEC, TipRelief, of};
use crate::load_sharing::LoadedDrive;
use crate::mesh::{Mesh, Place};

/// Relative size below which a nonzero total gap may be negative by rounding. The plain path decides such cases.
const EDGE: f64 = 1e-12;

/// Gaps of teeth.
pub(super) enum GapColumns<'a> {
    /// The same at all teeth.
    Uniform { gap_mm: PerContact<f64>, weights: Weights },
    /// Varying with the position, and with the items that deviate; by virtual work.
    Unlike(UnlikeGaps<'a>),
}

/// Columns to compute gaps in; empty if gaps are the same at all teeth.
pub(super) struct GapWork<'a> {
    /// ψ.
    pub(super) from_lobe_rad: &'a mut [f64],
    /// Part of the total gap that depends on the position.
    along: &'a mut [f64],
    per_arm: &'a mut [f64],
    /// Directions of the normals: of the wave generator relative to the lobe, of the ring relative to its space.
    cam_cos: &'a mut [f64],
    cam_sin: &'a mut [f64],
    ring_cos: &'a mut [f64],
    ring_sin: &'a mut [f64],
    /// Deviations at the teeth of a lap, by their order in a row.
    items: [&'a mut [f64]; GapWork::ITEMS],
}

/// Deviations at a tooth, or the part of them that one item has. Three gaps at the wave generator: constant, and in units
/// of the direction's cosine and sine; three at the ring; one at the carrier. Then the rotation about the axis, as lost
/// motion.
type Item = [f64; GapWork::ITEMS];

impl<'a> GapWork<'a> {
    /// Number of columns of states.
    pub(super) const COLUMNS: usize = 7;
    /// Number of columns of the teeth at an input angle.
    pub(super) const ITEMS: usize = 8;

    /// Builds the columns from slices of any length.
    pub(super) fn new(slice: &mut impl FnMut(usize) -> &'a mut [f64], column: usize, teeth: usize) -> Self {
        Self {
            from_lobe_rad: slice(column),
            along: slice(column),
            per_arm: slice(column),
            cam_cos: slice(column),
            cam_sin: slice(column),
            ring_cos: slice(column),
            ring_sin: slice(column),
            items: std::array::from_fn(|_| slice(teeth)),
        }
    }
}

/// Gaps that are not the same at all teeth.
pub(super) struct UnlikeGaps<'a> {
    loaded: &'a LoadedDrive<'a>,
    deviating: Option<Deviating>,
    /// Total gaps between zero and this value are left to the plain path.
    edge_mm: f64,
}

/// Deviations of individual items.
struct Deviating {
    slots: Vec<Item>,
    spaces: Vec<Item>,
    lobes: Vec<Item>,
}

impl Deviating {
    fn new(loaded: &LoadedDrive<'_>, deviations: &Deviations) -> Self {
        let drive = loaded.drive();
        let (p, s, lobes) = (drive.parameters(), drive.sense(), u64::from(drive.lobes()));
        let (slots, spaces) = (p.installed.unsigned_abs(), p.ring_teeth.unsigned_abs());
        let direction_rad =
            |item: u64, of: u64, angle_deg: f64| 2.0 * PI * item as f64 / of as f64 - angle_deg.to_radians();
        let runout = deviations.runout();
        let amount_mm = PerContact::of(|contact| MM_PER_UM * runout.get(contact).amount_um);
        let slot = |slot| {
            let thinner_mm = MM_PER_UM * of(&deviations.tooth_radius_um, slot);
            let direction_rad = direction_rad(slot, slots, runout.carrier.angle_deg) + s * 0.5 * PI;
            let carrier_mm =
                MM_PER_UM * of(&deviations.slot_wall_um, slot) + amount_mm.carrier * direction_rad.cos() + thinner_mm;
            let lost_motion_rad = drive.teeth_per_wave() * RAD_PER_ARCSEC * of(&deviations.slot_angle_arcsec, slot);
            [thinner_mm, 0.0, 0.0, thinner_mm, 0.0, 0.0, carrier_mm, lost_motion_rad]
        };
        let space = |space| {
            let (sin, cos) = direction_rad(space, spaces, runout.ring.angle_deg).sin_cos();
            let ring_mm = MM_PER_UM * of(&deviations.ring_space_um, space);
            let (by_cos_mm, by_sin_mm) = (amount_mm.ring * cos, s * amount_mm.ring * sin);
            let k = drive.flank().teeth_per_wave();
            let lost_motion_rad = k * RAD_PER_ARCSEC * of(&deviations.ring_space_angle_arcsec, space);
            [0.0, 0.0, 0.0, ring_mm, by_cos_mm, by_sin_mm, 0.0, lost_motion_rad]
        };
        let lobe = |lobe| {
            let (sin, cos) = direction_rad(lobe, lobes, runout.wave_generator.angle_deg).sin_cos();
            let cam_mm = MM_PER_UM * of(&deviations.wave_generator_lobe_um, lobe);
            let (by_cos_mm, by_sin_mm) = (-amount_mm.wave_generator * cos, amount_mm.wave_generator * sin);
            [cam_mm, by_cos_mm, by_sin_mm, 0.0, 0.0, 0.0, 0.0, 0.0]
        };
        Self {
            slots: (0..slots).map(slot).collect(),
            spaces: (0..spaces).map(space).collect(),
            lobes: (0..lobes).map(lobe).collect(),
        }
    }

    #[inline(always)]
    fn item(&self, &Place { slot, ring_space, lobe }: &Place) -> Item {
        let (slot, space) = (&self.slots[whole(slot)], &self.spaces[whole(ring_space)]);
        let lobe = &self.lobes[whole(lobe)];
        std::array::from_fn(|i| slot[i] + space[i] + lobe[i])
    }

    /// Returns an upper bound of the total at a tooth, in mm, with rotations at this arm.
    fn most_mm(&self, arm_mm: f64) -> f64 {
        let total = |[gaps_mm @ .., lost_motion_rad]: &Item| {
            gaps_mm.iter().map(|gap_mm| gap_mm.abs()).sum::<f64>() + lost_motion_rad.abs() * arm_mm
        };
        [&self.slots, &self.spaces, &self.lobes].map(|items| items.iter().map(total).fold(0.0, f64::max)).iter().sum()
    }
}

impl<'a> GapColumns<'a> {
    /// Returns the gaps of a drive under a load; none if there are no gaps.
    pub(super) fn new(loaded: &'a LoadedDrive<'a>) -> Option<Self> {
        let gaps = &loaded.gaps;
        if gaps.is_nil() {
            None
        } else if gaps.are_uniform() {
            Some(Self::Uniform { gap_mm: gaps.clearance_mm, weights: Weights::new(loaded) })
        } else {
            Some(Self::Unlike(UnlikeGaps::new(loaded)))
        }
    }

    /// Returns true if gaps belong to individual items.
    pub(super) const fn are_of_items(&self) -> bool {
        matches!(self, Self::Unlike(UnlikeGaps { deviating: Some(_), .. }))
    }

    /// Computes what depends on the places of a tile. Returns false if it needs the plain path.
    #[inline(always)]
    pub(super) fn prepare(&self, tile: &mut Tile<'_>) -> bool {
        match self {
            Self::Uniform { gap_mm, weights } => {
                close_alike(gap_mm, weights, tile);
                true
            }
            Self::Unlike(unlike) => {
                unlike.prepare(tile);
                unlike.deviating.is_some() || unlike.close(tile)
            }
        }
    }

    /// Closes the gaps of the teeth of a lap if items are distinguished. Returns false if the tile needs the plain path.
    #[inline(always)]
    pub(super) fn close_at_items(&self, mesh: &Mesh, teeth: &LapTeeth, tile: &mut Tile<'_>) -> bool {
        let Self::Unlike(unlike) = self else { return true };
        let Some(deviating) = &unlike.deviating else { return true };
        for run in &teeth.listed {
            for (at, place) in run.at.clone().zip(mesh.places_of(&run.teeth)) {
                let item = deviating.item(&place);
                tile.gaps.items.iter_mut().zip(item).for_each(|(column, value)| column[at] = value);
            }
        }
        unlike.close_at_items(tile)
    }
}

/// `g/|h'|`, infinite if there is no arm.
#[inline(always)]
fn close_alike(gap_mm: &PerContact<f64>, weights: &Weights, tile: &mut Tile<'_>) {
    let len = tile.len();
    let (arm, closing) = (&tile.torque.wave_generator[..len], &mut tile.work.closing[..len]);
    let (ring, carrier) = (&tile.force.ring[..len], &tile.force.carrier[..len]);
    for i in 0..len {
        let along = 1.0 - weights.ring_decline * (carrier[i] * carrier[i]);
        let ring = if weights.ring_exponent > 0.0 { ring[i] } else { 1.0 / ring[i] };
        let carrier = weights.carrier * carrier[i];
        let gap = gap_mm.wave_generator + gap_mm.ring * (along * ring) + gap_mm.carrier * carrier;
        let gap = if gap > 0.0 { gap } else { 0.0 };
        closing[i] = if arm[i] > 0.0 { gap / arm[i] } else { f64::INFINITY };
    }
}

impl<'a> UnlikeGaps<'a> {
    fn new(loaded: &'a LoadedDrive<'a>) -> Self {
        let (drive, gaps, m) = (loaded.drive(), &loaded.gaps, &loaded.gaps.modification);
        let deviating = gaps.deviations.map(|deviations| Deviating::new(loaded, deviations));
        // No arm is longer than a centre's distance.
        let arm_mm = drive.flank().locus().cam_outer_radius_mm() + drive.parameters().tooth_radius_mm;
        let of_modification = [
            m.ring_equidistant_um,
            m.ring_path_shift_um,
            m.ring_profile_shift_um,
            m.wave_generator_equidistant_um,
            m.slot_wall_um,
            m.tooth_radius_um,
            m.ring_tip_relief.map_or(0.0, |relief| relief.amount_um),
        ];
        let most_mm = gaps.clearance_mm.iter().map(|(_, gap_mm)| gap_mm).sum::<f64>()
            + MM_PER_UM * of_modification.iter().map(|gap_um| gap_um.abs()).sum::<f64>()
            + loaded.lost_motion_rad().abs() * arm_mm
            + deviating.as_ref().map_or(0.0, |deviating| deviating.most_mm(arm_mm));
        Self { loaded, deviating, edge_mm: EDGE * most_mm }
    }

    /// Computes the gaps and directions that depend on the position. `sin γ` follows from `F_S/F_H`, `cos β` from
    /// `F_K/F_H`, and `cos(β - δ)` of section 4.8 is `(d cos β + r)/√(d² + 2dr cos β + r²)`.
    #[inline(always)]
    fn prepare(&self, tile: &mut Tile<'_>) {
        let (len, gaps, drive) = (tile.len(), &mut tile.gaps, self.loaded.drive());
        let (m, clearance_mm) = (&self.loaded.gaps.modification, &self.loaded.gaps.clearance_mm);
        let (arm, d) = (&tile.torque.wave_generator[..len], &tile.center_radius_mm[..len]);
        let (ring, carrier) = (&tile.force.ring[..len], &tile.force.carrier[..len]);
        let (along, per_arm) = (&mut gaps.along[..len], &mut gaps.per_arm[..len]);
        let thinner_mm = MM_PER_UM * m.tooth_radius_um;
        let of_cam = clearance_mm.wave_generator + MM_PER_UM * m.wave_generator_equidistant_um + thinner_mm;
        let of_ring = clearance_mm.ring + MM_PER_UM * m.ring_equidistant_um + thinner_mm;
        let of_carrier = clearance_mm.carrier + MM_PER_UM * m.slot_wall_um + thinner_mm;
        let (path_shift, profile_shift) = (MM_PER_UM * m.ring_path_shift_um, MM_PER_UM * m.ring_profile_shift_um);
        let (per_ratio, k) = (1.0 / drive.teeth_per_wave(), drive.flank().teeth_per_wave());
        let r = drive.parameters().tooth_radius_mm;
        let (cam_cos, cam_sin) = (&mut gaps.cam_cos[..len], &mut gaps.cam_sin[..len]);
        let (ring_cos, ring_sin) = (&mut gaps.ring_cos[..len], &mut gaps.ring_sin[..len]);
        for i in 0..len {
            let sin_gamma = carrier[i] * per_ratio;
            let cos_gamma = ((1.0 - sin_gamma) * (1.0 + sin_gamma)).sqrt();
            let per_ring = 1.0 / ring[i];
            let cos_beta = cos_gamma * per_ring;
            let to_profile = (d[i] * cos_beta + r) / (d[i] * d[i] + r * (2.0 * (d[i] * cos_beta) + r)).sqrt();
            let at_ring = of_ring + path_shift * cos_beta + profile_shift * to_profile;
            along[i] = of_cam + ring[i] * at_ring + carrier[i] * of_carrier;
            per_arm[i] = if arm[i] > 0.0 { 1.0 / arm[i] } else { f64::INFINITY };
            (cam_cos[i], cam_sin[i]) = (cos_gamma, sin_gamma);
            (ring_cos[i], ring_sin[i]) = (cos_beta, k * sin_gamma * per_ring);
        }
        let from_lobe_rad = &gaps.from_lobe_rad[..len];
        if let Some(TipRelief { amount_um, start_deg, power }) = m.ring_tip_relief {
            let (amount_mm, start_rad) = (MM_PER_UM * amount_um, start_deg.to_radians());
            let end_rad = drive.flank_limit().position.from_lobe_rad;
            for i in 0..len {
                let beyond_rad = from_lobe_rad[i] - start_rad;
                if beyond_rad > 0.0 {
                    along[i] += ring[i] * (amount_mm * (beyond_rad / (end_rad - start_rad)).powf(power));
                }
            }
        }
        if self.deviating.is_some() {
            // Rotates by ψ + γ and by ψ/k + β.
            let turn = |cos: &mut f64, sin: &mut f64, by_rad: f64| {
                let (by_sin, by_cos) = by_rad.sin_cos();
                (*cos, *sin) = (*cos * by_cos - *sin * by_sin, *sin * by_cos + *cos * by_sin);
            };
            for i in 0..len {
                turn(&mut cam_cos[i], &mut cam_sin[i], from_lobe_rad[i]);
                turn(&mut ring_cos[i], &mut ring_sin[i], from_lobe_rad[i] / k);
            }
        }
    }

    /// `g/|h'|`, infinite if there is no arm. Returns false if interference is possible.
    #[inline(always)]
    fn close(&self, tile: &mut Tile<'_>) -> bool {
        let (count, len, lost_motion_rad) = (tile.count, tile.len(), self.loaded.lost_motion_rad());
        let (along, per_arm) = (&tile.gaps.along[..count], &tile.gaps.per_arm[..count]);
        let arm = &tile.torque.wave_generator[..count];
        let (closing, no_teeth) = tile.work.closing[..len].split_at_mut(count);
        let mut in_doubt = 0.0;
        for i in 0..count {
            let total = along[i] + lost_motion_rad * arm[i];
            in_doubt = if self.is_in_doubt(total) { 1.0 } else { in_doubt };
            closing[i] = if arm[i] > 0.0 { along[i] * per_arm[i] } else { f64::INFINITY };
        }
        no_teeth.fill(f64::INFINITY);
        in_doubt == 0.0
    }

    /// The same with the deviations of the items.
    #[inline(always)]
    fn close_at_items(&self, tile: &mut Tile<'_>) -> bool {
        let (count, rows, len, gaps) = (tile.teeth, tile.rows(), tile.len(), &tile.gaps);
        let lost_motion_of_all_rad = self.loaded.lost_motion_rad();
        let [cam, by_cam_cos, by_cam_sin, ring, by_ring_cos, by_ring_sin, carrier, lost_motion] =
            gaps.items.each_ref().map(|item| &item[..count]);
        tile.work.closing[tile.count..len].fill(f64::INFINITY);
        let mut in_doubt = 0.0;
        for row in 0..rows {
            let at = row * count..(row + 1) * count;
            let (arm, ring_ratio) = (&tile.torque.wave_generator[at.clone()], &tile.force.ring[at.clone()]);
            let carrier_ratio = &tile.force.carrier[at.clone()];
            let (along, per_arm) = (&gaps.along[at.clone()], &gaps.per_arm[at.clone()]);
            let (cam_cos, cam_sin) = (&gaps.cam_cos[at.clone()], &gaps.cam_sin[at.clone()]);
            let (ring_cos, ring_sin) = (&gaps.ring_cos[at.clone()], &gaps.ring_sin[at.clone()]);
            let closing = &mut tile.work.closing[at];
            for i in 0..count {
                let at_cam = cam[i] + by_cam_cos[i] * cam_cos[i] + by_cam_sin[i] * cam_sin[i];
                let at_ring = ring[i] + by_ring_cos[i] * ring_cos[i] + by_ring_sin[i] * ring_sin[i];
                let gap = along[i] + at_cam + ring_ratio[i] * at_ring + carrier_ratio[i] * carrier[i];
                let total = gap + (lost_motion[i] + lost_motion_of_all_rad) * arm[i];
                in_doubt = if self.is_in_doubt(total) { 1.0 } else { in_doubt };
                closing[i] = if arm[i] > 0.0 { gap * per_arm[i] + lost_motion[i] } else { f64::INFINITY };
            }
        }
        in_doubt == 0.0
    }

    /// Returns true if a total gap is below zero, or so near to it that rounding decides.
    #[inline(always)]
    fn is_in_doubt(&self, total_mm: f64) -> bool {
        total_mm < self.edge_mm && total_mm != 0.0
    }
}
