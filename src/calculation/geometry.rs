//! The mating parts' profiles and what a designer decides by.

use std::io::{self, Write};

use serde::Serialize;
use toothwave_solver::drawing::{self, Edge};
use toothwave_solver::losses::{Fixed, Mechanism};
use toothwave_solver::mesh::Mesh;
use toothwave_solver::profile::{self, Polyline, ProfileParameters};
use toothwave_solver::{Drive, SolveError, Stop};
use utoipa::ToSchema;

use crate::design::Design;
use crate::findings::{FindingAnswer, drive_findings, write_findings};
use crate::forms::{Form, Format, Forms, csv_error};
use crate::key::Encode;
use crate::no_answer::NoAnswer;
use crate::question::{Limits, Question, checked_drive, require_finite};

/// The geometry of a drive. Ring and path stand in the ring's frame, x along the middle of a tooth space; the wave generator
/// in its own, x along the middle of a lobe, the major axis of an ellipse.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct GeometryAnswer {
    /// Version of the solver.
    pub solver_version: &'static str,
    /// The build that computed it: equal builds on equal processors give equal bytes.
    pub build: &'static str,
    /// `i_HG = Z_G/(Z_G - Z_K)`: input speed over carrier speed, ring fixed.
    pub transmission_ratio: f64,
    /// `i_HK = -Z_K/(Z_G - Z_K)`: input speed over ring speed, carrier fixed.
    pub transmission_ratio_carrier_fixed: f64,
    /// The members exchanged: ratios and torques by the one that stands still. What friction leaves of them is in a sweep's `losses`.
    pub members: MembersAnswer,
    /// The input angle after which the load pattern repeats.
    pub period_deg: f64,
    /// Whether the ring's tips are cut away.
    pub undercut: UndercutAnswer,
    /// Where a tooth touches the ring's flank.
    pub engagement: EngagementAnswer,
    /// The ring.
    pub ring: RingAnswer,
    /// The wave generator.
    pub wave_generator: WaveGeneratorAnswer,
    /// The carrier, an annulus between wave generator and ring tips.
    pub carrier: CarrierAnswer,
    /// The teeth among each other.
    pub teeth: TeethAnswer,
    /// Path of a tooth's centre in the ring's frame.
    pub tooth_center_path: ProfileAnswer,
    /// What a designer should be told.
    pub findings: Vec<FindingAnswer>,
}

/// The members exchanged, by the one that stands still. Driven the other way round every ratio is its reciprocal, and the torque that holds the
/// fixed member is over the torque that is taken off.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct MembersAnswer {
    /// The wave generator drives the carrier.
    pub ring_fixed: MemberFixedAnswer,
    /// The wave generator drives the ring.
    pub carrier_fixed: MemberFixedAnswer,
    /// The ring drives the carrier.
    pub wave_generator_fixed: MemberFixedAnswer,
}

/// Ratio and torques with one member fixed, losses neglected; negative where the sense is the other one.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct MemberFixedAnswer {
    /// Speed of the driving member over that of the driven one, and torque taken off the driven one over that put into the driving one.
    pub ratio: f64,
    /// Torque that holds the fixed member, over that put into the driving one.
    pub holding_torque_ratio: f64,
}

/// Whether the ring's tips are cut away by their own envelope.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct UndercutAnswer {
    /// Whether they are, before any bore.
    pub occurs: bool,
    /// The least tooth radius that undercuts; left out where none does.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub critical_tooth_radius_mm: Option<f64>,
}

/// The tooth's polar angle from the middle of its lobe, the major axis of an ellipse, where it starts and stops to touch the ring's flank.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct EngagementAnswer {
    /// Where it starts, towards the tip.
    #[schema(minimum = 0, maximum = 180)]
    pub start_deg: f64,
    /// Where it stops, at the root.
    pub end_deg: f64,
}

/// The ring.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct RingAnswer {
    /// Radius at the middle of a tooth space.
    pub root_radius_mm: f64,
    /// Radius of the tips: natural, trimmed by undercut, or bored.
    pub tip_radius_mm: f64,
    /// Root radius less tip radius.
    pub tooth_height_mm: f64,
    /// Largest pressure angle β of the engaged flank (its normal against the radius).
    pub pressure_angle_max_deg: f64,
    /// Its profile.
    pub profile: ProfileAnswer,
}

/// The wave generator.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct WaveGeneratorAnswer {
    /// Largest pressure angle γ of an engaged tooth (the cam's normal against the radius).
    pub pressure_angle_max_deg: f64,
    /// Its closed profile.
    pub profile: ProfileAnswer,
}

