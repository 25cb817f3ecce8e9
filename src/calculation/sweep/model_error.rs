//! How far the model is off elastic bodies, as it goes over the wire.

use std::io::{self, Write};

use serde::Serialize;
use toothwave_solver::LoadCase;
use toothwave_solver::model_error::{self as solver, Beyond, ErrorRange, Held, HeldCase, Measured, ModelError};
use utoipa::ToSchema;

use crate::design::{CompatibilityDocument, LawName};
use crate::json::word;

/// The expected error of the model, numerical ones apart: how far it was off elastic bodies, calculated by finite elements, in drives
/// of the same case (docs/explanation/validation.md).
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ModelErrorAnswer {
    /// The errors of the case; left out where nothing was measured of the law.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub measured: Option<MeasuredAnswer>,
    /// What comes on top of the wind-up's error for what gives way behind the contacts, of cylinders under `virtual_work` with `johnson`.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub held: Option<HeldAnswer>,
    /// The range of the drives that were calculated: cylinders of steel in a ring with fewer teeth.
    pub range: RangeAnswer,
    /// Whether this design lies within.
    pub is_within: bool,
    /// Why it does not.
    pub beyond: Vec<BeyondWord>,
}

/// What was measured of a case.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct MeasuredAnswer {
    /// Which case.
    pub case: CaseAnswer,
    /// Of the largest forces of the contacts.
    pub force: ErrorRangeAnswer,
    /// Of the stresses under them.
    pub stress: ErrorRangeAnswer,
    /// Of the wind-up, bodies being held at the law's depth; what gives way behind them, rim or fingers, comes on top.
    pub wind_up: ErrorRangeAnswer,
}

/// How far the wind-up is off for parts that are not held at the law's depth, unless they are given as series compliance.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct HeldAnswer {
    /// How they are held, after `parts`.
    pub case: HeldWord,
    /// What earlier calculations of elastic bodies held so found; left out where there were none.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schema(nullable = false)]
    pub wind_up: Option<ErrorRangeAnswer>,
    /// What the estimates of this design's own parts come to, of that part of the wind-up which the load adds to what gaps leave.
    pub estimated_wind_up: f64,
}

/// How parts are held.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum HeldWord {
    /// A rim in a housing, fingers at both ends; also where `parts` says nothing.
    Housed,
    /// Fingers that are slender though held at both ends.
    SlenderFingers,
    /// Fingers held at one end.
    FingersAtOneEnd,
    /// A rim with nothing around it.
    FreeRim,
}

impl From<HeldCase> for HeldWord {
    fn from(case: HeldCase) -> Self {
        match case {
            HeldCase::Housed => Self::Housed,
            HeldCase::SlenderFingers => Self::SlenderFingers,
            HeldCase::FingersAtOneEnd => Self::FingersAtOneEnd,
            HeldCase::FreeRim => Self::FreeRim,
        }
    }
}

/// What makes drives err alike.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct CaseAnswer {
    /// The form of compatibility.
    pub compatibility: CompatibilityDocument,
    /// The contact law.
    pub law: LawName,
    /// Whether the ring's teeth bend.
    pub ring_teeth_bend: bool,
    /// Whether the wave generator moves on under its teeth.
    pub wave_generator_moves: bool,
    /// Whether teeth are pressed against the corners of pointed or bored tips.
    pub corner_contact: bool,
    /// Whether any contact has a gap.
    pub has_gaps: bool,
    /// Whether the ring's tips are pointed or bored, so that teeth enter under load.
    pub has_pointed_tips: bool,
}

/// A relative error, (model - bodies)/bodies, from the least to the largest.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct ErrorRangeAnswer {
    /// The least; below zero the model says too little.
    pub low: f64,
    /// The largest.
    pub high: f64,
}

/// How far the drives went that were calculated.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct RangeAnswer {
    /// Most lobes.
    pub lobes: u32,
    /// Largest pressure angle of the ring's flank.
    pub pressure_angle_deg: f64,
    /// Largest gap of a contact, for teeth of this size.
    pub gap_um: f64,
    /// Largest wind-up, for so many lobes and teeth, such tips, and gaps or none.
    pub wind_up_deg: f64,
    /// Half of the largest width of a contact, over the tooth's radius; less where the law's own limit comes before.
    pub half_width_over_tooth_radius: f64,
}

/// Why a design lies outside the range.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, ToSchema)]
#[serde(rename_all = "snake_case")]
pub enum BeyondWord {
    /// Stiffnesses of the designer's own, or balls; any law but Johnson's: its errors are those of three drives, each under one load.
    Law,
    /// Teeth that are no cylinders.
    ToothShape,
    /// More lobes.
    Lobes,
    /// A ring with more teeth than the carrier.
    RingWithMoreTeeth,
    /// A steeper flank.
    PressureAngle,
    /// Teeth that enter under load, at angles that were left out: a real tip takes its load little by little, and the peak comes out lower. With `corner_contact`
    /// bored tips alone.
    EntryUnderLoad,
    /// Parts of unlike moduli.
    Materials,
    /// A larger gap.
    Gap,
    /// A larger wind-up: teeth no longer stand where they stand without load.
    WindUp,
    /// Parts made otherwise than conjugate.
    Modification,
    /// Something that gives way behind a contact.
    SeriesCompliance,
    /// A part behind a contact that gives way by more than can be left out.
    SoftBacking,
    /// A wider contact.
    HalfWidth,
}

