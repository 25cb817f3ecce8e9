//! Geometry: profiles of the mating parts and the key figures of a design.

use std::io::{self, Write};

use serde::Serialize;
use toothwave_solver::drawing;
use toothwave_solver::losses::{Fixed, Mechanism};
use toothwave_solver::mesh::Mesh;
use toothwave_solver::profile::{self, Polyline, ProfileParameters};
use toothwave_solver::{Drive, Parameter, Stop};
use utoipa::ToSchema;

use crate::design::Design;
use crate::findings::{FindingAnswer, drive_findings, write_findings};
use crate::forms::{Form, Format, Forms, write_csv};
use crate::no_answer::NoAnswer;
use crate::question::{Limits, Question, checked_drive, require_finite};

/// Geometry of a drive. Ring and path are in the ring's frame: x runs through the middle of a tooth space. The wave
/// generator is in its own frame: x runs through the middle of a lobe (the major axis of an ellipse).
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct GeometryAnswer {
    /// Version of the solver.
    pub solver_version: &'static str,
    /// Build of the program. Equal builds on equal processors give equal bytes.
    pub build: &'static str,
    /// `i_HG = Z_G/(Z_G - Z_K)`: input speed over carrier speed, ring fixed.
    pub transmission_ratio: f64,
    /// `i_HK = -Z_K/(Z_G - Z_K)`: input speed over ring speed, carrier fixed.
    pub transmission_ratio_carrier_fixed: f64,
    /// Ratios and torques for each choice of the fixed member, without losses. For friction see `losses` of a sweep.
    pub members: MembersAnswer,
    /// Input angle after which the load pattern repeats.
    pub period_deg: f64,
    /// Undercut of the ring's tips.
    pub undercut: UndercutAnswer,
    /// Range of positions in which a tooth touches the ring's flank.
    pub engagement: EngagementAnswer,
    /// The ring.
    pub ring: RingAnswer,
    /// The wave generator.
    pub wave_generator: WaveGeneratorAnswer,
    /// The carrier, an annulus between wave generator and ring tips.
    pub carrier: CarrierAnswer,
    /// Clearance between the teeth.
    pub teeth: TeethAnswer,
    /// Path of a tooth's centre in the ring's frame.
    pub tooth_center_path: ProfileAnswer,
    /// Findings about the design.
    pub findings: Vec<FindingAnswer>,
}

/// Ratios and torques for each fixed member. If driven in reverse, each ratio is its reciprocal, and the holding torque
/// is relative to the output torque.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct MembersAnswer {
    /// The wave generator drives the carrier.
    pub ring_fixed: MemberFixedAnswer,
    /// The wave generator drives the ring.
    pub carrier_fixed: MemberFixedAnswer,
    /// The ring drives the carrier.
    pub wave_generator_fixed: MemberFixedAnswer,
}

/// Ratio and torques with one member fixed, without losses. Negative for the opposite direction.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct MemberFixedAnswer {
    /// Speed of the driving member over speed of the driven one; also output torque over input torque.
    pub ratio: f64,
    /// Torque that holds the fixed member, over the input torque.
    pub holding_torque_ratio: f64,
}

/// Undercut of the ring's tips by their own envelope.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct UndercutAnswer {
    /// True if undercut occurs, before any bore.
    pub occurs: bool,
    /// Smallest tooth radius with undercut. Absent if no radius has it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub critical_tooth_radius_mm: Option<f64>,
}

/// Positions at which a tooth begins and ends to touch the ring's flank, as polar angles from the middle of its lobe
/// (the major axis of an ellipse).
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct EngagementAnswer {
    /// Begin, near the tip.
    #[schema(minimum = 0, maximum = 180)]
    pub start_deg: f64,
    /// End, at the root.
    pub end_deg: f64,
}

/// The ring.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct RingAnswer {
    /// Radius at the middle of a tooth space.
    pub root_radius_mm: f64,
    /// Radius of the tips: natural, trimmed by undercut, or bored.
    pub tip_radius_mm: f64,
    /// Root radius minus tip radius.
    pub tooth_height_mm: f64,
    /// Largest pressure angle β of the engaged flank, between its normal and the radius.
    pub pressure_angle_max_deg: f64,
    /// Profile.
    pub profile: ProfileAnswer,
}

