//! Loads of a tile under the torque.

use pulp::Simd;

use super::gaps::{GapColumns, GapWork};
use super::lanes::{LANES, cube_root, repeat_each};
use super::laps::LapTeeth;
use super::pressures::Pressures;
use super::sharing::{Limit, Shared, Sharing, Teeth, Work};
use super::tile::Tile;
use super::{Kernel, Law};
use crate::contact::PerContact;
use crate::load_sharing::LoadedDrive;
use crate::mesh::Mesh;
use crate::sweep::columns::{TorqueBalance, TorqueCapacity, worse};

impl Limit {
    pub(super) fn capacity(&self, loaded: &LoadedDrive<'_>, input_angle_deg: f64) -> TorqueCapacity {
        let input_torque_nm = 1e-3 * (loaded.zones * self.torque_nmm);
        let output_torque_nm = input_torque_nm * loaded.drive().teeth_per_wave();
        let limited_by = self.contact.into();
        TorqueCapacity { input_torque_nm, output_torque_nm, limited_by, turns_past_teeth: false, input_angle_deg }
    }
}

impl Kernel {
    /// Computes what depends on the places of a tile: law and gaps. Returns false if it needs the plain path.
    #[inline(always)]
    pub(super) fn prepare<V: Simd>(&self, loaded: &LoadedDrive<'_>, count: usize, tile: &mut Tile<'_>) -> bool {
        let Law::Sharing(sharing) = &self.law else { return true };
        let (teeth, work, gap_work, _) = self.teeth_of(count, tile);
        sharing.prepare::<V>(loaded.input_torque_nmm() / loaded.zones, &teeth, work);
        self.gaps.as_ref().is_none_or(|gaps| gaps.prepare(&teeth, gap_work, work.closing))
    }

    /// Closes the gaps of the teeth of a lap if items are distinguished. Returns false if the tile needs the plain
    /// path.
    #[inline(always)]
    pub(super) fn close(&self, mesh: &Mesh, lap_teeth: &LapTeeth, count: usize, tile: &mut Tile<'_>) -> bool {
        let Some(gaps) = self.gaps.as_ref().filter(|gaps| gaps.are_of_items()) else { return true };
        gaps.set_teeth(mesh, lap_teeth, &mut tile.gaps);
        let (teeth, work, gap_work, _) = self.teeth_of(count, tile);
        gaps.close_at_items(&teeth, gap_work, work.closing)
    }

