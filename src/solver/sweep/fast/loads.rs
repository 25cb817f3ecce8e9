//! Loads of a tile under the torque.

use pulp::Simd;

use super::Kernel;
use super::lanes::{cube_root, repeat_each};
use super::laps::LapTeeth;
use super::pressures::Pressures;
use super::sharing::Limit;
use super::tile::Tile;
use crate::contact::PerContact;
use crate::drive::Drive;
use crate::load_sharing::LoadedDrive;
use crate::mesh::Mesh;
use crate::sweep::columns::{InputAngles, TorqueCapacity, Totals, worse};

impl Totals {
    /// Adds the torques of a tile, and its limit.
    #[inline(always)]
    pub(super) fn add_torques(
        &mut self,
        loaded: &LoadedDrive<'_>,
        tile: &mut Tile<'_>,
        limit: Option<&Limit>,
        input_angle_deg: impl Fn(usize) -> f64,
    ) {
        if let Some(&Limit { torque_nmm, contact, row }) = limit {
            let input_torque_nm = 1e-3 * (loaded.zones * torque_nmm);
            self.add_capacity(TorqueCapacity::new(loaded.drive(), input_torque_nm, contact, input_angle_deg(row)));
        }
        let rows = tile.rows();
        for row in 0..rows {
            let torque = PerContact::of(|contact| tile.row_torque.get(contact)[row]);
            tile.row_residual[row] = self.balance.residual(&torque);
        }
        let residuals = tile.row_residual[..rows].iter();
        self.torque_balance_residual =
            residuals.fold(self.torque_balance_residual, |worst, &residual| worse(residual, worst));
    }

    /// Adds wind-up, stiffness and loaded teeth of a tile.
    #[inline(always)]
    pub(super) fn add_rows(&mut self, drive: &Drive, tile: &Tile<'_>) {
        for row in 0..tile.rows() {
            let stiffness = InputAngles::of_output(drive, tile.row_stiffness[row]);
            self.add(tile.row_rotation_rad[row].to_degrees(), stiffness, tile.row_loaded[row] as u64);
        }
    }
}

impl Kernel<'_> {
    /// Computes the loads of a tile from its unit loads; for the teeth of a lap if items are distinguished. Returns false
    /// if the tile needs the plain path.
    #[inline(always)]
    pub(super) fn loads<V: Simd>(&self, mesh: &Mesh, lap_teeth: &LapTeeth, tile: &mut Tile<'_>) -> bool {
        let Some(sharing) = &self.sharing else {
            self.scale(tile);
            return true;
        };
        if !self.gaps.as_ref().is_none_or(|gaps| gaps.close_at_items(mesh, lap_teeth, tile))
            || !sharing.share::<V>(self.torque_of_zone_nmm(), self.gaps.is_some(), tile)
        {
            return false;
        }
        self.scale_shared::<V>(tile);
        true
    }

    /// Returns the limit of a tile with loads, if one is searched for. Returns an outer none if the tile needs the plain
    /// path. It overwrites rotations and pressed teeth of the load sharing, so what reads them comes first.
    #[inline(always)]
    pub(super) fn limit<V: Simd>(&self, tile: &mut Tile<'_>) -> Option<Option<Limit>> {
        let (Some(sharing), Some(allowable_mpa)) = (&self.sharing, &self.allowable_mpa) else { return Some(None) };
        let per_allowable = PerContact::of(|contact| 1.0 / allowable_mpa.get(contact));
        sharing.limit::<V>(&per_allowable, tile).map(Some)
    }

    /// Rotates the wave generator at each input angle of a tile until the loads balance the torque.
    #[inline(always)]
    fn scale(&self, tile: &mut Tile<'_>) {
        let (rows, teeth) = (tile.sum_torques::<true>(), tile.teeth);
        let (input_nmm, zones) = (self.loaded.input_torque_nmm(), self.loaded.zones);
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

    /// Computes torques, stiffness and the number of carrying teeth after load sharing.
    #[inline(always)]
    fn scale_shared<V: Simd>(&self, tile: &mut Tile<'_>) {
        let (len, zones) = (tile.len(), self.loaded.zones);
        let (scale, root) = (&tile.scale[..len], &mut tile.scale_root[..len]);
        let are_balls = matches!(self.pressures, Pressures::Ellipses(_));
        for i in 0..len {
            root[i] = if are_balls { cube_root::<V>(scale[i]) } else { scale[i].sqrt() };
        }
        let rows = tile.sum_torques::<false>();
        let PerContact { wave_generator: cam, ring, carrier } = &mut tile.row_torque;
        let (cam, ring, carrier) = (&mut cam[..rows], &mut ring[..rows], &mut carrier[..rows]);
        let (rotation_rad, stiffness) = (&mut tile.row_rotation_rad[..rows], &mut tile.row_stiffness[..rows]);
        let lost_motion_rad = self.loaded.lost_motion_rad();
        for row in 0..rows {
            cam[row] *= zones;
            ring[row] *= zones;
            carrier[row] *= zones;
            stiffness[row] *= zones;
            rotation_rad[row] += lost_motion_rad;
        }
        tile.row_loaded.clear();
        let carrying = |row: &[f64]| row.iter().filter(|&&force| force > 0.0).count();
        tile.row_loaded.extend(tile.scale[..tile.count].chunks_exact(tile.teeth).map(carrying));
    }
}