/// The room that the mechanics leave the carrier, and its thinnest wall.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct CarrierAnswer {
    /// Its inner radius is above this: the wave generator's largest radius, the semi-major axis of an ellipse.
    pub inner_radius_limit_mm: f64,
    /// Its outer radius is below this: the ring's tip radius.
    pub outer_radius_limit_mm: f64,
    /// The difference of the two, shared by the carrier and its radial clearances.
    pub radial_space_mm: f64,
    /// The wall between two slots at the inner limit, where it is thinnest; not positive where the slots run into each other.
    pub slot_wall_mm: f64,
    /// How far the centre of an engaged tooth stays outside the inner limit at least; negative where it leaves the annulus.
    pub tooth_center_clearance_inner_mm: f64,
    /// How far the centre of an engaged tooth stays inside the outer limit at least; negative where it leaves the annulus.
    pub tooth_center_clearance_outer_mm: f64,
    /// The wall of its slot that a loaded tooth leans on.
    pub loaded_wall: SlotWall,
    /// The finger between slots 0 and 1 of a carrier that fills the annulus; left out where nothing stays between the slots.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub finger: Option<FingerAnswer>,
}

/// A wall of a slot, in the sense in which the wave generator turns.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum SlotWall {
    /// Ahead of the tooth.
    Leading,
    /// Behind the tooth.
    Trailing,
}

/// What stands between two neighbouring slots of a carrier without clearance or play, in the carrier's frame, slot 0 along x.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct FingerAnswer {
    /// Its corners, counter-clockwise from the inner end of slot 0's wall: four, or three where the slots run into each other. The
    /// second and third are joined by an arc of the outer limit, the fourth and first by one of the inner limit, others straight.
    pub corners: ProfileAnswer,
}

/// The teeth among each other.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct TeethAnswer {
    /// The least gap between neighbouring installed teeth anywhere on their path.
    pub gap_min_mm: f64,
}

/// A curve as points of equal index.
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

impl SlotWall {
    /// The ring pushes a tooth along for s = +1, against the input's sense for s = -1 (docs/theory.md section 5).
    fn loaded(drive: &Drive) -> Self {
        if drive.sense() > 0.0 { Self::Leading } else { Self::Trailing }
    }
}

impl FingerAnswer {
    fn new(drive: &Drive) -> Option<Self> {
        let corners: Vec<_> = drawing::widest_finger(drive)?.iter().map(Edge::start).collect();
        Some(Self { corners: (&corners).into() })
    }
}

impl From<&Drive> for EngagementAnswer {
    fn from(drive: &Drive) -> Self {
        Self { start_deg: drive.flank_limit().position.from_lobe_deg(), end_deg: 0.0 }
    }
}

/// What is asked.
#[derive(Debug)]
pub struct Geometry;

/// A point in its columns, and while they are made where they come from.
const POINT_BYTES: u64 = 2 * size_of::<[f64; 2]>() as u64;

impl Question for Geometry {
    type Checked = (Drive, ProfileParameters);
    type Answer = GeometryAnswer;

    fn name(&self) -> &'static str {
        "geometry"
    }

    fn reads<'a>(&self, design: &'a Design) -> impl Encode + 'a {
        (&design.drive, &design.profile)
    }

    fn check(&self, design: &Design, limits: &Limits) -> Result<Self::Checked, NoAnswer> {
        let mut violations = Vec::new();
        let drive = checked_drive(design, &mut violations)?.drive();
        let profile = design.profile_parameters(limits.max_profile_points);
        match (drive, profile) {
            (Some(drive), Ok(profile)) => Ok((drive, profile)),
            (_, profile) => {
                violations.extend(profile.err());
                Err(NoAnswer::impossible(&violations))
            }
        }
    }

    fn max_bytes((drive, profile): &Self::Checked, format: Format) -> Option<u64> {
        Some(format.bytes_with_text(POINT_BYTES * profile::expected_points(drive, profile)))
    }

    fn answer((drive, profile): &Self::Checked, stop: &dyn Stop) -> Result<GeometryAnswer, NoAnswer> {
        let profiles = profile::profiles(drive, profile, stop)?;
        let (p, cam_outer_mm) = (drive.parameters(), drive.cam_outer_radius_mm());
        let flank = drive.flank();
        let steepest = drive.steepest_engaged().map_err(SolveError::from)?;
        let innermost = flank.locus().at(drive.flank_limit().position).map_err(SolveError::from)?;
        let center_distance_mm = drive.least_center_distance_mm().map_err(SolveError::from)?;
        let tip_radius_mm = drive.tip_radius_mm();
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
                loaded_wall: SlotWall::loaded(drive),
                finger: FingerAnswer::new(drive),
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
        // Two numbers of about 18 characters, each with its comma.
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
        let mut csv = csv::Writer::from_writer(writer);
        csv.write_record(["profile", "x_mm", "y_mm"]).map_err(csv_error)?;
        let profiles = [
            ("ring", &self.ring.profile),
            ("wave_generator", &self.wave_generator.profile),
            ("tooth_center_path", &self.tooth_center_path),
        ];
        for (name, profile) in profiles {
            for point in profile.x_mm.iter().zip(&profile.y_mm) {
                csv.serialize((name, point.0, point.1)).map_err(csv_error)?;
            }
        }
        csv.flush()
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
