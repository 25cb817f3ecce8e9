//! Contacts other than line contacts, in columns: the ellipses of balls and the flats of flat-sided teeth
//! (docs/explanation/theory.md sections 4.3 and 5).

use pulp::Simd;

use super::curve::Curves;
use super::lanes::{LANES, cube_root, ln};
use super::tile::Tile;
use crate::cam::ToothCenter;
use crate::contact::{Contact, PerContact};
use crate::load_sharing::LoadedDrive;
use crate::position::Position;
use crate::tooth::{BallContact, Flat, StressExponents};

/// Number of intervals of the flank used to find the range of the curves' arguments.
const INTERVALS: u32 = 32;

/// Pressure model of the three contacts.
pub(super) enum Pressures {
    /// Lines at all three contacts, computed with the geometry.
    Lines,
    /// Ellipses at all three contacts.
    Ellipses(Ellipses),
    /// Lines at wave generator and ring, a flat at the carrier.
    Flat(FlatColumns),
}

impl Pressures {
    /// Builds the model; none if its curves need too many terms.
    pub(super) fn new(loaded: &LoadedDrive<'_>) -> Option<Self> {
        if let Some(ball) = loaded.contacts.ball(Contact::WaveGenerator) {
            Ellipses::new(loaded, &ball).map(Self::Ellipses)
        } else if let Some(flat) = loaded.contacts.flat() {
            FlatColumns::new(loaded, flat).map(Self::Flat)
        } else {
            Some(Self::Lines)
        }
    }

    /// Returns `E*/(π L1)` of each contact; 1 for balls, whose curvatures are needed first.
    pub(super) fn hertz(&self, loaded: &LoadedDrive<'_>) -> PerContact<f64> {
        PerContact::of(|contact| match self {
            Self::Lines | Self::Flat(_) => loaded.contacts.hertz.get(contact).modulus_per_width_mpa_per_mm,
            Self::Ellipses(_) => 1.0,
        })
    }

    /// Returns the powers of the stresses to which forces are proportional.
    pub(super) const fn stress_exponents(&self) -> StressExponents {
        match self {
            Self::Lines => StressExponents::Lines,
            Self::Ellipses(_) => StressExponents::Ellipses,
            Self::Flat(_) => StressExponents::LinesAndFlat,
        }
    }

    /// Completes a tile: stresses under 1 N at the wave generator, and the place-dependent part of the law. Returns
    /// false if it needs the plain path.
    #[inline(always)]
    pub(super) fn finish<V: Simd>(&self, tile: &mut Tile<'_>) -> bool {
        match self {
            Self::Lines => true,
            Self::Ellipses(ellipses) => ellipses.finish::<V>(tile),
            Self::Flat(flat) => flat.finish::<V>(tile),
        }
    }
}

/// Returns centres and curvatures along the engaged flank.
fn along_flank(loaded: &LoadedDrive<'_>) -> Option<Vec<(ToothCenter, PerContact<f64>)>> {
    let limit = loaded.mesh().flank_limit().position;
    let lobes = loaded.drive().lobes();
    let position = |place: u32| {
        if place < INTERVALS {
            Position::from_lobe(limit.from_lobe_rad * f64::from(place) / f64::from(INTERVALS), lobes)
        } else {
            limit
        }
    };
    (0..=INTERVALS).map(|place| loaded.center_and_curvatures(position(place)).ok()).collect()
}

/// Approach `q` and pressure of an ellipse under 1 N, over the logarithm of the curvature in the plane of motion. The
/// pressure is divided by that curvature's root, to which it is proportional for large curvatures.
struct EllipseCurves(Curves<2>);

impl EllipseCurves {
    fn new(ball: &BallContact, curvatures_per_mm: impl Iterator<Item = f64>) -> Option<Self> {
        let of_ln = |ln: f64| {
            let curvature_per_mm = ln.exp();
            let ellipse = ball.at(curvature_per_mm).ok()?;
            Some([ellipse.coefficient(), ellipse.stress_mpa(1.0) / curvature_per_mm.sqrt()])
        };
        Curves::around(curvatures_per_mm.map(f64::ln), of_ln).map(Self)
    }

    /// Returns `q` and the pressure under 1 N; none if a curvature is beyond the range.
    #[inline(always)]
    fn at<V: Simd>(&self, curvature_per_mm: &[f64; LANES], count: usize) -> Option<[[f64; LANES]; 2]> {
        let mut logarithms = [0.0; LANES];
        for i in 0..LANES {
            logarithms[i] = ln::<V>(curvature_per_mm[i]);
        }
        let ([coefficients, mut stresses], farthest) = self.0.at::<V>(&logarithms, count);
        for i in 0..LANES {
            stresses[i] *= curvature_per_mm[i].sqrt();
        }
        (farthest <= 1.0).then_some([coefficients, stresses])
    }
}