    /// Computes the loads of a tile from its unit loads, and their limits. Returns none if it needs the plain path. If
    /// a limit is searched for, `shared` receives the result of load sharing first, because the limit overwrites it.
    #[inline(always)]
    pub(super) fn loads<V: Simd>(
        &self,
        loaded: &LoadedDrive<'_>,
        teeth: usize,
        tile: &mut Tile<'_>,
        shared: impl FnOnce(&Sharing, &Work<'_>),
    ) -> Option<Option<Limit>> {
        let Law::Sharing(sharing) = &self.law else {
            Self::scale(loaded, teeth, tile);
            return Some(None);
        };
        if !self.share::<V>(sharing, loaded, teeth, tile) {
            return None;
        }
        shared(sharing, &tile.work);
        let limit = match &self.allowable_mpa {
            Some(allowable_mpa) => Some(self.limit::<V>(sharing, allowable_mpa, teeth, tile)?),
            None => None,
        };
        self.scale_shared::<V>(loaded, teeth, tile);
        Some(limit)
    }

    /// Rotates the wave generator at each input angle of a tile until the loads balance the torque.
    #[inline(always)]
    fn scale(loaded: &LoadedDrive<'_>, teeth: usize, tile: &mut Tile<'_>) {
        let rows = tile.sum_torques::<true>(teeth);
        let (input_nmm, zones) = (loaded.input_torque_nmm(), loaded.zones);
        let PerContact { wave_generator: cam, ring, carrier } = &mut tile.row_torque;
        let (cam, ring, carrier) = (&mut cam[..rows], &mut ring[..rows], &mut carrier[..rows]);
        let (rotation_rad, rotation_root) = (&mut tile.row_rotation_rad[..rows], &mut tile.row_rotation_root[..rows]);
        let stiffness = &mut tile.row_stiffness[..rows];
        for row in 0..rows {
            let rotation = input_nmm / (zones * cam[row]);
            rotation_rad[row] = rotation;
            rotation_root[row] = rotation.sqrt();
            stiffness[row] = zones * cam[row];
            let scale = zones * rotation;
            cam[row] *= scale;
            ring[row] *= scale;
            carrier[row] *= scale;
        }
        // Only a tooth in the valley, at the last place, has neither lever arm nor load.
        let lasts = tile.force.wave_generator[..tile.count].iter().skip(tile.last_place).step_by(teeth);
        tile.row_loaded.clear();
        tile.row_loaded.extend(lasts.map(|last| teeth - usize::from(*last <= 0.0)));
        repeat_each(rotation_rad, teeth, tile.scale);
        repeat_each(rotation_root, teeth, tile.scale_root);
    }

    /// Returns the teeth of a tile under 1 N, and the inputs and outputs of load sharing.
    #[inline(always)]
    fn teeth_of<'t, 'a>(
        &self,
        count: usize,
        tile: &'t mut Tile<'a>,
    ) -> (Teeth<'t>, &'t mut Work<'a>, &'t mut GapWork<'a>, Shared<'t>) {
        let teeth = Teeth {
            count,
            rows: tile.count / count,
            len: tile.count.next_multiple_of(LANES),
            center_radius_mm: tile.center_radius_mm,
            arm: tile.torque.wave_generator,
            ring_ratio: tile.force.ring,
            carrier_ratio: tile.force.carrier,
            cam_stress: tile.stress.wave_generator,
            ring_stress: tile.stress.ring,
            carrier_stress: tile.stress.carrier,
            stress_exponents: self.pressures.stress_exponents(),
        };
        let shared = Shared { force: tile.scale, rotation_rad: tile.row_rotation_rad, stiffness: tile.row_stiffness };
        (teeth, &mut tile.work, &mut tile.gaps, shared)
    }

    /// Shares the load among the teeth of each input angle. Returns false if it needs the plain path.
    #[inline(always)]
    fn share<V: Simd>(&self, sharing: &Sharing, loaded: &LoadedDrive<'_>, count: usize, tile: &mut Tile<'_>) -> bool {
        let (teeth, work, _, mut shared) = self.teeth_of(count, tile);
        sharing.share::<V>(loaded.input_torque_nmm() / loaded.zones, &teeth, work, &mut shared)
    }

    /// Returns the limit of the teeth after load sharing; none if it needs the plain path.
    #[inline(always)]
    fn limit<V: Simd>(
        &self,
        sharing: &Sharing,
        allowable_mpa: &PerContact<f64>,
        count: usize,
        tile: &mut Tile<'_>,
    ) -> Option<Limit> {
        let per_allowable = PerContact::of(|contact| 1.0 / allowable_mpa.get(contact));
        let (teeth, work, _, _) = self.teeth_of(count, tile);
        sharing.limit::<V>(&per_allowable, &teeth, work)
    }

    /// Computes torques, stiffness and the number of carrying teeth after load sharing.
    #[inline(always)]
    fn scale_shared<V: Simd>(&self, loaded: &LoadedDrive<'_>, count: usize, tile: &mut Tile<'_>) {
        let zones = loaded.zones;
        let len = tile.count.next_multiple_of(LANES);
        let (scale, root) = (&tile.scale[..len], &mut tile.scale_root[..len]);
        let are_balls = matches!(self.pressures, Pressures::Ellipses(_));
        for i in 0..len {
            root[i] = if are_balls { cube_root::<V>(scale[i]) } else { scale[i].sqrt() };
        }
        let rows = tile.sum_torques::<false>(count);
        let PerContact { wave_generator: cam, ring, carrier } = &mut tile.row_torque;
        let (cam, ring, carrier) = (&mut cam[..rows], &mut ring[..rows], &mut carrier[..rows]);
        let (rotation_rad, stiffness) = (&mut tile.row_rotation_rad[..rows], &mut tile.row_stiffness[..rows]);
        let lost_motion_rad = self.gaps.as_ref().map_or(0.0, GapColumns::lost_motion_rad);
        for row in 0..rows {
            cam[row] *= zones;
            ring[row] *= zones;
            carrier[row] *= zones;
            stiffness[row] *= zones;
            rotation_rad[row] += lost_motion_rad;
        }
        tile.row_loaded.clear();
        let carrying = |row: &[f64]| row.iter().filter(|&&force| force > 0.0).count();
        tile.row_loaded.extend(tile.scale[..tile.count].chunks_exact(count).map(carrying));
    }

    /// Returns the largest torque residual of a tile and of the earlier ones.
    #[inline(always)]
    pub(super) fn residual(balance: &TorqueBalance, rows: usize, tile: &mut Tile<'_>, before: f64) -> f64 {
        for row in 0..rows {
            let torque = PerContact::of(|contact| tile.row_torque.get(contact)[row]);
            tile.row_residual[row] = balance.residual(&torque);
        }
        tile.row_residual[..rows].iter().fold(before, |worst, &residual| worse(residual, worst))
    }
}
