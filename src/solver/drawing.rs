//! Sections of the parts in the plane, as outlines of lines, arcs and sampled curves, and their placements in the
//! assembly (docs/explanation/theory.md section 8).

use std::f64::consts::PI;

use nalgebra::{Point2, Rotation2, Unit, Vector2};

use crate::arcs;
pub use crate::arcs::ArcStart;
use crate::cam::Cam;
use crate::contact::Part;
use crate::drive::{Draft, Drive, DriveError, ToothShape};
use crate::findings::{self, Finding};
use crate::gaps::RAD_PER_ARCSEC;
use crate::outline::{Curve, POINTS_PER_CHORD, chords, ends_of_chords};
pub use crate::outline::{Edge, Outline, SPLINE_SHARE_OF_CHORD};
use crate::parts::{CarrierPart, MadePart, PartsParameters};
use crate::profile::{
    Density, Extent, ProfileParameters, SampledCurve, cam_half_lobe, cam_half_lobes, direction, expected_points,
};
use crate::root::NotConverged;
use crate::spline;
use crate::tooth_space::ToothSpace;
use crate::violation::Parameter;
use crate::{SolveError, Stop};

/// Subject of a drawing.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, serde::Deserialize, utoipa::ToSchema))]
#[cfg_attr(feature = "document", serde(rename_all = "kebab-case"))]
pub enum DrawnPart {
    /// The ring, x along the middle of a tooth space.
    Ring,
    /// The wave generator, x along the middle of a lobe, the major axis of an ellipse.
    WaveGenerator,
    /// The carrier, x along a slot.
    Carrier,
    /// A tooth.
    Tooth,
    /// All parts in the ring's frame, at the document's input angle.
    Assembly,
}

/// Placement of a section: rotated about its origin, then moved.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema), schema(as = PlacementAnswer))]
pub struct Placement {
    /// x of the origin.
    pub x_mm: f64,
    /// y of the origin.
    pub y_mm: f64,
    /// Rotation, counter-clockwise.
    pub rotation_deg: f64,
}

/// Part as prisms of one section. Teeth and the fingers between the carrier's slots have several placements.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema), schema(as = BodyAnswer))]
#[non_exhaustive]
pub struct Body {
    /// Name of the part.
    pub part: Part,
    /// Shape of the solid on its section.
    pub solid: BodySolid,
    /// Height of the prism. For a ball, that of the parts around it, with the ball in the middle.
    pub width_mm: f64,
    /// Outer boundary of the section.
    pub outer: Outline,
    /// Holes in the section.
    pub holes: Vec<Outline>,
    /// Placement of each prism.
    pub placements: Vec<Placement>,
}

/// Shape of the solid on a section.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[cfg_attr(feature = "document", derive(serde::Serialize, utoipa::ToSchema), serde(rename_all = "snake_case"))]
pub enum BodySolid {
    /// A prism, from the plane of the section upward.
    Prism,
    /// A ball of the section's radius. Its centre is half the width above the section.
    Ball,
}

/// Parameters of a drawing.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DrawingParameters {
    /// Largest distance of a chord from its curve.
    pub chord_tolerance_mm: f64,
    /// Largest number of points over all curves of one section.
    pub max_points: u64,
    /// Angle of the wave generator, used only for an assembly.
    pub input_angle_deg: f64,
}

impl Default for DrawingParameters {
    fn default() -> Self {
        Self { chord_tolerance_mm: 1e-3, max_points: u64::MAX, input_angle_deg: 0.0 }
    }
}

impl DrawnPart {
    /// All subjects.
    pub const ALL: [Self; 5] = [Self::Ring, Self::WaveGenerator, Self::Carrier, Self::Tooth, Self::Assembly];

    /// Returns the drawn parts, from the outside in.
    pub const fn parts(self) -> &'static [Part] {
        match self {
            Self::Ring => &[Part::Ring],
            Self::WaveGenerator => &[Part::WaveGenerator],
            Self::Carrier => &[Part::Carrier],
            Self::Tooth => &[Part::Teeth],
            Self::Assembly => &[Part::Ring, Part::Carrier, Part::Teeth, Part::WaveGenerator],
        }
    }
}