/// The wave generator.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct WaveGeneratorAnswer {
    /// Largest pressure angle γ of an engaged tooth, between the cam's normal and the radius.
    pub pressure_angle_max_deg: f64,
    /// Closed profile.
    pub profile: ProfileAnswer,
}

/// Space for the carrier between the other parts, and its thinnest wall.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct CarrierAnswer {
    /// Lower limit of its inner radius: the wave generator's largest radius (the semi-major axis of an ellipse).
    pub inner_radius_limit_mm: f64,
    /// Upper limit of its outer radius: the ring's tip radius.
    pub outer_radius_limit_mm: f64,
    /// Difference of the two limits, for the carrier and its radial clearances.
    pub radial_space_mm: f64,
    /// Smallest wall thickness between two slots, at the inner limit. Zero or negative if the slots overlap.
    pub slot_wall_mm: f64,
    /// Smallest distance of an engaged tooth's centre from the inner limit. Negative if it leaves the annulus.
    pub tooth_center_clearance_inner_mm: f64,
    /// Smallest distance of an engaged tooth's centre from the outer limit. Negative if it leaves the annulus.
    pub tooth_center_clearance_outer_mm: f64,
    /// The slot wall that supports a loaded tooth.
    pub loaded_wall: SlotWall,
    /// The finger between slots 0 and 1 of a carrier that fills the annulus. Absent if no material is left between the
    /// slots.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub finger: Option<FingerAnswer>,
}

/// A wall of a slot, relative to the direction of rotation of the wave generator.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SlotWall {
    /// Ahead of the tooth.
    Leading,
    /// Behind the tooth.
    Trailing,
}

/// Finger between two neighbouring slots of a carrier without clearance, in the carrier's frame: slot 0 is along x.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct FingerAnswer {
    /// Corners, counter-clockwise from the inner end of slot 0's wall: four, or three if the slots overlap. An arc of
    /// the outer limit joins the second and third. An arc of the inner limit joins the fourth and first. The other
    /// edges are straight.
    pub corners: ProfileAnswer,
}

/// Clearance between the teeth.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct TeethAnswer {
    /// Smallest gap between neighbouring installed teeth on their path.
    pub gap_min_mm: f64,
}

/// A curve as lists of coordinates with equal length.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ProfileAnswer {
    /// x coordinates.
    pub x_mm: Vec<f64>,
    /// y coordinates.
    pub y_mm: Vec<f64>,
}

impl From<&Polyline> for ProfileAnswer {
    fn from(polyline: &Polyline) -> Self {
        Self {
            x_mm: polyline.iter().map(|point| point.x).collect(),
            y_mm: polyline.iter().map(|point| point.y).collect(),
        }
    }
}

impl From<&Drive> for MembersAnswer {
    fn from(drive: &Drive) -> Self {
        let mechanism = Mechanism::of(drive);
        let of = |fixed| MemberFixedAnswer {
            ratio: mechanism.speed_ratio(fixed),
            holding_torque_ratio: mechanism.holding_torque_ratio(fixed),
        };
        Self {
            ring_fixed: of(Fixed::Ring),
            carrier_fixed: of(Fixed::Carrier),
            wave_generator_fixed: of(Fixed::WaveGenerator),
        }
    }
}

impl From<&Drive> for UndercutAnswer {
    fn from(drive: &Drive) -> Self {
        let flank = drive.flank();
        Self { occurs: flank.is_undercut(), critical_tooth_radius_mm: flank.critical_tooth_radius_mm() }
    }
}

impl From<&Drive> for EngagementAnswer {
    fn from(drive: &Drive) -> Self {
        Self { start_deg: drive.flank_limit().position.from_lobe_deg(), end_deg: 0.0 }
    }
}

/// The question for the geometry.
#[derive(Debug)]
pub struct Geometry;

/// Bytes of a point: its columns, and the points from which they are made.
const POINT_BYTES: u64 = 2 * size_of::<[f64; 2]>() as u64;

impl Question for Geometry {
    type Checked = (Drive, ProfileParameters);
    type Answer = GeometryAnswer;

