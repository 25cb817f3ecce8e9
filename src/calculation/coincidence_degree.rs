//! Contact ratio (the paper's coincidence degree): how many teeth share the load.

use std::io::{self, Write};

use serde::Serialize;
use toothwave_solver::mesh::{Mesh, TeethInMesh};
use toothwave_solver::{Drive, Stop};
use utoipa::ToSchema;

use crate::design::Design;
use crate::findings::{FindingAnswer, drive_findings, write_findings};
use crate::forms::{Form, Format, Forms, write_csv};
use crate::geometry::{EngagementAnswer, UndercutAnswer};
use crate::no_answer::NoAnswer;
use crate::question::{Limits, Question, checked_drive};

/// Contact ratio of a drive, with the quantities that it depends on.
#[derive(Debug, Clone, PartialEq, Serialize, ToSchema)]
pub struct CoincidenceDegreeAnswer {
    /// Version of the solver.
    pub solver_version: &'static str,
    /// Build of the program. Equal builds on equal processors give equal bytes.
    pub build: &'static str,
    /// Contact ratio ε, counted over all meshing zones.
    pub coincidence_degree: f64,
    /// Range of positions in which a tooth touches the ring's flank.
    pub engagement: EngagementAnswer,
    /// Numbers of teeth in mesh over the input angle: of one zone if the zones are alike, otherwise of all zones.
    pub teeth_in_mesh_per_zone: TeethInMesh,
    /// True if the zones are alike.
    #[serde(skip)]
    zones_are_alike: bool,
    /// Undercut of the ring's tips.
    pub undercut: UndercutAnswer,
    /// Input angle after which the load pattern repeats.
    pub period_deg: f64,
    /// Findings about the design.
    pub findings: Vec<FindingAnswer>,
}

/// The question for the contact ratio.
#[derive(Debug)]
pub struct CoincidenceDegree;

impl Question for CoincidenceDegree {
    type Checked = Drive;
    type Answer = CoincidenceDegreeAnswer;

    fn name(&self) -> String {
        "coincidence-degree".into()
    }

    fn reads(&self, design: &Design) -> impl Serialize {
        design.in_key().drive
    }

    fn check(&self, design: &Design, _: &Limits) -> Result<Drive, NoAnswer> {
        let mut violations = Vec::new();
        checked_drive(design, &mut violations)?.drive().ok_or_else(|| NoAnswer::impossible(&violations))
    }

    fn answer(drive: &Drive, _: &dyn Stop) -> Result<CoincidenceDegreeAnswer, NoAnswer> {
        let mesh = Mesh::new(drive);
        Ok(CoincidenceDegreeAnswer {
            solver_version: toothwave_solver::VERSION,
            build: crate::BUILD,
            coincidence_degree: mesh.coincidence_degree(),
            engagement: drive.into(),
            teeth_in_mesh_per_zone: mesh.teeth_in_mesh(),
            zones_are_alike: mesh.zones_are_alike(),
            undercut: drive.into(),
            period_deg: mesh.period_deg(),
            findings: drive_findings(drive)?,
        })
    }
}

impl Forms for CoincidenceDegreeAnswer {
    const FORMS: &'static [(Format, Form<Self>)] = &[(Format::Csv, Self::write_csv), (Format::Text, Self::write_text)];
}

impl CoincidenceDegreeAnswer {
    fn write_csv(&self, writer: &mut dyn Write) -> io::Result<()> {
        let names = [
            "coincidence_degree",
            "engagement_start_deg",
            "engagement_end_deg",
            "teeth_in_mesh_per_zone_min",
            "teeth_in_mesh_per_zone_max",
            "period_deg",
        ];
        let EngagementAnswer { start_deg, end_deg } = self.engagement;
        let TeethInMesh { min, max } = self.teeth_in_mesh_per_zone;
        write_csv(&names, [(self.coincidence_degree, start_deg, end_deg, min, max, self.period_deg)], writer)
    }

    fn write_text(&self, writer: &mut dyn Write) -> io::Result<()> {
        let TeethInMesh { min, max } = self.teeth_in_mesh_per_zone;
        writeln!(writer, "coincidence degree                  {:.12}", self.coincidence_degree)?;
        let zones = if self.zones_are_alike { "each zone" } else { "all zones" };
        writeln!(writer, "teeth in mesh, {zones}            {min} to {max}")?;
        writeln!(writer, "period of the input angle           {:.6} deg", self.period_deg)?;
        self.engagement.write_text(writer)?;
        self.undercut.write_text(writer)?;
        write_findings(&self.findings, writer)
    }
}