impl Placement {
    /// Moves a point of the section to its place.
    pub fn placing(&self) -> impl Fn([f64; 2]) -> [f64; 2] + use<> {
        let Self { x_mm, y_mm, rotation_deg } = *self;
        let (sin, cos) = rotation_deg.to_radians().sin_cos();
        move |[x, y]| [x_mm + (x * cos - y * sin), y_mm + (x * sin + y * cos)]
    }
}

/// Checked drawing.
#[derive(Debug, Clone, PartialEq)]
pub struct Drawing {
    drive: Drive,
    parts: Vec<MadePart>,
    carrier_rotation_rad: f64,
    subject: DrawnPart,
    parameters: DrawingParameters,
}

impl Drawing {
    /// Checks the parameters of the subject.
    ///
    /// ```
    /// use toothwave_solver::drawing::{Drawing, DrawingParameters, DrawnPart};
    /// use toothwave_solver::drive::Draft;
    /// use toothwave_solver::parts::PartsParameters;
    /// use toothwave_solver::{DriveParameters, Never};
    ///
    /// let draft = Draft::new(&DriveParameters::default()).unwrap();
    /// let parameters = DrawingParameters { chord_tolerance_mm: 0.01, ..DrawingParameters::default() };
    /// let drawing = Drawing::new(&draft, DrawnPart::Assembly, &PartsParameters::default(), &parameters).unwrap();
    /// let bodies = drawing.bodies(&Never).unwrap();
    /// assert!(bodies.len() >= 4);
    /// ```
    ///
    /// # Errors
    /// Every reason why it cannot be made, including those of the drive.
    pub fn new(
        draft: &Draft,
        subject: DrawnPart,
        parts: &PartsParameters,
        parameters: &DrawingParameters,
    ) -> Result<Self, DriveError> {
        let mut violations = draft.violations().to_vec();
        violations.extend(Parameter::ChordTolerance.check(parameters.chord_tolerance_mm));
        if subject == DrawnPart::Assembly {
            violations.extend(Parameter::InputAngle.check(parameters.input_angle_deg));
        }
        violations.extend(subject.parts().iter().flat_map(|&part| parts.violations(part, draft)));
        let Some(drive) = draft.drive().filter(|_| violations.is_empty()) else {
            return Err(DriveError::Impossible(violations));
        };
        let carrier_rotation_rad = RAD_PER_ARCSEC * parts.modification.carrier_rotation_arcsec;
        let made = subject.parts().iter().map(|&part| MadePart::new(part, &drive, parts));
        let parts = made.collect::<Result<_, DriveError>>()?;
        Ok(Self { drive, parts, carrier_rotation_rad, subject, parameters: *parameters })
    }

    /// Returns the drive.
    pub const fn drive(&self) -> &Drive {
        &self.drive
    }

    /// Returns the subject.
    pub const fn subject(&self) -> DrawnPart {
        self.subject
    }

    /// Returns the parameters.
    pub const fn parameters(&self) -> &DrawingParameters {
        &self.parameters
    }

    /// Returns the findings about the drawn parts as manufactured.
    ///
    /// # Errors
    /// [`NotConverged`] from the geometry.
    pub fn findings(&self) -> Result<Vec<Finding>, NotConverged> {
        let of_parts = self.parts.iter().map(|part| findings::of_made_part(&self.drive, part));
        Ok(of_parts.collect::<Result<Vec<_>, NotConverged>>()?.concat())
    }

    /// Returns the approximate number of curve points. The true number is at least this, and may be several times
    /// larger.
    pub fn expected_points(&self) -> u64 {
        let has_curves = |part: &MadePart| match part {
            MadePart::Ring { .. } => true,
            MadePart::WaveGenerator { set_back_mm, .. } => self.cam_circle(*set_back_mm).is_none(),
            MadePart::Carrier(_) | MadePart::Teeth { .. } => false,
        };
        if !self.parts.iter().any(has_curves) {
            return 0;
        }
        let DrawingParameters { chord_tolerance_mm, max_points, .. } = self.parameters;
        expected_points(&self.drive, &ProfileParameters { chord_tolerance_mm, extent: Extent::Full, max_points })
    }

    /// Draws the parts.
    ///
    /// # Errors
    /// [`SolveError::TooManyPoints`], [`SolveError::Stopped`], and [`SolveError::NotConverged`] from the geometry.
    pub fn bodies(&self, stop: &dyn Stop) -> Result<Vec<Body>, SolveError> {
        self.parts.iter().map(|part| self.body(part, stop)).collect()
    }