    fn name(&self) -> String {
        "geometry".into()
    }

    fn reads(&self, design: &Design) -> impl Serialize {
        (design.in_key().drive, design.profile)
    }

    fn check(&self, design: &Design, limits: &Limits) -> Result<Self::Checked, NoAnswer> {
        let mut violations = Vec::new();
        let drive = checked_drive(design, &mut violations)?.drive();
        violations.extend(Parameter::ChordTolerance.check(design.profile.chord_tolerance_mm));
        let drive = drive.filter(|_| violations.is_empty()).ok_or_else(|| NoAnswer::impossible(&violations))?;
        Ok((drive, ProfileParameters { max_points: limits.max_profile_points, ..design.profile }))
    }

    fn max_bytes((drive, profile): &Self::Checked, format: Format) -> Option<u64> {
        Some(format.bytes_with_text(POINT_BYTES * profile::expected_points(drive, profile)))
    }

    fn answer((drive, profile): &Self::Checked, stop: &dyn Stop) -> Result<GeometryAnswer, NoAnswer> {
        let profiles = profile::profiles(drive, profile, stop)?;
        let (p, cam_outer_mm) = (drive.parameters(), drive.cam_outer_radius_mm());
        let flank = drive.flank();
        let steepest = drive.ring_tooth().steepest_engaged()?;
        let innermost = flank.locus().at(drive.flank_limit().position)?;
        let center_distance_mm = drive.least_center_distance_mm()?;
        let tip_radius_mm = drive.tip_radius_mm();
        let finger = drawing::widest_finger(drive).map(|edges| {
            let [x_mm, y_mm] = [0, 1].map(|axis| edges.iter().map(|edge| edge.start()[axis]).collect());
            FingerAnswer { corners: ProfileAnswer { x_mm, y_mm } }
        });
        let answer = GeometryAnswer {
            solver_version: toothwave_solver::VERSION,
            build: crate::BUILD,
            transmission_ratio: drive.transmission_ratio(),
            transmission_ratio_carrier_fixed: drive.transmission_ratio_carrier_fixed(),
            members: drive.into(),
            period_deg: Mesh::new(drive).period_deg(),
            undercut: drive.into(),
            engagement: drive.into(),
            ring: RingAnswer {
                root_radius_mm: drive.root_radius_mm(),
                tip_radius_mm,
                tooth_height_mm: drive.root_radius_mm() - tip_radius_mm,
                pressure_angle_max_deg: flank.at(&steepest).tan_pressure_angle.atan().to_degrees(),
                profile: (&profiles.ring).into(),
            },
            wave_generator: WaveGeneratorAnswer {
                pressure_angle_max_deg: steepest.tan_pressure_angle.atan().to_degrees(),
                profile: (&profiles.wave_generator).into(),
            },
            carrier: CarrierAnswer {
                inner_radius_limit_mm: cam_outer_mm,
                outer_radius_limit_mm: tip_radius_mm,
                radial_space_mm: tip_radius_mm - cam_outer_mm,
                slot_wall_mm: drive.slot_wall_mm(),
                tooth_center_clearance_inner_mm: innermost.center_radius_mm - cam_outer_mm,
                tooth_center_clearance_outer_mm: tip_radius_mm - (cam_outer_mm + p.tooth_radius_mm),
                // The ring pushes a tooth in the input's direction for s = +1, and against it for s = -1
                // (docs/explanation/theory.md section 5).
                loaded_wall: if drive.sense() > 0.0 { SlotWall::Leading } else { SlotWall::Trailing },
                finger,
            },
            teeth: TeethAnswer { gap_min_mm: center_distance_mm - 2.0 * p.tooth_radius_mm },
            tooth_center_path: (&profiles.tooth_center_path).into(),
            findings: drive_findings(drive)?,
        };
        let profiles = [&answer.ring.profile, &answer.wave_generator.profile, &answer.tooth_center_path];
        require_finite(profiles.into_iter().flat_map(|profile| [&profile.x_mm, &profile.y_mm]))?;
        Ok(answer)
    }
}