impl From<Beyond> for BeyondWord {
    fn from(beyond: Beyond) -> Self {
        match beyond {
            Beyond::Law => Self::Law,
            Beyond::ToothShape => Self::ToothShape,
            Beyond::Lobes => Self::Lobes,
            Beyond::RingWithMoreTeeth => Self::RingWithMoreTeeth,
            Beyond::PressureAngle => Self::PressureAngle,
            Beyond::EntryUnderLoad => Self::EntryUnderLoad,
            Beyond::Materials => Self::Materials,
            Beyond::Gap => Self::Gap,
            Beyond::WindUp => Self::WindUp,
            Beyond::Modification => Self::Modification,
            Beyond::SeriesCompliance => Self::SeriesCompliance,
            Beyond::SoftBacking => Self::SoftBacking,
            Beyond::HalfWidth => Self::HalfWidth,
        }
    }
}

impl From<ErrorRange> for ErrorRangeAnswer {
    fn from(ErrorRange { low, high }: ErrorRange) -> Self {
        Self { low, high }
    }
}

impl ModelErrorAnswer {
    pub(crate) fn new(load: &LoadCase, error: ModelError) -> Self {
        let p = load.parameters();
        let measured = error.measured.map(|Measured { case, force, stress, wind_up }| MeasuredAnswer {
            case: CaseAnswer {
                compatibility: p.compatibility.into(),
                law: p.law.into(),
                ring_teeth_bend: p.ring_teeth_bend,
                wave_generator_moves: p.wave_generator_moves,
                corner_contact: p.corner_contact,
                has_gaps: case.has_gaps,
                has_pointed_tips: case.has_pointed_tips,
            },
            force: force.into(),
            stress: stress.into(),
            wind_up: wind_up.into(),
        });
        let beyond: Vec<_> = error.beyond.into_iter().map(BeyondWord::from).collect();
        let held = error.held.map(|Held { case, wind_up, estimated_wind_up }| HeldAnswer {
            case: case.into(),
            wind_up: wind_up.map(Into::into),
            estimated_wind_up,
        });
        Self {
            measured,
            held,
            range: RangeAnswer {
                lobes: solver::LOBES_TO,
                pressure_angle_deg: solver::PRESSURE_ANGLE_TO_DEG,
                gap_um: error.range.gap_um,
                wind_up_deg: error.range.wind_up_deg,
                half_width_over_tooth_radius: error.range.half_width_over_tooth_radius,
            },
            is_within: beyond.is_empty(),
            beyond,
        }
    }

    pub(crate) fn write_text(&self, writer: &mut dyn Write) -> io::Result<()> {
        let percent = |ErrorRangeAnswer { low, high }: &ErrorRangeAnswer| {
            format!("{:+.0} to {:+.0} %", 100.0 * low, 100.0 * high)
        };
        match &self.measured {
            Some(MeasuredAnswer { case, force, stress, wind_up }) => {
                writeln!(
                    writer,
                    "\nmodel against elastic bodies        force {}, stress {}",
                    percent(force),
                    percent(stress)
                )?;
                writeln!(writer, "wind-up of bodies that are held     {}", percent(wind_up))?;
                let refined = [
                    (case.ring_teeth_bend, "the ring's teeth bend"),
                    (case.wave_generator_moves, "the wave generator moves on under its teeth"),
                    (case.corner_contact, "teeth meet the corners of tips"),
                ];
                let refined: Vec<_> = refined.into_iter().filter(|(is, _)| *is).map(|(_, words)| words).collect();
                if !refined.is_empty() {
                    writeln!(writer, "refined                             {}", refined.join(", "))?;
                }
            }
            None => writeln!(writer, "\nmodel against elastic bodies        not measured")?,
        }
        if let Some(HeldAnswer { case, wind_up, estimated_wind_up }) = &self.held {
            let earlier = wind_up.as_ref().map_or_else(String::new, |range| format!("{}, ", percent(range)));
            let case = word(case).replace('_', " ");
            writeln!(writer, "wind-up besides, {case:<18} {earlier}estimated {:+.0} %", 100.0 * estimated_wind_up)?;
        }
        if self.is_within {
            return writeln!(writer, "this design                         within the range of those measured");
        }
        let beyond: Vec<_> = self.beyond.iter().map(word).collect();
        writeln!(
            writer,
            "this design                         beyond the range of those measured: {}",
            beyond.join(", ")
        )
    }
}