    fn body(&self, part: &MadePart, stop: &dyn Stop) -> Result<Body, SolveError> {
        let (part, outer, holes) = match part {
            MadePart::Ring { space, outer_radius_mm } => {
                let hole = Outline::Path { edges: self.ring_edges(space, stop)? };
                (Part::Ring, Outline::Circle { radius_mm: *outer_radius_mm }, vec![hole])
            }
            MadePart::WaveGenerator { set_back_mm, bore_radius_mm } => {
                let edges = match self.cam_circle(*set_back_mm) {
                    Some(halves) => halves.into(),
                    None => self.cam_edges(*set_back_mm, stop)?,
                };
                let bore = bore_radius_mm.map(|radius_mm| Outline::Circle { radius_mm });
                (Part::WaveGenerator, Outline::Path { edges }, bore.into_iter().collect())
            }
            MadePart::Carrier(carrier) => {
                (Part::Carrier, Outline::Path { edges: finger(&self.drive, carrier) }, Vec::new())
            }
            MadePart::Teeth { radius_mm, half_width_mm } => {
                (Part::Teeth, tooth_outline(*radius_mm, *half_width_mm), Vec::new())
            }
        };
        let is_ball = part == Part::Teeth && matches!(self.drive.parameters().tooth, ToothShape::Ball { .. });
        Ok(Body {
            part,
            solid: if is_ball { BodySolid::Ball } else { BodySolid::Prism },
            width_mm: self.drive.tooth_width_mm(),
            outer,
            holes,
            placements: self.placements(part)?,
        })
    }

    /// Returns the edges of the ring's tooth spaces, from tip to tip. Bored or rotated flanks leave lands between these.
    fn ring_edges(&self, made: &ToothSpace, stop: &dyn Stop) -> Result<Vec<Edge>, SolveError> {
        let teeth = self.drive.parameters().ring_teeth.unsigned_abs();
        let (tip, tip_rad) = (made.tip, PI / teeth as f64);
        let flanks = made.flanks(tip_rad, self.density(), stop)?;
        let chords: usize = flanks.iter().map(|flank| chords(&flank.points)).sum();
        self.require_points(chords as u64 * teeth)?;
        let curve = |flank: &SampledCurve| Curve::new(flank, self.parameters.chord_tolerance_mm);
        let flanks: Vec<_> = flanks.iter().map(curve).collect();
        let (first, middle, last) = (&flanks[0], &flanks[flanks.len() / 2], &flanks[flanks.len() - 1]);
        let (start, root, end) = (first.points[0], middle.points[0], last.points[last.points.len() - 1]);
        let turned = |copy: u64| Rotation2::new(2.0 * PI * ((copy % teeth) as f64 / teeth as f64));
        let mut edges: Vec<Edge> = Vec::new();
        let end_of = |edges: &[Edge]| Point2::from(edges.last().map(Edge::end).unwrap_or_default());
        for copy in 0..teeth {
            let next = turned(copy + 1) * start;
            for (index, flank) in flanks.iter().enumerate() {
                let mut flank = flank.turned(&turned(copy));
                if made.root_arc_rad() > 0.0 && index == flanks.len() / 2 {
                    let (radius_mm, sweep_rad) = (root.coords.norm(), 2.0 * made.root_arc_rad());
                    edges.push(Edge::arc(end_of(&edges), flank.points[0], radius_mm, sweep_rad));
                }
                if !tip.has_land && index + 1 == flanks.len() {
                    flank.end_at(next);
                }
                edges.push(flank.into());
            }
            if tip.has_land {
                let land_rad = 2.0 * (tip_rad - end.y.atan2(end.x));
                edges.push(Edge::arc(end_of(&edges), next, tip.radius_mm, land_rad));
            }
        }
        Ok(edges)
    }

    /// Returns the halves of an eccentric with its lobe along x, from the rightmost point through the uppermost one, and
    /// back.
    fn cam_circle(&self, set_back_mm: f64) -> Option<[Edge; 2]> {
        let Cam::Harmonic(harmonic) = self.drive.flank().cam else { return None };
        let (x_mm, radius_mm) = (harmonic.amplitude_mm, harmonic.mean_radius_mm - set_back_mm);
        let half = |sign: f64| Edge::Arc {
            x_mm: [x_mm + sign * radius_mm, x_mm, x_mm - sign * radius_mm],
            y_mm: [0.0, sign * radius_mm, 0.0],
            center_mm: [x_mm, 0.0],
            radius_mm,
            sweep_deg: 180.0,
        };
        harmonic.is_circle().then(|| [half(1.0), half(-1.0)])
    }