impl Forms for GeometryAnswer {
    const FORMS: &'static [(Format, Form<Self>)] = &[(Format::Csv, Self::write_csv), (Format::Text, Self::write_text)];

    fn expected_bytes(&self) -> usize {
        // Two numbers of about 18 characters, each with a comma.
        4096 + 40 * self.points()
    }

    fn held_bytes(&self, _format: Format) -> u64 {
        POINT_BYTES * self.points() as u64
    }
}

impl GeometryAnswer {
    fn points(&self) -> usize {
        let profiles = [&self.ring.profile, &self.wave_generator.profile, &self.tooth_center_path];
        profiles.iter().map(|profile| profile.x_mm.len()).sum()
    }

    fn write_csv(&self, writer: &mut dyn Write) -> io::Result<()> {
        let profiles = [
            ("ring", &self.ring.profile),
            ("wave_generator", &self.wave_generator.profile),
            ("tooth_center_path", &self.tooth_center_path),
        ];
        let rows = profiles.into_iter().flat_map(|(name, profile)| {
            profile.x_mm.iter().zip(&profile.y_mm).map(move |(x_mm, y_mm)| (name, x_mm, y_mm))
        });
        write_csv(&["profile", "x_mm", "y_mm"], rows, writer)
    }

    fn write_text(&self, writer: &mut dyn Write) -> io::Result<()> {
        let (ring, carrier) = (&self.ring, &self.carrier);
        writeln!(writer, "transmission ratio, ring fixed      {}", self.transmission_ratio)?;
        writeln!(writer, "transmission ratio, carrier fixed   {}", self.transmission_ratio_carrier_fixed)?;
        let MembersAnswer { ring_fixed, carrier_fixed, wave_generator_fixed } = &self.members;
        writeln!(writer, "ratio, wave generator fixed         {:.12}", wave_generator_fixed.ratio)?;
        for (name, member) in
            [("ring", ring_fixed), ("carrier", carrier_fixed), ("wave generator", wave_generator_fixed)]
        {
            writeln!(
                writer,
                "torque on the fixed {name:<16}{:.12} times the driving one",
                member.holding_torque_ratio
            )?;
        }
        writeln!(writer, "period of the input angle           {:.6} deg", self.period_deg)?;
        self.undercut.write_text(writer)?;
        self.engagement.write_text(writer)?;
        writeln!(writer, "ring root radius                    {:.6} mm", ring.root_radius_mm)?;
        writeln!(writer, "ring tip radius                     {:.6} mm", ring.tip_radius_mm)?;
        writeln!(writer, "ring tooth height                   {:.6} mm", ring.tooth_height_mm)?;
        writeln!(writer, "largest pressure angle, ring        {:.4} deg", ring.pressure_angle_max_deg)?;
        writeln!(writer, "largest pressure angle, cam         {:.4} deg", self.wave_generator.pressure_angle_max_deg)?;
        writeln!(writer, "radial space for the carrier        {:.6} mm", carrier.radial_space_mm)?;
        writeln!(writer, "thinnest wall between slots         {:.6} mm", carrier.slot_wall_mm)?;
        writeln!(writer, "least gap between teeth             {:.6} mm", self.teeth.gap_min_mm)?;
        writeln!(
            writer,
            "points: ring, wave generator, path  {}, {}, {}",
            ring.profile.x_mm.len(),
            self.wave_generator.profile.x_mm.len(),
            self.tooth_center_path.x_mm.len()
        )?;
        write_findings(&self.findings, writer)
    }
}

impl UndercutAnswer {
    pub(crate) fn write_text(&self, writer: &mut dyn Write) -> io::Result<()> {
        writeln!(writer, "undercut                            {}", if self.occurs { "yes" } else { "no" })?;
        match self.critical_tooth_radius_mm {
            Some(radius) => writeln!(writer, "critical tooth radius               {radius:.6} mm"),
            None => writeln!(writer, "critical tooth radius               none"),
        }
    }
}

impl EngagementAnswer {
    pub(crate) fn write_text(&self, writer: &mut dyn Write) -> io::Result<()> {
        writeln!(writer, "engagement from the lobe's middle   {:.6} to {} deg", self.start_deg, self.end_deg)
    }
}
