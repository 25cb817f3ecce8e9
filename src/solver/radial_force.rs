//! What the teeth together push the wave generator aside with (docs/theory.md section 4.8).

use nalgebra::Vector2;

use crate::locus::ToothCenter;
use crate::mesh::Mesh;

/// A tooth as it presses on the wave generator.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CamLoad<'a> {
    /// The lobe that it is on.
    pub lobe: u32,
    /// Where it stands on it.
    pub center: &'a ToothCenter,
    /// `F_H`.
    pub force_n: f64,
}

/// The force on the wave generator, in its own frame, x along the lobe 0: `-Σ F_H n(φ + 2πu/U)` over all teeth. `teeth` are those that
/// the mesh lists. Where two lobes or more are loaded alike the forces balance each other.
pub fn radial_force_n<'a>(mesh: &Mesh, teeth: impl IntoIterator<Item = CamLoad<'a>>) -> Vector2<f64> {
    if mesh.lobes_loaded_alike() > 1 {
        return Vector2::zeros();
    }
    let mut force = Vector2::zeros();
    for CamLoad { lobe, center, force_n } in teeth {
        let lobe_rad = 2.0 * center.position.half_lobe_rad() * f64::from(lobe);
        let (sin, cos) = (center.normal_rad() + lobe_rad).sin_cos();
        force -= force_n * Vector2::new(cos, sin);
    }
    force
}
