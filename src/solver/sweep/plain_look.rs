//! Search for the extremes of a sweep, evaluated tooth by tooth.

use crate::load_sharing::{LoadedDrive, ToothState};
use crate::sweep::search::{LOADS, Piece, SearchedDrive, Seen};
use crate::{SolveError, Stop};

/// Evaluates moments tooth by tooth.
pub(crate) struct PlainLook<'a> {
    /// With one tooth at each place, which represents all that carry alike.
    pub(crate) loaded: LoadedDrive<'a>,
    stop: &'a dyn Stop,
}

impl<'a> PlainLook<'a> {
    pub(crate) fn new(loaded: &LoadedDrive<'a>, stop: &'a dyn Stop) -> Self {
        Self { loaded: loaded.with_one_tooth_a_place(), stop }
    }

    /// Returns the teeth of a piece, place by place. Errors of a tooth have the input angle.
    pub(crate) fn teeth(&self, piece: &Piece, fraction: f64) -> Result<Vec<ToothState>, SolveError> {
        if self.stop.stopped() {
            return Err(SolveError::Stopped);
        }
        let mesh = self.loaded.mesh();
        let position = |place| piece.position(mesh, place, fraction);
        let teeth: Result<Vec<_>, _> = if mesh.tells_items_apart() {
            let mut placed: Vec<_> = mesh.placed_between(1..=piece.places, piece.lap, position).collect();
            // Teeth at one place keep the order of their slots.
            placed.sort_by(|one, other| one.position.from_lobe_rad.total_cmp(&other.position.from_lobe_rad));
            placed.iter().map(|tooth| self.loaded.tooth_at(&tooth.place, tooth.position)).collect()
        } else {
            (1..=piece.places).map(|place| self.loaded.tooth(position(place))).collect()
        };
        let lap_deg = mesh.sweep_period_deg() / mesh.laps() as f64;
        teeth.map_err(|error| error.at_input_angle((piece.lap as f64 + fraction) * lap_deg))
    }

    /// Returns what the search needs to know.
    pub(crate) fn searched(&self) -> SearchedDrive<'_> {
        let (loaded, mesh) = (&self.loaded, self.loaded.mesh());
        SearchedDrive {
            loaded,
            has_gaps: loaded.has_gaps(),
            is_linear: loaded.is_linear(),
            is_in_proportion: loaded.is_linear(),
            teeth_at_each_place: if mesh.tells_items_apart() { mesh.listed_at_each_place() } else { 1 },
        }
    }

    /// Appends moments of a piece.
    pub(crate) fn look(&self, fractions: &[f64], seen: &mut Seen) -> Result<(), SolveError> {
        let piece = seen.piece;
        for &fraction in fractions {
            let teeth = self.teeth(&piece, fraction)?;
            let wind_up = self.loaded.wind_up(&teeth)?;
            if self.loaded.has_gaps() {
                let rotation = wind_up.rotation;
                let pressed_rad =
                    |tooth: &ToothState| rotation.excess_rad + (rotation.closing_rad - tooth.spring.closing_rad);
                seen.pressed.extend(teeth.iter().map(pressed_rad));
            }
            let per_capacity = match &self.loaded.load.allowable_stress_mpa {
                Some(allowable_mpa) => 1.0 / self.loaded.torque_limit(&teeth, allowable_mpa)?.input_torque_nmm,
                None => 0.0,
            };
            let (rotation_rad, stiffness) = (wind_up.rotation_rad(), wind_up.stiffness_nmm_per_rad);
            let count = seen.teeth;
            let values = seen.push(fraction);
            for (index, tooth) in teeth.iter().enumerate() {
                for (quantity, load) in self.loaded.loads(tooth, &wind_up)?.into_iter().enumerate() {
                    values[quantity * count + index] = load;
                }
            }
            let totals = [rotation_rad, 1.0 / rotation_rad, stiffness, 1.0 / stiffness, per_capacity];
            values[LOADS * count..].copy_from_slice(&totals);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{ContactLaw, Drive, DriveParameters, LoadCase, LoadParameters, Never, PerContact};

    #[test]
    fn pressed_teeth_are_those_that_carry() {
        let drive = Drive::new(&DriveParameters::default()).expect("a possible drive");
        let case = LoadCase::new(&LoadParameters {
            law: ContactLaw::Palmgren,
            clearance_um: PerContact { wave_generator: 0.0, ring: 20.0, carrier: 5.0 },
            ..LoadParameters::default()
        });
        let case = case.expect("a possible load");
        let loaded = LoadedDrive::new(&drive, &case).expect("a possible case");
        let look = PlainLook::new(&loaded, &Never);
        for piece in Piece::of(&loaded, 0) {
            let count = usize::try_from(piece.places).expect("a few");
            let mut seen = Seen::new(piece, count);
            let fractions = [0.1, 0.5, 0.8].map(|share| piece.start + share * (piece.end - piece.start));
            look.look(&fractions, &mut seen).expect("a look");
            for moment in 0..fractions.len() {
                let carry = seen.values(moment)[..count].iter().map(|&force_n| force_n > 0.0);
                let are_pressed = seen.pressed(moment).iter().map(|&pressed_rad| pressed_rad > 0.0);
                assert!(carry.eq(are_pressed), "{:?}", seen.pressed(moment));
                assert!(
                    seen.pressed(moment).iter().any(|&pressed_rad| pressed_rad < 0.0),
                    "{:?}",
                    seen.pressed(moment)
                );
            }
        }
    }
}