    /// Returns the edges of a cam between all lobes and valleys.
    fn cam_edges(&self, set_back_mm: f64, stop: &dyn Stop) -> Result<Vec<Edge>, SolveError> {
        let (locus, lobes) = (self.drive.flank().locus(), self.drive.lobes());
        let half_lobe = cam_half_lobe(locus, set_back_mm, self.density(), stop)?;
        let half = chords(&half_lobe.points);
        self.require_points(u64::from(2 * lobes) * half as u64)?;
        let tolerance_mm = self.parameters.chord_tolerance_mm;
        let points = ends_of_chords(&half_lobe.points);
        // The last pole of each polygon is the first of the next.
        let polygons = spline::polygons(&half_lobe, SPLINE_SHARE_OF_CHORD * tolerance_mm);
        let poles = points[..1].iter().chain(polygons.iter().flat_map(|polygon| &polygon[1..])).copied().collect();
        let degrees: Vec<_> = polygons.iter().map(|polygon| polygon.len() - 1).collect();
        let arcs = arcs::arcs(&half_lobe, tolerance_mm);
        let corners = arcs.iter().map(|arc| arc.point).chain(half_lobe.points.last().copied()).collect();
        // The angles of an arc are equal from both ends.
        let bulges: Vec<_> = arcs.iter().map(|arc| arc.bulge).collect();
        let [points, poles, corners] = [points, poles, corners].map(|half| cam_half_lobes(&half, lobes));
        // At a lobe or a valley the tangent is perpendicular to the radius.
        let across = |end: u32| {
            let radial = direction(end, 2 * lobes);
            Unit::new_unchecked(Vector2::new(0.0 - radial.y, radial.x))
        };
        let edges = (0..2 * lobes).zip(points.into_iter().zip(poles.iter().zip(&corners))).map(|(index, half)| {
            let (points, (poles, corners)) = half;
            let (mut degrees, mut bulges) = (degrees.clone(), bulges.clone());
            if index % 2 == 1 {
                degrees.reverse();
                bulges.reverse();
            }
            let mut last = 0;
            let polygon = |degree: usize| {
                last += degree;
                poles[last - degree..=last].to_vec()
            };
            Edge::from(Curve {
                points,
                tangents: [across(index), across((index + 1) % (2 * lobes))],
                polynomials: degrees.into_iter().map(polygon).collect(),
                arcs: corners.iter().zip(bulges).map(|(&point, bulge)| ArcStart { point, bulge }).collect(),
            })
        });
        Ok(edges.collect())
    }

    /// Returns the placements of a part's prisms: in the ring's frame for an assembly, otherwise in its own. The
    /// carrier rotates by `j (Z_G - Z_K)/Z_G`. Tooth i is in slot i, at `ψ_i = i 2π/Z'_G - j Z_K/Z_G` from the first
    /// lobe (docs/explanation/theory.md section 3).
    fn placements(&self, part: Part) -> Result<Vec<Placement>, SolveError> {
        let p = self.drive.parameters();
        // A carrier that is rotated away from the flank under load is slightly ahead of its teeth.
        let is_assembly = self.subject == DrawnPart::Assembly;
        let (input_turns, turned_away) = if is_assembly {
            let away_rad = self.drive.sense() * self.carrier_rotation_rad;
            (self.parameters.input_angle_deg / 360.0, away_rad / (2.0 * PI))
        } else {
            (0.0, 0.0)
        };
        let rotation_rad = |turns: f64| 2.0 * PI * turns.rem_euclid(1.0);
        let turned = |turns: f64| Placement { rotation_deg: rotation_rad(turns).to_degrees(), ..Placement::default() };
        let carrier_turns = input_turns / self.drive.transmission_ratio();
        let slots = (0..p.installed).map(|slot| slot as f64 / p.installed as f64);
        Ok(match part {
            Part::WaveGenerator => vec![turned(input_turns)],
            Part::Carrier => slots.map(|slot| turned(slot + carrier_turns + turned_away)).collect(),
            Part::Teeth if is_assembly => {
                let from_lobe = input_turns * (p.ring_teeth as f64 / p.teeth as f64);
                let placed = slots.map(|slot| {
                    let (sin, cos) = rotation_rad(slot + carrier_turns).sin_cos();
                    let center_radius_mm =
                        self.drive.flank().locus().center_radius_at_mm(rotation_rad(slot - from_lobe))?;
                    let (x_mm, y_mm) = (center_radius_mm * cos, center_radius_mm * sin);
                    Ok(Placement { x_mm, y_mm, ..turned(slot + carrier_turns) })
                });
                placed.collect::<Result<_, SolveError>>()?
            }
            Part::Ring | Part::Teeth => vec![Placement::default()],
        })
    }