/// The ellipses of balls.
pub(super) struct Ellipses {
    wave_generator: EllipseCurves,
    ring: EllipseCurves,
    /// `q` and the pressure under 1 N on the flat wall of a slot, the same everywhere.
    carrier: [f64; 2],
}

impl Ellipses {
    fn new(loaded: &LoadedDrive<'_>, on_cam: &BallContact) -> Option<Self> {
        let places = along_flank(loaded)?;
        let curvatures = |contact| places.iter().map(move |(_, curvatures)| *curvatures.get(contact));
        let on_wall = loaded.contacts.ball(Contact::Carrier)?.at(places.first()?.1.carrier).ok()?;
        Some(Self {
            wave_generator: EllipseCurves::new(on_cam, curvatures(Contact::WaveGenerator))?,
            ring: EllipseCurves::new(&loaded.contacts.ball(Contact::Ring)?, curvatures(Contact::Ring))?,
            carrier: [on_wall.coefficient(), on_wall.stress_mpa(1.0)],
        })
    }

    /// The stress columns contain curvatures. `c = Σ q f^(5/3)` by virtual work.
    #[inline(always)]
    fn finish<V: Simd>(&self, tile: &mut Tile<'_>) -> bool {
        let [carrier_coefficient, carrier_stress] = self.carrier;
        for chunk in 0..tile.count.div_ceil(LANES) {
            let count = tile.count - chunk * LANES;
            let c = &mut tile.work.given.as_chunks_mut::<LANES>().0[chunk];
            let (ring, carrier) =
                (&tile.force.ring.as_chunks::<LANES>().0[chunk], &tile.force.carrier.as_chunks::<LANES>().0[chunk]);
            let on_cam = &mut tile.stress.wave_generator.as_chunks_mut::<LANES>().0[chunk];
            let on_ring = &mut tile.stress.ring.as_chunks_mut::<LANES>().0[chunk];
            let on_wall = &mut tile.stress.carrier.as_chunks_mut::<LANES>().0[chunk];
            let Some([cam_coefficients, cam_stresses]) = self.wave_generator.at::<V>(on_cam, count) else {
                return false;
            };
            let Some([ring_coefficients, ring_stresses]) = self.ring.at::<V>(on_ring, count) else { return false };
            for i in 0..LANES {
                let (ring_root, carrier_root) = (cube_root::<V>(ring[i]), cube_root::<V>(carrier[i]));
                c[i] = cam_coefficients[i]
                    + ring_coefficients[i] * (ring[i] * (ring_root * ring_root))
                    + carrier_coefficient * (carrier[i] * (carrier_root * carrier_root));
                on_cam[i] = cam_stresses[i];
                on_ring[i] = ring_stresses[i] * ring_root;
                on_wall[i] = carrier_stress * carrier_root;
            }
        }
        true
    }
}

/// The flats of flat-sided teeth.
pub(super) struct FlatColumns {
    flat: Flat,
    /// Compliance over the supported length, if the flat has its own law.
    compliance: Option<Curves<1>>,
}

impl FlatColumns {
    fn new(loaded: &LoadedDrive<'_>, flat: Flat) -> Option<Self> {
        let compliance = if flat.has_own_law {
            let places = along_flank(loaded)?;
            let borne_mm = places.iter().map(|(center, _)| flat.borne_mm(center.center_radius_mm));
            let of_length = |borne_mm: f64| (borne_mm > 0.0).then(|| [flat.compliance_mm_per_n(borne_mm)]);
            Some(Curves::around(borne_mm, of_length)?)
        } else {
            None
        };
        Some(Self { flat, compliance })
    }

    #[inline(always)]
    fn finish<V: Simd>(&self, tile: &mut Tile<'_>) -> bool {
        let under_unit_length_mpa = self.flat.over(1.0).stress_mpa(1.0);
        for chunk in 0..tile.count.div_ceil(LANES) {
            let count = LANES.min(tile.count - chunk * LANES);
            let center_radius_mm = &tile.center_radius_mm.as_chunks::<LANES>().0[chunk];
            let force = &tile.force.carrier.as_chunks::<LANES>().0[chunk];
            let mut borne_mm = [0.0; LANES];
            for i in 0..LANES {
                borne_mm[i] = self.flat.borne_mm(center_radius_mm[i]);
            }
            // The plain path reports which tooth has left its slot.
            if !borne_mm[..count].iter().all(|&borne_mm| borne_mm > 0.0) {
                return false;
            }
            if let Some(compliance) = &self.compliance {
                let ([compliances], farthest) = compliance.at::<V>(&borne_mm, count);
                if farthest.is_nan() || farthest > 1.0 {
                    return false;
                }
                tile.work.given.as_chunks_mut::<LANES>().0[chunk] = compliances;
            }
            let stress = &mut tile.stress.carrier.as_chunks_mut::<LANES>().0[chunk];
            for i in 0..LANES {
                stress[i] = force[i] * (under_unit_length_mpa / borne_mm[i]);
            }
        }
        true
    }
}