    const fn density(&self) -> Density {
        Density {
            tolerance_mm: self.parameters.chord_tolerance_mm,
            points_per_chord: POINTS_PER_CHORD,
            max_chords: self.parameters.max_points,
        }
    }

    fn require_points(&self, points: u64) -> Result<(), SolveError> {
        let limit = self.parameters.max_points;
        if points > limit { Err(SolveError::TooManyPoints { points, limit }) } else { Ok(()) }
    }
}

/// Returns the outline of a tooth: a circle, or two arcs joined by flats parallel to its slot, which is along x.
fn tooth_outline(radius_mm: f64, half_width_mm: f64) -> Outline {
    if half_width_mm >= radius_mm {
        return Outline::Circle { radius_mm };
    }
    let half_length_mm = ((radius_mm - half_width_mm) * (radius_mm + half_width_mm)).sqrt();
    let corner = |x: f64, y: f64| Point2::new(x * half_length_mm, y * half_width_mm);
    let arc = |start, end| Edge::arc(start, end, radius_mm, 2.0 * half_width_mm.atan2(half_length_mm));
    let (right, left) = ([corner(1.0, -1.0), corner(1.0, 1.0)], [corner(-1.0, 1.0), corner(-1.0, -1.0)]);
    let edges = vec![
        arc(right[0], right[1]),
        Edge::line(right[1], left[0]),
        arc(left[0], left[1]),
        Edge::line(left[1], right[0]),
    ];
    Outline::Path { edges }
}

/// Returns the finger between slots 0 and 1 of the widest possible carrier: from the cam's major axis to the ring's
/// tips, with slots as wide as a tooth (docs/explanation/theory.md sections 7 and 8). None if there is no space.
pub fn widest_finger(drive: &Drive) -> Option<Vec<Edge>> {
    CarrierPart::widest(drive).map(|carrier| finger(drive, &carrier))
}

/// Returns a finger of the carrier, between the walls of slot 0, along x, and slot 1. It is pointed if the slots overlap
/// beyond the inner radius.
fn finger(drive: &Drive, carrier: &CarrierPart) -> Vec<Edge> {
    let CarrierPart { inner_radius_mm, outer_radius_mm, slot_half_width_mm: wall } = *carrier;
    let half_spacing_rad = PI / drive.parameters().installed as f64;
    let to_next = Rotation2::new(2.0 * half_spacing_rad);
    // Point on the wall of slot 0 at a radius; its mirror image is on the near wall of slot 1.
    let on_wall = |radius_mm: f64| Point2::new(((radius_mm - wall) * (radius_mm + wall)).sqrt(), wall);
    let on_next = |point: Point2<f64>| to_next * Point2::new(point.x, -point.y);
    let sweep_rad = |radius_mm: f64| 2.0 * (half_spacing_rad - (wall / radius_mm).asin());
    let outer = on_wall(outer_radius_mm);
    let rim = Edge::arc(outer, on_next(outer), outer_radius_mm, sweep_rad(outer_radius_mm));
    let meet_radius_mm = wall / half_spacing_rad.sin();
    if meet_radius_mm < inner_radius_mm {
        let inner = on_wall(inner_radius_mm);
        vec![
            Edge::line(inner, outer),
            rim,
            Edge::line(on_next(outer), on_next(inner)),
            Edge::arc(on_next(inner), inner, inner_radius_mm, -sweep_rad(inner_radius_mm)),
        ]
    } else {
        let point = Point2::new(meet_radius_mm * half_spacing_rad.cos(), wall);
        vec![Edge::line(point, outer), rim, Edge::line(on_next(outer), point)]
    }
}
